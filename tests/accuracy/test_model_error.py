"""r_u against the definition, cuts against r_u, admissible errors against what they promise."""

import dataclasses

import numpy as np
import pytest

from inputdesign_cli.accuracy import Absolute, ModelError, Relative, Sensitivity, Table, Weighted
from inputdesign_cli.accuracy.model_error import check_positive
from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import PolynomialModel, Rational
from tests.support.plants import arx


def random_information(size, seed):
    root = np.random.default_rng(seed).normal(size=(size, size + 2))
    return root @ root.T


def first_order_error(experiment, admissible, alpha, band=(0.0, np.pi)):
    return ModelError(experiment=experiment, band=band, entry=(0, 0), admissible=admissible, alpha=alpha)


def plant_gradient(model, w):
    """Of one input and output: (n, k)."""
    return model.plant_gradient(w)[:, :, 0, 0]


SINGLE = PolynomialModel.single([0, 3.6], F=[1, -0.7], C=[1, -0.9], D=[1, 0.2])


@pytest.mark.parametrize(
    ("model", "entry"), [(SINGLE, (0, 0)), (SINGLE, None), (arx(), (1, 0)), (arx(), None)]
)
def test_error_bound_is_the_definition(model, entry):
    """alpha sqrt(lambda_max(T P T^T)) of (6), by plain matrices, of an entry or of the norm of G."""
    M = random_information(model.theta.size, 1)
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
    M = random_information(3, 2)
    ratio = requirement.ratios(M, np.array([frequency]))[0]
    slack = np.linalg.eigvalsh(M * ratio**2 - requirement.cut(frequency).matrix)
    assert abs(slack[0]) < 1e-9 * slack[-1]


def test_error_bound_predicts_monte_carlo_of_the_first_order_expansion(first_order):
    """95 % of Gaussian theta lie within alpha = 2.4477 in the plant's two parameters, so |dG| <= r_u."""
    rng = np.random.default_rng(5)
    M = first_order.to_raw(random_information(3, 3) * 1e4)
    requirement = first_order_error(first_order, Absolute(1.0), np.sqrt(5.991464547))
    w = np.linspace(0, np.pi, 50)
    theta = rng.multivariate_normal(np.zeros(3), np.linalg.inv(M), size=20000)
    errors = np.abs(theta @ plant_gradient(first_order.model, w).T)
    inside = np.all(errors <= requirement.error_bound(M, w), axis=1).mean()
    assert inside >= 0.95 - 4 * np.sqrt(0.05 * 0.95 / 20000)


def test_violations_find_the_worst_of_a_dense_grid(flexible):
    M = random_information(6, 4)
    requirement = first_order_error(flexible, Relative(flexible.model, 0.25), 3.55, (1e-3, np.pi))
    dense = np.unique(np.concatenate([np.linspace(1e-3, np.pi, 50001), np.geomspace(1e-3, np.pi, 50001)]))
    worst = max(v.ratio for v in requirement.violations(M))
    assert worst >= requirement.ratios(M, dense).max() * (1 - 1e-9)


def test_sensitivity_bound_keeps_its_promise(flexible):
    """|W S| <= 1 for every plant within r_adm of G, tried with random and with worst-phase perturbations."""
    weight = Rational.build([0.527064, -0.472663], [1, -0.999455])
    model = flexible.model
    w = np.geomspace(1e-3, np.pi, 400)
    r = Sensitivity(flexible.loop, weight).at(w)
    C, G, W = flexible.loop.controller.at(w)[:, 0, 0], model.plant_at(w)[:, 0, 0], weight.at(w)
    phases = np.exp(2j * np.pi * np.linspace(0, 1, 721))
    worst = np.max(np.abs(W / (1 + C * (G + r * phases[:, None]))), axis=0)
    assert worst.max() <= 1 + 1e-6
    assert worst.min() >= 1 - 1e-3  # and no larger r_adm would do


def test_table_interpolates_in_logarithms():
    table = Table(np.array([0.1, 1.0]), np.array([1.0, 100.0]))
    np.testing.assert_allclose(table.at([0.1, np.sqrt(0.1), 1.0]), [1.0, 10.0, 100.0])


def test_weight_divides():
    weighted = Weighted(Absolute(2.0), Rational.build([1.0, 1.0]))
    np.testing.assert_allclose(weighted.at([0.0]), [1.0])


def test_vanishing_admissible_error_is_refused():
    """G vanishes at pi, and a relative bound with it."""
    model = PolynomialModel.single([0.0, 1.0, 1.0])
    requirement = first_order_error(Experiment(model, 100), Relative(model, 0.1), 2.0)
    with pytest.raises(SpecError) as error:
        check_positive(requirement.admissible, requirement.grid, unit=1.0, named="rad/sample")
    assert error.value.diagnostics[0].code == "admissible-not-positive"
    below = dataclasses.replace(requirement, band=(0.0, 3.0))
    check_positive(below.admissible, below.grid, unit=1.0, named="rad/sample")
