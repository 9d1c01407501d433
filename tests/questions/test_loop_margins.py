"""`accuracy.loop`: settings by published rules, margins of every plant within r_u, and refusals."""

from __future__ import annotations

import re

import cvxpy as cp
import numpy as np
import pytest
import scipy.stats

from inputdesign_cli import assess, load_spec, parse_spec, solve
from inputdesign_cli.errors import SpecError
from inputdesign_cli.questions.building.controllers import Process, process_of, tuned
from inputdesign_cli.specification.models.loop import Amigo, LoopMargin, Simc, Tuning

GAIN, LAG, DEAD, H = 2.1, 180.0, 25.0, 5.0
TEXT = """
sample_time: 5
plant: {continuous: {gain: 2.1, time_constant: 180, dead_time: 25}, sample: zoh}
noise: {variance: 0.04}
experiment: {samples: 720}
accuracy: {loop: {tuning: {simc: {tau_c: 30}}, max_sensitivity_db: 6}}
spectrum: {type: fir, order: 10}
signal: {candidates: 1}
"""


def peak(process, pid, *, period=1e-3):
    """The peak of |S| in continuous time, by the formula of the loop."""
    w = np.geomspace(1e-3, 30.0, 20001) / process.dead_time
    s = 1j * w
    below = s if process.time_constant is None else process.time_constant * s + 1.0
    plant = process.gain * np.exp(-process.dead_time * s) / below
    derivative = 1.0 + (0.0 if pid.Td is None else pid.Td * s / (pid.filter_time * s + 1.0))
    controller = pid.Kp * (derivative + 1.0 / (pid.Ti * s))
    return np.max(1.0 / np.abs(1.0 + plant * controller))


@pytest.mark.parametrize(
    ("lag", "published"), [(1.0, 1.59), (8.0, 1.59), (None, 1.70)], ids=["lag", "slow", "integrator"]
)
def test_simc_has_the_sensitivity_peaks_that_skogestad_prints(lag, published):
    """Skogestad (2003), Table 1 for tau_c = theta: M_s = 1.59 where the lag is cancelled, 1.70 for k'/s."""
    process = Process(3.0, lag, 1.0)
    assert peak(process, tuned(process, Tuning(simc=Simc()))) == pytest.approx(published, abs=0.006)


@pytest.mark.parametrize("kind", ["pi", "pid"])
@pytest.mark.parametrize("lag", [0.3, 1.0, 3.0, 10.0])
def test_amigo_has_about_the_sensitivity_peak_that_it_is_fitted_for(lag, kind):
    """The rules were fitted for M = 1.4."""
    process = Process(-2.0, lag, 1.0)
    assert 1.2 < peak(process, tuned(process, Tuning(amigo=Amigo(type=kind)))) < 1.65


def test_settings_scale_with_gain_and_time():
    for rule in (Tuning(simc=Simc()), Tuning(amigo=Amigo()), Tuning(amigo=Amigo(type="pid"))):
        for lag in (2.0, None):
            one = tuned(Process(1.0, lag, 0.5), rule)
            per_time = 1.0 if lag is not None else 60.0  # an integrator's gain has a unit of time
            other = tuned(Process(4.0 / per_time, lag and 60.0 * lag, 30.0), rule)
            assert other.Kp == pytest.approx(one.Kp / 4.0)
            assert (other.Ti, other.Td) == pytest.approx((60.0 * one.Ti, 60.0 * one.Td))


@pytest.mark.parametrize(
    ("plant", "expected"),
    [
        ("{gain: 2, time_constant: 10, dead_time: 3}", (2.0, 10.0, 4.0)),
        ("{numerator: [2], denominator: [[10, 1], [4, 1]], delay: 3}", (2.0, 12.0, 6.0)),
        ("{numerator: [6], denominator: [3, 0], delay: 1}", (2.0, None, 2.0)),
        ("{numerator: [2], denominator: [4, 1, 0], delay: 1}", (2.0, None, 4.0)),
    ],
)
def test_a_second_lag_and_half_a_sample_are_reduced_by_the_half_rule(plant, expected):
    text = f"sample_time: 2\nplant: {{continuous: {plant}, sample: zoh}}\nnoise: {{variance: 1}}\n"
    found = process_of(parse_spec(text, design=False))
    assert (found.gain, found.dead_time) == pytest.approx((expected[0], expected[2]))
    assert found.time_constant == (None if expected[1] is None else pytest.approx(expected[1]))


