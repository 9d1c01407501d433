"""Requirements against their definitions: r_u, cuts, admissible errors, criteria, ellipsoids."""

import dataclasses

import numpy as np
import pytest

from inputdesign_cli import analyse, parse_spec
from inputdesign_cli.accuracy import (
    Absolute,
    Criterion,
    EllipsoidError,
    InformationTarget,
    ModelError,
    Relative,
    Sensitivity,
    Table,
    Weighted,
    WeightedVariance,
)
from inputdesign_cli.accuracy.model_error import check_positive
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import PolynomialModel, Rational
from tests.support.convex_designs import BAND, DENSE
from tests.support.plants import arx
from tests.support.refusals import refused


def information(size, seed, scale=1.0):
    root = np.random.default_rng(seed).normal(size=(size, size + 2))
    return scale * root @ root.T


def first_order_error(experiment, admissible, alpha, band=(0.0, np.pi)):
    return ModelError(experiment=experiment, band=band, entry=(0, 0), admissible=admissible, alpha=alpha)


SINGLE = PolynomialModel.single([0, 3.6], F=[1, -0.7], C=[1, -0.9], D=[1, 0.2])


@pytest.mark.parametrize(
    ("model", "entry"), [(SINGLE, (0, 0)), (SINGLE, None), (arx(), (1, 0)), (arx(), None)]
)
def test_error_bound_agrees_with_its_definition(model, entry):
    """r_u is alpha sqrt(lambda_max(T P T^T)), equation (6), for an entry of G or for its Frobenius norm."""
    M = information(model.theta.size, 1)
    P = np.linalg.inv(M)
    requirement = ModelError(
        experiment=Experiment(model, 500),
        band=(0.0, np.pi),
        entry=entry,
        admissible=Absolute(1.0),
        alpha=2.45,
    )
    w = np.array([0.0, 0.2, 1.0, np.pi])
    expected = []
    for gradient in model.plant_gradient(w):  # (k, p, r)
        entries = np.ndindex(gradient.shape[1:]) if entry is None else [entry]
        T = np.array([part for i, j in entries for part in (gradient[:, i, j].real, gradient[:, i, j].imag)])
        expected.append(2.45 * np.sqrt(np.linalg.eigvalsh(T @ P @ T.T)[-1]))
    np.testing.assert_allclose(requirement.error_bound(M, w), expected, rtol=1e-12)
    np.testing.assert_allclose(requirement.ratios(M, w), expected, rtol=1e-12)


@pytest.mark.parametrize("frequency", [0.0, 0.4, 2.0])
def test_cut_is_equivalent_to_the_bound(first_order, frequency):
    """M >= V V^T exactly when r_u <= r_adm: scaled to ratio one, the cut is singular."""
    requirement = first_order_error(first_order, Relative(first_order.model, 0.01), 2.45)
    M = information(3, 2)
    ratio = requirement.ratios(M, np.array([frequency]))[0]
    slack = np.linalg.eigvalsh(M * ratio**2 - requirement.cut(frequency).matrix)
    assert abs(slack[0]) < 1e-9 * slack[-1]


def test_error_bound_predicts_monte_carlo_of_the_first_order_expansion(first_order):
    """95 % of Gaussian theta lie within alpha = 2.4477 in the plant's two parameters, so |dG| <= r_u."""
    rng = np.random.default_rng(5)
    M = first_order.to_raw(information(3, 3) * 1e4)
    requirement = first_order_error(first_order, Absolute(1.0), np.sqrt(5.991464547))
    w = np.linspace(0, np.pi, 50)
    theta = rng.multivariate_normal(np.zeros(3), np.linalg.inv(M), size=20000)
    errors = np.abs(theta @ first_order.model.plant_gradient(w)[:, :, 0, 0].T)
    inside = np.all(errors <= requirement.error_bound(M, w), axis=1).mean()
    assert inside >= 0.95 - 4 * np.sqrt(0.05 * 0.95 / 20000)


def test_violations_find_the_worst_of_a_dense_grid(flexible):
    M = information(6, 4)
    requirement = first_order_error(flexible, Relative(flexible.model, 0.25), 3.55, (1e-3, np.pi))
    dense = np.unique(np.concatenate([np.linspace(1e-3, np.pi, 50001), np.geomspace(1e-3, np.pi, 50001)]))
    worst = max(v.ratio for v in requirement.violations(M))
    assert worst >= requirement.ratios(M, dense).max() * (1 - 1e-9)


