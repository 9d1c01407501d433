"""What lines without excitation say of a plant, in the result and in sentences."""

from __future__ import annotations

from collections.abc import Mapping

from inputdesign_cli.identification.silent_lines import SilentLines
from inputdesign_cli.runs.results import Json

# Silent lines whose probability is below this speak.
_SPEAKS = 0.01


def silent_entry(silent: Mapping[str, SilentLines]) -> dict[str, Json]:
    """`nonlinearity` of the result, by kind of the lines: odd and even; lists are by output."""
    return {
        kind: {
            "lines": found.lines,
            "over_noise": found.over_noise.tolist(),
            "probability": found.probability.tolist(),
            "rms": found.rms.tolist(),
        }
        for kind, found in silent.items()
    }


def silent_notes(silent: Mapping[str, SilentLines]) -> list[str]:
    """A sentence for each kind of lines that speaks."""
    notes = []
    for kind, found in silent.items():
        chance = float(found.probability.min())
        if chance < _SPEAKS:
            level = ", ".join(f"{value:.3g}" for value in found.rms)
            notes.append(
                f"the outputs answer at {kind} lines that are not excited (rms {level}, probability of "
                f"chance {chance:.2g}): a nonlinearity of {kind} degree, or an input that was not applied as "
                "recorded"
            )
    return notes