def sampled(theta, w):
    """The heater behind a hold, in closed form."""
    K, T, L = theta
    d = int(np.floor(L / H + 1e-12))
    a, early = np.exp(-H / T), 1.0 - np.exp(-(H - (L - d * H)) / T)
    q = np.exp(-1j * w)
    return K * q ** (d + 1) * (early + (1.0 - a - early) * q) / (1.0 - a * q)


def pi(settings, w):
    """Kp (1 + 1/(Ti s)) by the trapezoidal rule."""
    q = np.exp(-1j * w)
    return settings["Kp"] * (1.0 + H / (2.0 * settings["Ti"]) * (1.0 + q) / (1.0 - q))


def test_drawn_plants_within_the_admissible_error_keep_the_margins_of_the_loop():
    """Plants are drawn from the estimate; gain and phase margins are read off each response."""
    found = solve(parse_spec(TEXT, overrides=["solver.any_spectrum=false"])).result
    (asked,) = found["requirements"]
    loop = asked["loop"]
    assert loop["Ti"] == pytest.approx(180.0)  # 4 (30 + 27.5) > 180
    assert loop["Kp"] == pytest.approx(180.0 / (2.1 * 57.5))
    assert loop["max_sensitivity"] == pytest.approx(10 ** (6 / 20))
    w = np.geomspace(1e-4, np.pi, 20001)
    nominal = np.abs(1.0 / (1.0 + sampled((GAIN, LAG, DEAD), w) * pi(loop, w)))
    assert loop["nominal_peak"] == pytest.approx(nominal.max(), rel=1e-4)
    middles = (np.arange(100_000) + 0.5) * np.pi / 100_000
    moved = np.abs(pi(loop, middles) / (1.0 + sampled((GAIN, LAG, DEAD), middles) * pi(loop, middles)))
    assert loop["input_deviation"] == pytest.approx(np.sqrt(0.04 * np.mean(moved**2)), rel=1e-6)
    root = np.linalg.cholesky(np.array(found["information"]["covariance"]))
    w, theta, rng = w[::20], np.array([GAIN, LAG, DEAD]), np.random.default_rng(0)
    C, G = pi(loop, w), sampled(theta, w)
    admitted = (np.abs(1.0 + C * G) - 1.0 / loop["max_sensitivity"]) / np.abs(C)
    kept = 0
    for _ in range(500):
        other = sampled(theta + root @ rng.standard_normal(3), w)
        L = other * C
        peak_of = np.max(np.abs(1.0 / (1.0 + L)))
        kept += peak_of <= loop["max_sensitivity"]
        if np.all(np.abs(other - G) <= admitted):  # then the margins are guaranteed
            assert peak_of <= loop["max_sensitivity"] * (1.0 + 1e-9)
            crossing = np.flatnonzero(np.diff(np.sign(np.abs(L) - 1.0)))
            turning = np.flatnonzero((np.diff(np.sign(L.imag)) != 0.0) & (L.real[1:] < 0.0))
            assert 1.0 / np.max(np.abs(L[turning]), initial=1e-9) >= loop["gain_margin"] - 0.02
            assert np.degrees(np.min(np.abs(np.angle(-L[crossing])))) >= loop["phase_margin"] - 0.5
    assert kept >= 0.95 * 500


@pytest.mark.slow
def test_the_least_cost_for_a_loop_is_that_of_a_program_in_cvxpy():
    """r_adm follows from the formula of the loop, and alpha from three parameters."""
    found = solve(load_spec("specs/heater_loop.yaml")).result
    lines, w = np.arange(1, 121) * np.pi / 120, np.geomspace(0.03, 1.5, 90)
    theta, step = np.array([GAIN, LAG, DEAD]), 1e-6

    def gradient(w):
        # The dead time is a multiple of the sample time: one-sided differences towards longer ones.
        moves = step * np.eye(3)
        K, T = ((sampled(theta + m, w) - sampled(theta - m, w)) / (2 * step) for m in moves[:2])
        later = [sampled(theta + k * moves[2], w) for k in (0, 1, 2)]
        return np.stack([K, T, (-1.5 * later[0] + 2 * later[1] - 0.5 * later[2]) / step], axis=1)

    settings = {"Kp": 180.0 / (2.1 * 57.5), "Ti": 180.0}
    C, G = pi(settings, w), sampled(theta, w)
    admitted = (np.abs(1.0 + C * G) - 10 ** (-6 / 20)) / np.abs(C)
    F, T = gradient(lines) * theta, gradient(w) * theta
    alpha = np.sqrt(scipy.stats.chi2.ppf(0.95, 3))
    F = F * np.sqrt(720 / 0.04 * 1e-3)
    whiten = np.linalg.inv(np.linalg.cholesky((F.T @ F.conj()).real))  # so that numbers are of one size
    F, T = F @ whiten.T, T @ whiten.T
    powers = cp.Variable(120, nonneg=True)
    M = sum(p * np.outer(f, f.conj()).real for p, f in zip(powers, F, strict=True))
    asked = []
    for row, most in zip(T, admitted, strict=True):
        parts = np.stack([row.real, row.imag]) * alpha / most
        asked.append(M >> parts.T @ parts)
    plain = cp.Problem(cp.Minimize(cp.sum(powers)), asked)
    plain.solve(solver="CLARABEL", tol_gap_rel=1e-7, tol_gap_abs=1e-7, tol_feas=1e-7)
    assert found["cost"] == pytest.approx(1e-3 * plain.value, rel=1e-3)
    assert found["cost"] >= 1e-3 * plain.value * (1.0 - 1e-6)  # the program has 90 frequencies only