def test_sensitivity_bound_keeps_the_weighted_sensitivity_below_one(flexible):
    """|W S| <= 1 holds at 721 phases of a perturbation of size r_adm, with equality at the worst phase."""
    weight = Rational.build([0.527064, -0.472663], [1, -0.999455])
    model = flexible.model
    w = np.geomspace(1e-3, np.pi, 400)
    r = Sensitivity(flexible.loop, weight).at(w)
    C, G, W = flexible.loop.controller.at(w)[:, 0, 0], model.plant_at(w)[:, 0, 0], weight.at(w)
    phases = np.exp(2j * np.pi * np.linspace(0, 1, 721))
    worst = np.max(np.abs(W / (1 + C * (G + r * phases[:, None]))), axis=0)
    assert worst.max() <= 1 + 1e-6
    assert worst.min() >= 1 - 1e-3  # and no larger r_adm would do


def test_tables_interpolate_logarithms_and_weights_divide_r_adm():
    table = Table(np.array([0.1, 1.0]), np.array([1.0, 100.0]))
    np.testing.assert_allclose(table.at([0.1, np.sqrt(0.1), 1.0]), [1.0, 10.0, 100.0])
    weighted = Weighted(Absolute(2.0), Rational.build([1.0, 1.0]))
    np.testing.assert_allclose(weighted.at([0.0]), [1.0])


def test_vanishing_admissible_error_is_refused():
    """G vanishes at pi, and a relative bound with it."""
    model = PolynomialModel.single([0.0, 1.0, 1.0])
    requirement = first_order_error(Experiment(model, 100), Relative(model, 0.1), 2.0)
    found = refused(check_positive, requirement.admissible, requirement.grid, unit=1.0, named="rad/sample")
    assert found[0].code == "admissible-not-positive"
    below = dataclasses.replace(requirement, band=(0.0, 3.0))
    check_positive(below.admissible, below.grid, unit=1.0, named="rad/sample")


def test_target_is_met_exactly_at_its_ratio():
    M, R = information(3, 1), information(3, 2)
    ratio = InformationTarget(R).ratio(M)
    slack = np.linalg.eigvalsh(ratio**2 * M - R)
    assert abs(slack[0]) < 1e-9 * slack[-1]


@pytest.mark.parametrize(
    ("letter", "value"),
    [
        ("D", lambda M: np.linalg.slogdet(M)[1]),
        ("A", lambda M: -np.trace(np.linalg.inv(M))),
        ("E", lambda M: np.linalg.eigvalsh(M)[0]),
        ("T", np.trace),
    ],
)
def test_criteria_agree_with_their_textbook_formulas(letter, value):
    """In scaled coordinates: M stands for G M G^T; and s M reaches level one at s = ratio^2."""
    M, G = information(4, 3), np.random.default_rng(4).normal(size=(4, 4))
    criterion = Criterion(letter, G)
    assert criterion.value(criterion.level(M)) == pytest.approx(value(G @ M @ G.T), rel=1e-9)
    assert criterion.level(criterion.ratio(M) ** 2 * M) == pytest.approx(1.0)


def test_weighted_variance_agrees_with_its_definition(flexible):
    """|W|^2 Lambda^* P Lambda over its limit, by complex arithmetic; the worst of a dense grid is found."""
    W = Rational.build([0.3, 0.1], [1, -0.5])
    model = flexible.model
    M = information(6, 5, 1e3)
    for relative in (False, True):
        requirement = WeightedVariance(
            experiment=flexible, band=BAND, entry=(0, 0), weight=W, limit=0.01, relative=relative
        )
        gradient = model.plant_gradient(DENSE)[:, :, 0, 0]
        expected = np.einsum("ni,ij,nj->n", gradient.conj(), np.linalg.inv(M), gradient).real
        expected *= np.abs(W.at(DENSE)) ** 2 / 0.01
        if relative:
            expected /= np.abs(model.plant_at(DENSE)[:, 0, 0]) ** 2
        np.testing.assert_allclose(requirement.ratios(M, DENSE) ** 2, expected, rtol=1e-9)
        worst = max(v.ratio for v in requirement.violations(M))
        assert worst**2 >= expected.max() * (1 - 1e-9)


MODELS = [
    PolynomialModel.single([0, 3.6], F=[1, -0.7], C=[1, -0.9]),
    PolynomialModel.single([0, 1.0, 0.5], A=[1, -1.5, 0.7], variance=0.1),
]


