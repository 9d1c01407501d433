"""Refuse keys of a spec that a kind of question does not handle."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from inputdesign_cli.errors import bad_spec
from inputdesign_cli.specification import Spec

ONE_PLANT = "remove uncertainty, or ask for a design with model_error, information or a criterion"
"""The remedy for `uncertainty` in a question about one plant."""
_OF_CAMPAIGNS = {"signal.least_move": "it is for the parts of a campaign"}


def refuse_unhandled(
    spec: Spec,
    question: str,
    remedies: Mapping[str, str],
    handled: Mapping[str, tuple[str, ...]] | None = None,
) -> None:
    """Raise `SpecError` (`not-supported`) at the first key of `remedies` that the `question` does not handle.

    `handled` are values of some of these keys that it handles.
    """
    refused = {**remedies, **({} if spec.campaign else _OF_CAMPAIGNS)}
    values = [spec.at(*key.split(".")) for key in refused]
    for (key, remedy), value in zip(refused.items(), values, strict=True):
        if value is not None and value not in (handled or {}).get(key, ()):
            stated = f"{key}: {value}" if isinstance(value, str) else key
            raise bad_spec("not-supported", f"{question} does not handle {stated}", hint=remedy, key=key)


def check_compared(inputs: Iterable[str], *known: str) -> None:
    """Raise `SpecError` (`not-supported`) for inputs that this kind of question does not compare with."""
    for name in inputs:
        if name not in known:
            message = f"the design is compared with {' or '.join(known)} inputs here, not with {name}"
            hint = f"write compare: [{', '.join(known)}]"
            raise bad_spec("not-supported", message, hint=hint, key="simulation.compare")
