"""The wizard takes the simplest spectrum that is near to every other, and rather one that does not repeat."""

from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import parse_spec, questions
from inputdesign_cli.wizard.composing import compose, with_spectrum
from tests.wizard.test_wizard import ENGINEER


def chosen(values, bound=1.0, rivals=()):
    """The draft and the spectra that were tried, of designs that reach these values."""
    tried = []

    def solve(spec):
        tried.append(spec.spectrum.order if spec.spectrum.type == "fir" else spec.spectrum.lines)
        number = len(tried) - 1
        found = {"objective": {"value": values[number], "any_spectrum_bound": bound}}
        return found | ({"foreseen": {"rivals": [{}] if number in rivals else []}})

    return with_spectrum(compose(ENGINEER, "x", Path()), solve), tried


@pytest.mark.parametrize(
    ("values", "bound", "rivals", "tried", "spectrum", "told"),
    [
        ((1.01,), 1.0, (), [20], "{type: fir, order: 20}", "by more than 1 %"),
        ((1.2, 1.015), 1.0, (), [20, 40], "{type: fir, order: 40}", "by more than 1.5 %"),
        ((1.5, 1.3, 1.05, 1.01), 1.0, (), [20, 40, 60, 120], "{type: multisine, lines: 120}", "1 %"),
        # No more unknowns help, and the bound leaves limits out.
        (
            (1.0,) * 5,
            0.05,
            (),
            [20, 40, 60, 120, 240],
            "{type: fir, order: 20}",
            "no better, as far as was tried",
        ),
        (
            (1.0,) * 5,
            None,
            (),
            [20, 40, 60, 120, 240],
            "{type: fir, order: 20}",
            "no better, as far as was tried",
        ),
        # Sinusoids begin badly, go on improving, and overtake.
        ((0.5, 0.4, 4.8, 1.7, 0.3), 0.299, (), [20, 40, 60, 120, 240], "{type: multisine, lines: 240}", "by"),
        # The first leaves another dead time open.
        ((1.0, 1.01), 1.0, (0,), [20, 40], "{type: fir, order: 40}", "by more than 1 %"),
    ],
)
def test_the_simplest_spectrum_that_is_near_to_every_other(values, bound, rivals, tried, spectrum, told):
    draft, seen = chosen(values, bound, rivals)
    assert seen == tried
    assert draft.spectrum == spectrum
    assert told in draft.text
    assert parse_spec(draft.text).spectrum.type == ("fir" if "fir" in spectrum else "multisine")


def test_gaps_are_told_without_exponents():
    draft, _ = chosen((1.9,) * 5)
    assert "by more than 90 %" in draft.text
    assert "e+" not in draft.text


@pytest.mark.slow
def test_the_record_does_not_repeat():
    """A record that repeats every 120 samples would tell a dead time up to 600 s only."""
    spec = compose(ENGINEER, "x", Path()).spec().with_(uncertainty=None, **{"signal.candidates": 1})
    found = questions.solve(spec)
    u = found.tables["signal"].columns["u1"] - 40.0
    assert found.result["foreseen"] == {"rivals": []}
    correlations = [abs(u[lag:] @ u[:-lag]) / (u @ u) for lag in range(60, 480)]
    assert max(correlations) < 0.5
    assert np.abs(u).max() <= 5.0