@pytest.mark.parametrize("against", ["relative", "absolute"])
@pytest.mark.parametrize("model", MODELS, ids=["bj", "arx"])
def test_ellipsoid_bound_holds_on_the_ellipsoid_and_is_attained(model, against):
    """Models sampled on the ellipsoid r^2 M never exceed the bound, and come close to it."""
    experiment = Experiment(model, 500)
    k = experiment.size
    M = information(k, 7, 300.0)
    admissible = Relative(model, 0.3) if against == "relative" else Absolute(0.4)
    requirement = EllipsoidError(
        experiment=experiment, band=BAND, entry=(0, 0), admissible=admissible, alpha=2.0, against=against
    )
    w = np.array([0.0, 0.2, 1.0, 2.5])
    ratio = requirement.ratios(M, w)
    half = np.linalg.inv(np.linalg.cholesky(M))
    directions = np.random.default_rng(8).normal(size=(200000, k))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    index = {name: i for i, name in enumerate(model.names)}
    for at, r in zip(w, ratio, strict=True):
        d = 2.0 / r * directions @ half
        q = np.exp(-1j * at)

        def polynomial(letter, coefficients, d=d, q=q):
            value = np.zeros(len(d), dtype=complex)
            for lag, c in enumerate(coefficients):
                change = d[:, index[f"{letter}{lag}"]] if f"{letter}{lag}" in index else 0.0
                value = value + (c + change) * q**lag
            return value

        G = polynomial("b", model.B[0][0]) / (polynomial("a", model.A[0]) * polynomial("f", model.F[0][0]))
        G0 = model.plant_at(np.array([at])).item()
        error = np.abs(G - G0) / (np.abs(G) * 0.3 if against == "relative" else 0.4)
        assert error.max() <= 1 + 1e-9
        assert error.max() >= 0.97


def test_ellipsoid_bound_is_the_first_order_one_in_the_limit():
    """For a vanishing ellipsoid the linearisation is exact."""
    model = MODELS[0]
    experiment = Experiment(model, 500)
    M = information(3, 9)
    w = np.linspace(0.0, np.pi, 50)
    exact, linear = (
        kind(
            experiment=experiment, band=BAND, entry=(0, 0), admissible=Relative(model, 1e-5), alpha=2.0
        ).ratios(M, w)
        for kind in (EllipsoidError, ModelError)
    )
    np.testing.assert_allclose(exact, linear, rtol=1e-4)


@pytest.mark.parametrize(
    ("model", "entry", "weighted"),
    [(SINGLE, (0, 0), False), (SINGLE, (0, 0), True), (arx(), (1, 0), False), (arx(), None, False)],
)
def test_the_slope_of_squared_ratios_agrees_with_finite_differences(model, entry, weighted):
    """M changes in a random direction; the errors have two rows or several, or are a variance."""
    M = information(model.theta.size, 4)
    common = {"experiment": Experiment(model, 500), "band": (0.0, np.pi), "entry": entry}
    if weighted:
        requirement = WeightedVariance(**common, weight=Rational.build([1.0, 0.3]), limit=0.7)
    else:
        requirement = ModelError(**common, admissible=Absolute(1.0), alpha=2.45)
    w, shares = np.array([0.05, 0.4, 1.1, 2.9]), np.array([0.1, 0.4, 0.3, 0.2])
    turn = 1e-5 * information(len(M), 5)
    up, down = (shares @ requirement.ratios(M + sign * turn, w) ** 2 for sign in (1.0, -1.0))
    change = -2.0 * np.sum(requirement.slope(M, w, shares) * turn)
    assert up - down == pytest.approx(change, rel=1e-6)


@pytest.mark.first(1)
@pytest.mark.parametrize("leak", [1e-5, 1.5e-4, 3e-4])
def test_a_worst_ratio_at_frequency_zero_is_reported_at_zero(leak):
    """Rounding near zero, for a slow plant under integral action, once moved the maximum to 3.7e-09 rad/s."""
    found = analyse(
        parse_spec(f"""
sample_time: 5
plant: {{continuous: {{numerator: [0.02], denominator: [1, {leak}], delay: 9}}, sample: zoh}}
noise: {{variance: 0.02}}
experiment: {{samples: 720, controller: {{pid: {{Kp: 1.25, Ti: 160}}}}}}
accuracy: {{loop: {{tuning: {{simc: {{}}}}, max_sensitivity_db: 6}}}}
spectrum: {{given: {{type: white, power: 10}}}}
""")
    ).result["model_error"]
    assert found["worst_frequency"] == 0.0
