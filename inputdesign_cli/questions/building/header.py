"""Spec -> units and header, which travel with all that is computed; keys that no question handles."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from inputdesign_cli.errors import bad_spec
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.specification import Spec


def build_units(spec: Spec) -> Units:
    """Build the units and channel names of the experiment of a spec."""
    return Units(
        time_unit=spec.time_unit,
        sample_time=spec.sample_time,
        sampled=spec.plant.sampled,
        closed_loop=spec.experiment.controller is not None,
        inputs=spec.plant.inputs,
        outputs=spec.plant.outputs,
        channels={name: (one.name or "", one.unit or "") for name, one in (spec.channels or {}).items()},
        by_duration=spec.experiment.duration is not None or spec.limits.duration is not None,
    )


def build_header(spec: Spec) -> Header:
    """Build the header of all results of a spec."""
    return Header(spec.title, spec.to_yaml(), build_units(spec))


ONE_PLANT = "remove uncertainty, or ask for a design with model_error, information or a criterion"
"""What to do about `uncertainty` in a question of one plant."""


def refuse_unhandled(
    spec: Spec,
    question: str,
    remedies: Mapping[str, str],
    handled: Mapping[str, tuple[str, ...]] | None = None,
) -> None:
    """Raise `SpecError` (`not-supported`) at the first key of `remedies` that the `question` does not handle.

    `handled` are values of some of these keys that it handles.
    """
    values = [spec.at(*key.split(".")) for key in remedies]
    for (key, remedy), value in zip(remedies.items(), values, strict=True):
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