@pytest.mark.parametrize(
    ("margin", "expected"),
    [("max_sensitivity_db: 6.0206", 2.0), ("gain_margin: 2", 2.0), ("phase_margin: 28.955", 2.0)],
)
def test_gain_and_phase_margins_are_converted_to_the_peak_that_ensures_them(margin, expected):
    key, value = margin.split(": ")
    assert LoopMargin(**{key: float(value)}).peak == pytest.approx(expected, rel=1e-5)


@pytest.mark.slow
def test_assess_tunes_the_controller_for_the_estimated_plant(tmp_path):
    rng = np.random.default_rng(2)
    u = 2.0 * np.sign(rng.standard_normal(72)).repeat(10)
    y, a = np.zeros(720), np.exp(-H / 200.0)
    for t in range(7, 720):
        y[t] = a * y[t - 1] + 2.4 * (1 - a) * u[t - 6]
    path = tmp_path / "record.csv"
    rows = np.column_stack([u, y + 0.2 * rng.standard_normal(720)])
    np.savetxt(path, rows, delimiter=",", header="u,y", comments="")
    found = assess(parse_spec(TEXT), path)
    assert found.verdict == "met"
    (asked,) = found.results.result["assessment"]["requirements"]
    assert asked["loop"]["Ti"] == pytest.approx(200.0, rel=0.1)
    assert asked["loop"]["Kp"] == pytest.approx(200.0 / (2.4 * 57.5), rel=0.1)


MARGINS = pytest.mark.parametrize("margin", ["phase_margin: 50", "max_sensitivity_db: 3", "gain_margin: 4"])


def refusal(margin):
    """The loop with this margin, and its refusal."""
    stated = f"accuracy={{loop: {{tuning: {{simc: {{tau_c: 30}}}}, {margin}}}}}"
    with pytest.raises(SpecError) as caught:
        solve(parse_spec(TEXT, overrides=[stated]))
    return stated, caught.value.diagnostics[0]


@MARGINS
def test_a_margin_that_the_loop_lacks_is_refused_with_values_of_the_same_kind(margin):
    """The nominal plant just keeps the first value; the second allows a peak larger by a factor of 1.2."""
    _, refused = refusal(margin)
    key = margin.partition(":")[0]
    edge, roomy = (
        LoopMargin(**{key: float(found)}) for found in re.findall(rf"{key}: ([\d.]+)", refused.hint)
    )
    assert "tau_c" in refused.hint
    own = "accuracy={loop: {controller: {pid: {Kp: 1.3, Ti: 180}}, max_sensitivity_db: 3}}"
    with pytest.raises(SpecError, match=r"reaches") as caught:
        solve(parse_spec(TEXT, overrides=[own]))
    assert "tau_c" not in caught.value.diagnostics[0].hint
    reached = float(re.search(r"reaches ([\d.]+)", refused.message)[1])
    assert reached <= edge.peak * (1.0 + 1e-4) <= 1.003 * reached
    assert roomy.peak == pytest.approx(1.2 * reached, rel=3e-3)


@pytest.mark.slow
@MARGINS
def test_the_larger_peak_that_the_hint_proposes_has_a_design(margin):
    stated, refused = refusal(margin)
    roomy = re.search(r"example (\w+: [\d.]+)", refused.hint)[1]
    assert solve(parse_spec(TEXT, overrides=[stated.replace(margin, roomy)])).result["status"] == "optimal"


def test_no_deviation_of_the_input_is_stated_for_drifting_noise():
    """The controlled input follows the drift without bound."""
    found = solve(parse_spec(TEXT, overrides=["noise.drift=true", "solver.any_spectrum=false"])).result
    assert "input_deviation" not in found["requirements"][0]["loop"]
