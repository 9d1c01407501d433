"""Bounds on the error of each entry of G by table, with a weight, and over the whole confidence ellipsoid."""

from pathlib import Path

import numpy as np
import pytest
import scipy.optimize

from inputdesign_cli import load_spec, parse_spec, solve, validate
from tests.support.refusals import code_of, refused

SPECS = Path(__file__).parents[2] / "specs"
WEIGHT = "{numerator: [1, 0.5]}"
CONTINUOUS = """
plant: {continuous: {numerator: [[[2.0], [1.0]]], denominator: [[[1, 0.6, 1], [1, 1]]]}}
noise: {variance: 0.1}
experiment: {samples: 400}
spectrum: {type: polynomial, order: 6, band: [0, 2.0]}
"""


def arx(error, *overrides):
    spec = load_spec(
        SPECS / "two_by_two_arx.yaml",
        [
            "spectrum.order=3",
            f"accuracy.model_error={{{error}}}",
            "signal.candidates=1",
            "solver.any_spectrum=false",
            *overrides,
        ],
    )
    return solve(spec)


def by_name(result, values=None):
    theta = {
        "a1[1]": -0.7,
        "a1[2]": 0.4,
        **{f"b1[{i + 1},{j + 1}]": [[1.0, -0.5], [0.6, 1.2]][i][j] for i in (0, 1) for j in (0, 1)},
        **{f"b2[{i + 1},{j + 1}]": [[0.4, 0.3], [0.2, -0.5]][i][j] for i in (0, 1) for j in (0, 1)},
    }
    names = result["information"]["parameters"]
    return dict(zip(names, [theta[name] for name in names] if values is None else values, strict=True))


def arx_entry(values, i, j, w):
    q = np.exp(-1j * np.asarray(w))
    above = values[f"b1[{i},{j}]"] * q + values[f"b2[{i},{j}]"] * q**2
    return above / (1 + values[f"a1[{i}]"] * q)


def first_order_errors(result, w):
    """r_u (2, 2, n) from the covariance of the result, by finite differences of G."""
    P = np.asarray(result["information"]["covariance"])
    nominal = by_name(result)
    r_u = np.empty((2, 2, w.size))
    for i in (1, 2):
        for j in (1, 2):
            columns = []
            for name, value in nominal.items():
                up, down = nominal | {name: value + 1e-6}, nominal | {name: value - 1e-6}
                columns.append((arx_entry(up, i, j, w) - arx_entry(down, i, j, w)) / 2e-6)
            T = np.array(columns)
            rows = np.stack([T.real, T.imag]).transpose(2, 0, 1)
            r_u[i - 1, j - 1] = np.sqrt(np.linalg.eigvalsh(rows @ P @ rows.transpose(0, 2, 1))[:, -1])
    return result["model_error"]["alpha"] * r_u


W = np.linspace(0.0, np.pi, 2001)


def test_a_table_bounds_each_entry_of_g_by_its_own_column(tmp_path):
    table = tmp_path / "r.csv"
    rows = "0,0.4,0.1,0.2,0.1\n1,0.4,0.1,0.2,0.1\n3.2,0.1,0.1,0.2,0.1\n"
    table.write_text("frequency,r_adm_11,r_adm_12,r_adm_21,r_adm_22\n" + rows, encoding="utf-8")
    outcome = arx(f"table: {table}")
    ratio = first_order_errors(outcome.result, W)
    bound = np.exp(np.interp(np.log(np.maximum(W, 1e-9)), np.log([1.0, 3.2]), np.log([0.4, 0.1])))
    ratio[0, 0] /= bound
    ratio[0, 1] /= 0.1
    ratio[1, 0] /= 0.2
    ratio[1, 1] /= 0.1
    assert ratio.max() == pytest.approx(1.0, abs=1e-4)
    assert outcome.result["objective"]["relative_gap"] <= 1e-6
    assert outcome.tables["bound"].columns["r_adm_21"] == pytest.approx(0.2)


