"""Expressions in named parameters: values against Python's own, slopes against complex steps."""

import cmath
import math
import pickle

import numpy as np
import pytest

from inputdesign_cli.expressions import Expression, ExpressionError, evaluated, is_name, product_of

NAMES = ("K", "T", "zeta")
VALUES = np.array([2.1, 0.7, 0.3])
TEXTS = [
    "K",
    "-K + 2*T",
    "K/(T*zeta)",
    "K**T",
    "2**zeta",
    "(-K)**2",
    "K*(1 - exp(-0.5/T))",
    "sqrt(K) + log(T) - tan(zeta)",
    "sin(K)*cos(T)/tanh(zeta) + pi",
    "asin(zeta) + acos(T) + atan(K) + sinh(T) + cosh(zeta)",
]


@pytest.mark.parametrize("text", TEXTS)
def test_values_and_slopes_agree_with_complex_steps(text):
    value, slope = Expression.of(text).at(NAMES, VALUES)
    functions = {name: getattr(cmath, name) for name in dir(cmath) if not name.startswith("_")}

    def plain(values):
        return eval(text, {**functions, **dict(zip(NAMES, values, strict=True))})

    assert value == pytest.approx(complex(plain(VALUES)).real, rel=1e-14)
    for index in range(len(NAMES)):
        moved = VALUES.astype(complex)
        moved[index] += 1e-30j
        assert slope[index] == pytest.approx(complex(plain(moved)).imag / 1e-30, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "K +",
        "K T",
        "__import__('os')",
        "K.real",
        "K[0]",
        "lambda: 1",
        "K if T else 1",
        "K^2",
        "sqrt(K, T)",
        "open(K)",
        "True",
        "1j",
        "'K'",
        "K < T",
        "[K]",
        "K @ T",
        "K // T",
        "1e999",
        "(" * 300 + "K" + ")" * 300,
        "+".join(["K"] * 400),
        "\x00",
    ],
)
def test_texts_that_are_not_arithmetic_are_refused(text):
    with pytest.raises(ExpressionError):
        Expression.of(text)


@pytest.mark.parametrize(
    "text", ["1/(K - K)", "log(-K)", "sqrt(-K)", "9**9**9**9", "exp(1e6*K)", "(-K)**0.5"]
)
def test_undefined_values_and_slopes_are_nan(text):
    value, slope = Expression.of(text).at(NAMES, VALUES)
    assert math.isnan(value)
    assert np.all(np.isnan(slope))


@pytest.mark.parametrize(
    ("text", "affine"),
    [
        ("2*K - T/3 + 1", True),
        ("K*T", False),
        ("1/K", False),
        ("K**2", False),
        ("exp(K)", False),
        ("pi*K", True),
    ],
)
def test_an_expression_is_affine_by_its_form(text, affine):
    assert Expression.of(text).affine == affine


def test_names_of_parameters_survive_pickling_and_exclude_functions():
    found = pickle.loads(pickle.dumps(Expression.of("K*exp(-pi/T)")))
    assert found.names == {"K", "T"}
    assert is_name("K_1")
    assert not any(map(is_name, ("exp", "pi", "1K", "K[1]", "", "lambda", "None", "if")))


DEEP = ["-" * 400 + "K", "K" + "*1" * 240, "K" + "+T" * 240, "1*(" * 80 + "K" + ")" * 80, "K # gain", " K\t"]


@pytest.mark.parametrize("text", [*TEXTS, *DEEP, "K" + " " * 499])
def test_products_and_quotients_of_expressions_follow_the_rules_of_calculus(text):
    """The rules hold for long and deeply nested texts, too."""
    a, b = Expression.of(text), Expression.of("T*exp(zeta)")
    (x, dx), (y, dy) = (one.at(NAMES, VALUES) for one in (a, b))
    for made, value, slope in (
        (a * b, x * y, y * dx + x * dy),
        (a / b, x / y, (dx * y - x * dy) / y**2),
        (a / b * b, x, dx),
    ):
        found = made.at(NAMES, VALUES)
        assert found[0] == pytest.approx(value, rel=1e-13)
        np.testing.assert_allclose(found[1], slope, rtol=1e-12, atol=1e-13)
        assert made.names == a.names | b.names
        assert pickle.loads(pickle.dumps(made)).at(NAMES, VALUES)[0] == found[0]


@pytest.mark.first(2)
@pytest.mark.parametrize("count", [0, 1, 6, 60])
def test_products_of_many_factors_agree_with_numpy(count):
    """Their slopes agree with complex steps."""
    factors = [[Expression.of(f"T/{k}"), Expression.of("1 + K/T")] for k in range(1, count + 1)]
    found = [one.at(NAMES, VALUES) for one in product_of(factors)]
    step = 1e-20

    def product(K, T):
        rows = [np.array([T / k, 1 + K / T]) for k in range(1, count + 1)]
        full = np.ones(1, dtype=complex)
        for row in rows:
            full = np.convolve(full, row)
        return full

    np.testing.assert_allclose([value for value, _ in found], product(2.1, 0.7).real, rtol=1e-11)
    for k, moved in enumerate((product(2.1 + 1j * step, 0.7), product(2.1, 0.7 + 1j * step))):
        np.testing.assert_allclose([slope[k] for _, slope in found], moved.imag / step, rtol=1e-9)


@pytest.mark.parametrize("text", ["K*1e200*1e200", "K + 1e308*1e308*0", "K*1e308*1e-308 + 0*(1e308*1e308)"])
def test_an_overflow_is_not_finite_and_raises_no_warning(text):
    with np.errstate(all="raise"):
        assert not math.isfinite(Expression.of(text).at(NAMES, VALUES)[0])


def test_joint_evaluation_equals_separate_evaluation_beside_undefined_expressions():
    texts = ("K*exp(-h/T)", "log(h - h*2)", "K*exp(-h/T)/(1 - exp(-h/T))", "sqrt(0)*K", "K/(T - 2)", "3")
    symbols, values = ("K", "T", "h"), np.array([1.5, 2.0, 0.3])
    several = tuple(map(Expression.of, texts))
    here = evaluated(several, symbols, values)
    alone = [one.at(symbols, values) for one in several]
    np.testing.assert_array_equal(here.values, [value for value, _ in alone])
    np.testing.assert_array_equal(here.gradients, [gradient for _, gradient in alone])
    defined = [True, False, True, True, False, True]
    np.testing.assert_array_equal(np.isfinite(here.values), defined)
    np.testing.assert_array_equal(np.isfinite(here.gradients).all(axis=1), defined)
    q = np.exp(-0.15)
    np.testing.assert_allclose(
        here.values[[0, 2, 3, 5]], [1.5 * q, 1.5 * q / (1.0 - q), 0.0, 3.0], rtol=1e-14
    )
    np.testing.assert_allclose(here.gradients[0], [q, 1.5 * q * 0.075, -0.75 * q], rtol=1e-14)


def test_slopes_of_ratios_of_huge_and_tiny_numbers_are_accurate():
    """The reciprocal of the divisor, or of its square, would leave the range of doubles."""
    value, gradient = Expression.of("x/y").at(("x", "y"), np.array([1e-200, 1e-170]))
    np.testing.assert_allclose([value, *gradient], [1e-30, 1e170, -1e140], rtol=1e-14)
    value, gradient = Expression.of("x/y").at(("x", "y"), np.array([1e150, 1e160]))
    np.testing.assert_allclose([value, *gradient], [1e-10, 1e-160, -1e-170], rtol=1e-14)
