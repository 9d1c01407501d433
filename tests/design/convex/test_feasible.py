"""What cannot be met is proved, and lines that are too few are refused."""

import numpy as np
import pytest

from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.errors import InfeasibleError, SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.spectrum import LinesBasis
from tests.support.convex_designs import anywhere, relative, solve


def test_unreachable_accuracy_is_proved(first_order):
    """Half the least power: the limits must be doubled, and the proof says so."""
    least = solve(first_order, requirements=relative()).result.objective
    with pytest.raises(UnreachableError) as caught:
        solve(first_order, requirements=relative(), limits=[PowerLimit("input", 0.5 * least)])
    assert caught.value.nearest.certificate.bound == pytest.approx(2.0, rel=1e-4)
    assert not caught.value.limits_alone


def test_contradictory_limits_are_proved(first_order):
    """Input power times the peak of |G|^2 is the most output power there is."""
    floors = [PowerLimit("output", 288.0, upper=False), PowerLimit("input", 1.0)]
    with pytest.raises(UnreachableError) as caught:
        solve(first_order, requirements=relative(), basis=anywhere(), limits=floors)
    assert caught.value.limits_alone
    assert caught.value.nearest.certificate.bound == pytest.approx(288.0 / 144.0, rel=1e-4)


def test_too_few_lines_are_refused():
    B, A = [0, 1.0, 0.5], [1, -0.5, 0.3]
    experiment = Experiment(PolynomialModel.single(B, A=A), 100000)
    oe = Experiment(PolynomialModel.single(B, F=A), 100)
    with pytest.raises(SpecError) as caught:
        solve(oe, requirements=relative(0.1), basis=LinesBasis.at(np.array([0.4]), 1))
    assert caught.value.diagnostics[0].code == "too-few-lines"
    # ARX learns from the noise as well, so that a modest accuracy is within reach of a single line.
    line = LinesBasis.at(np.array([0.4]), 1)
    assert solve(experiment, requirements=relative(0.3), basis=line).result.gap <= 1e-6
    with pytest.raises(InfeasibleError):
        solve(experiment, requirements=relative(0.001), basis=line)
