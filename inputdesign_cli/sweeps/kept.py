"""Checks of an earlier sweep in a directory: is it the same sweep, and does each of its points hold?"""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import isfinite
from pathlib import Path

from inputdesign_cli.errors import STANDARD_STREAM, DataError, OutputError, SpecError
from inputdesign_cli.outcome.origin import digest
from inputdesign_cli.outcome.record import SPEC as POINT_SPEC
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.outcome.run_directory import read_run
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification.yaml.plain import to_yaml
from inputdesign_cli.specification.yaml.reader import read
from inputdesign_cli.sweeps.layout import SPEC, SUMMARY, Layout
from inputdesign_cli.sweeps.plan import Plan, without_sweep
from inputdesign_cli.sweeps.point import FAILURES

# Values and bounds are written to all digits; a gap may be of a bound that was rounded up to the value.
_ROUNDING = 1e-6
_OF_GAP = 1e-3


def flaw(layout: Layout, key: str, spec: str | None = None) -> str:
    """Return what is wrong with what is there of a point; nothing where it holds, or where there is nothing.

    Args:
        spec: the resolved spec of the point, where it is known.
    """
    if layout.has_result(key):
        return run_flaw(layout.run(key), spec)
    return _failure_flaw(layout.failure(key)) if layout.has_failure(key) else ""


def run_flaw(directory: Path, spec: str | None = None) -> str:
    """Return what is wrong with the run of a point, of this `spec` if it is known; nothing where it holds."""
    try:
        result = read_run(directory)
        written = digest(read_regular(directory / POINT_SPEC).decode("utf-8"))
    except DataError as error:
        return error.diagnostics[0].message
    except (OSError, ValueError) as error:
        return f"{directory / POINT_SPEC} cannot be read: {error}"
    if result.get("spec_sha256") != written or (spec is not None and written != digest(spec)):
        return f"{directory} is not the run of this point: it has another spec"
    why = _contradiction(result.get("objective"))
    return f"{directory / 'result.json'} contradicts itself: {why}" if why else ""


def _contradiction(objective: Json) -> str:
    """Return how an objective contradicts its own bounds and gap; an empty text if it does not."""
    if objective is None:
        return ""
    if not isinstance(objective, dict):
        return "its objective is no mapping"
    names = ("value", "lower_bound", "upper_bound", "any_spectrum_bound", "relative_gap")
    known = {name: objective[name] for name in names if name in objective}
    for name, number in known.items():
        if isinstance(number, bool) or not isinstance(number, int | float) or not isfinite(number):
            return f"objective.{name} is no number"
    if "value" not in known:
        return "its objective has no value"
    value, sign = known["value"], -1.0 if "upper_bound" in known else 1.0
    slack = _ROUNDING * (abs(value) + (objective.get("kind") == "D"))  # a logarithm may be zero
    for name in ("lower_bound", "upper_bound", "any_spectrum_bound"):
        if name in known and sign * (known[name] - value) > slack:
            return f"objective.value is {value:.6g}, beyond its {name} {known[name]:.6g}"
    bound = known.get("lower_bound", known.get("upper_bound"))
    # That of D is relative to the number of parameters.
    if bound is None or "relative_gap" not in known or objective.get("kind") == "D" or value == 0:
        return ""
    gap, stated = abs(value - bound) / abs(value), known["relative_gap"]
    if abs(gap - stated) > _ROUNDING + _OF_GAP * stated:
        return f"objective.value {value:.6g} and its bound {bound:.6g} have another gap than {stated:.3g}"
    return ""


def _failure_flaw(path: Path) -> str:
    """Return what is wrong with the file that says why a point has no result."""
    try:
        content = json.loads(read_regular(path))
    except (OSError, ValueError, RecursionError) as error:
        return f"{path} cannot be read: {error}"
    whole = isinstance(content, dict) and content.get("status") in FAILURES
    texts = ("code", "message", "hint", "key")
    if whole and content.get("code") and all(isinstance(content.get(name), str) for name in texts):
        return ""
    return f"{path} is not what idesign writes of a failure"


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
        return  # a sweep that was killed at its very start left nothing to compare
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
    """Return the spec of the sweep that is there without its axes, or None if it cannot be read."""
    try:
        data = read(read_regular(root / SPEC).decode("utf-8"), SPEC).data
    except (OSError, ValueError, SpecError):
        return None
    return to_yaml(without_sweep(data)) if isinstance(data, dict) else None
