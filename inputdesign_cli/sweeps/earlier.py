"""Whose the sweep in a directory is: another one does not replace its table without being told to."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from inputdesign_cli.errors import STANDARD_STREAM, OutputError, SpecError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification.yaml.plain import to_yaml
from inputdesign_cli.specification.yaml.reader import read
from inputdesign_cli.sweeps.layout import SPEC, SUMMARY
from inputdesign_cli.sweeps.plan import Plan, without_sweep


def check_same_sweep(plan: Plan, made_from: Sequence[str], root: Path) -> None:
    """Refuse a directory with the sweep of another spec, of other keys, or of another command.

    The same spec file, or a spec that says the same, may go on with other values of the same keys.

    Args:
        made_from: the spec file as it is seen from `root`.

    Raises:
        OutputError: `output-other-run`.
    """
    try:
        there = json.loads(read_regular(root / SUMMARY))
        keys = [axis["key"] for axis in there["axes"]]
        verb, theirs = there["verb"], there.get("made_from")
    except (OSError, ValueError, RecursionError, KeyError, TypeError):
        return  # nothing that could be told apart, as where a sweep was killed at its very start
    ours = [axis.key for axis in plan.grid.axes]
    same_file = theirs == list(made_from) != [STANDARD_STREAM]
    if verb != plan.verb:
        what = f"the command {verb}, not {plan.verb}"
    elif set(keys) != set(ours):
        what = f"{', '.join(map(str, keys))}, not {', '.join(ours)}"
    elif not same_file and _base(root) not in (None, to_yaml(without_sweep(plan.draft.data))):
        of = f" ({theirs[0]} as seen from there)" if isinstance(theirs, list) and theirs else ""
        what = f"another spec{of}"
    else:
        return
    raise OutputError.because(
        "output-other-run",
        f"{root} holds the sweep of {what}, and would lose its table",
        hint="choose another directory with -o, or replace the sweep with --overwrite",
    )


def _base(root: Path) -> str | None:
    """The spec of the sweep that is there but for what is varied; None where it cannot be told."""
    try:
        data = read(read_regular(root / SPEC).decode("utf-8"), SPEC).data
    except (OSError, ValueError, SpecError):
        return None
    return to_yaml(without_sweep(data)) if isinstance(data, dict) else None