def test_a_weight_multiplies_the_error_of_every_entry():
    result = arx(f"relative: 0.05, weight: {WEIGHT}").result
    nominal = by_name(result)
    G = np.array([[np.abs(arx_entry(nominal, i, j, W)) for j in (1, 2)] for i in (1, 2)])
    ratio = np.abs(1 + 0.5 * np.exp(-1j * W)) * first_order_errors(result, W) / (0.05 * G)
    assert ratio.max() == pytest.approx(1.0, abs=1e-4)


def largest_error(entry, result, theta, *, relative):
    """The largest |G - G_0| / |G| (or |G - G_0|) on the ellipsoid, by local search from random directions."""
    root = np.linalg.cholesky(np.asarray(result["information"]["covariance"]))
    alpha = result["model_error"]["alpha"]
    w = result["model_error"]["worst_frequency"]
    nominal, rng = entry(theta, w), np.random.default_rng(0)

    def negative(direction):
        there = entry(theta + alpha * root @ direction / np.linalg.norm(direction), w)
        return -abs(there - nominal) / (abs(there) if relative else 1.0)

    starts = rng.normal(size=(4, theta.size))
    return max(-scipy.optimize.minimize(negative, start, tol=1e-10).fun for start in starts)


@pytest.mark.slow
@pytest.mark.parametrize(("error", "bound"), [("relative: 0.2", 0.2), ("absolute: 0.3", 0.3)])
def test_no_model_of_the_ellipsoid_breaks_the_bound_and_one_reaches_it(error, bound):
    result = arx(f"{error}, region: ellipsoid").result
    assert result["objective"]["relative_gap"] <= 1e-6
    at = max(result["requirements"], key=lambda item: item["worst_ratio"])["entry"]
    i, j = int(at[1]), int(at[3])
    worst = largest_error(
        lambda theta, w: arx_entry(by_name(result, theta), i, j, w),
        result,
        np.array(list(by_name(result).values())),
        relative="relative" in error,
    )
    assert worst == pytest.approx(bound, rel=2e-4)


def test_ellipsoid_regions_are_refused_for_entries_that_are_no_linear_fractions():
    error = "accuracy.model_error={relative: 0.1, region: ellipsoid}"
    both = ["plant.F=[[[1, 0.1], [1]], [[1], [1]]]"]
    (told,) = refused(validate, load_spec(SPECS / "two_by_two_arx.yaml", [error, *both]))
    assert (told.code, "[1,1]" in told.message) == ("not-supported", True)
    sampled = CONTINUOUS.replace("[1, 1]]]}}", "[1, 1]]]}, sample: zoh}").replace("[0, 2.0]", "[0, 3.0]")
    assert code_of(validate, parse_spec(sampled, overrides=["accuracy={}", error])) == "not-supported"


@pytest.mark.slow
def test_an_ellipsoid_region_in_continuous_time_reaches_its_relative_bound():
    error = "accuracy: {model_error: {relative: 0.3, region: ellipsoid}}\n"
    result = solve(parse_spec(CONTINUOUS + error)).result
    names = result["information"]["parameters"]
    theta = {"b0[1,1]": 2.0, "b0[1,2]": 1.0, "a0[1,1]": 1.0, "a1[1,1]": 0.6, "a0[1,2]": 1.0}

    def entry(j):
        def at(values, w):
            p, s = dict(zip(names, values, strict=True)), 1j * w
            if j == 1:
                return p["b0[1,1]"] / (s**2 + p["a1[1,1]"] * s + p["a0[1,1]"])
            return p["b0[1,2]"] / (s + p["a0[1,2]"])

        return at

    values = np.array([theta[name] for name in names])
    worst = max(largest_error(entry(j), result, values, relative=True) for j in (1, 2))
    assert worst == pytest.approx(0.3, rel=2e-4)
