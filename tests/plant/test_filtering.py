"""Difference equations against their definition, written out."""

import subprocess
import sys

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.plant.filtering import filtered


def by_definition(b, a, x):
    y = np.zeros(x.shape, dtype=np.result_type(x, float))
    for t in range(len(x)):
        now = sum((b[i] * x[t - i] for i in range(len(b)) if i <= t), np.zeros(x.shape[1:]))
        back = sum((a[i] * y[t - i] for i in range(1, len(a)) if i <= t), np.zeros(x.shape[1:]))
        y[t] = (now - back) / a[0]
    return y


@pytest.mark.parametrize("shape", [(40,), (40, 3), (2, 2), (1,), (0,)])
@pytest.mark.parametrize(("m", "k"), [(1, 1), (3, 1), (1, 4), (4, 3)])
def test_a_filter_is_its_difference_equation(shape, m, k):
    rng = np.random.default_rng(m + 10 * k)
    b, a = rng.standard_normal(m), 2.0 * np.poly(rng.uniform(-0.9, 0.9, k - 1))
    a = np.atleast_1d(a)
    x = rng.standard_normal(shape)
    assert filtered(b, a, x, axis=0) == pytest.approx(by_definition(b, a, x), abs=1e-12)
    complex_values = x + 1j * x[::-1]
    twice = filtered(b, a, x, axis=0) + 1j * filtered(b, a, x[::-1], axis=0)
    assert filtered(b, a, complex_values, axis=0) == pytest.approx(twice, abs=1e-12)


@pytest.mark.parametrize("samples", [9_000, 11_000])
def test_short_and_long_records_are_filtered_alike(samples):
    rng = np.random.default_rng(samples)
    b, a, x = np.array([0.0, 1.0, 0.5]), np.poly([0.99, 0.9j, -0.9j]).real, rng.standard_normal(samples)
    expected = scipy.signal.lfilter(b, a, x)
    assert filtered(b, a, x) == pytest.approx(expected, rel=0, abs=1e-11 * np.abs(expected).max())
    several = np.stack([x, 2 * x])
    assert filtered(b, a, several)[1] == pytest.approx(2 * expected, rel=0, abs=1e-10)


def test_a_small_design_does_not_wait_for_what_it_does_not_need():
    code = (
        "import sys; from pathlib import Path; from inputdesign_cli import load_spec, solve;"
        "solve(load_spec(Path('specs/first_order.yaml'), []));"
        "print([name for name in ('scipy.signal', 'scipy.stats', 'cvxpy', 'matplotlib')"
        "if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
