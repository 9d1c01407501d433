"""Faults of the answer to a spec: an exception that is not ours, a warning, or a false statement.

All figures of an answer are drawn, too.
"""

from __future__ import annotations

import json
import math
import traceback
import warnings
from pathlib import Path

from inputdesign_cli import parse_spec, solve, validate
from inputdesign_cli.diagnostics import explanations, render
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.figures.plots import draw_all
from inputdesign_cli.outcome.codec import json_text
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.run_directory import finished_result
from tests.fuzzing.textbook import NotJudgedError, findings

# No input leads to these: they say that something is wrong with the program.
_OURS_TO_MEND = ("internal-disagreement",)


def judged(text: str, folder: Path) -> tuple[str, str]:
    """The end of a spec of this text, a status or the code of an error, and the fault in that, if any."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            spec = parse_spec(text, "fuzz.yaml", folder=folder)
            validate(spec)
            results = solve(spec)
            result = written(results)
            end, wrong = result["status"], nonsense(dict(spec.content), result)
            wrong = wrong or undrawn(results)
        except IdesignError as error:
            end = error.diagnostics[0].code
            wrong = "" if render(error) and end in explanations() else "no such code"
            if end in _OURS_TO_MEND:
                wrong = str(error)
        except Exception:
            end, wrong = "exception", traceback.format_exc(limit=-4)
    if caught and not wrong:
        wrong = f"warning: {caught[0].message} ({caught[0].filename}:{caught[0].lineno})"
    return end, wrong


def undrawn(results: Results) -> str:
    """Figures that come out empty; one that fails raises."""
    return ", ".join(f"{name} is empty" for name, drawn in draw_all(results).items() if not drawn)


def written(results: Results) -> dict:
    """The content of `result.json`."""
    return json.loads(json_text(finished_result(results)))


def nonsense(spec: dict, result: dict) -> str:
    """The false statements of a result; empty if there are none, or if it cannot be judged."""
    objective = result.get("objective", {})
    if result.get("status") in ("optimal", "almost_optimal") and "value" in objective:
        value, gap = objective["value"], 1e-4 * abs(objective["value"]) + 1e-4
        if (
            objective.get("lower_bound", -math.inf) > value + gap
            or objective.get("upper_bound", math.inf) < value - gap
        ):
            return f"the value {value} contradicts its bound: {objective}"
    try:
        return "; ".join(findings(spec, result))
    except NotJudgedError:
        return ""
