"""What must hold for polynomials: monic, stable, not zero; their products."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence

import numpy as np

from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.wording import show

Polynomial = tuple[float, ...]

# Coefficients of which the sum is this small have a root at z = 1, as far as decimals can tell; a radius this
# near to 1 is 1.
_ROUNDING = 1e-12


def product(factors: Iterable[Polynomial]) -> Polynomial:
    """The product of polynomials given by their coefficients (the order of the powers does not matter)."""
    with np.errstate(all="ignore"):
        full: np.ndarray = functools.reduce(np.convolve, (np.asarray(f) for f in factors), np.ones(1))
    return tuple(float(c) for c in full)


def check_not_zero(polynomial: Polynomial) -> PathDiagnostic | None:
    """Some coefficient differs from zero."""
    if any(polynomial):
        return None
    return PathDiagnostic(
        "zero-polynomial", "all coefficients of {key} are zero", "write at least one that is not"
    )


def check_leading(polynomial: Polynomial) -> PathDiagnostic | None:
    """The first coefficient differs from zero."""
    if polynomial[0] != 0.0:
        return None
    return check_not_zero(polynomial) or PathDiagnostic(
        "zero-leading-coefficient", "{key} must not start with 0", "remove the leading zeros"
    )


def check_monic(polynomial: Polynomial) -> PathDiagnostic | None:
    """In q^-1, ascending: the first coefficient is exactly 1."""
    lead = polynomial[0]
    if lead == 1.0:
        return None
    if lead == 0.0:
        return PathDiagnostic(
            "not-monic",
            "{key} must start with 1, not 0",
            "it is a polynomial in q^-1, ascending: the first coefficient belongs to the power 0",
        )
    hint = f"divide all its coefficients by {show(lead)}: {_listed([c / lead for c in polynomial])}"
    if polynomial[-1] == 1.0:
        hint = f"its coefficients ascend in q^-1: did you mean {_listed(polynomial[::-1])}?"
    return PathDiagnostic("not-monic", f"{{key}} must start with 1, not {show(lead)}", hint)


def _listed(coefficients: Sequence[float]) -> str:
    more = ", ..." if len(coefficients) > 6 else ""
    return f"[{', '.join(show(c) for c in coefficients[:6])}{more}]"


def check_delay_stable(polynomial: Polynomial) -> PathDiagnostic | None:
    """In q^-1, ascending: all roots in z lie strictly inside the unit circle."""
    roots, found = _roots(polynomial)
    if found or not roots.size:
        return found
    worst = roots[np.argmax(np.abs(roots))]
    radius = float(abs(worst))
    if radius < 1.0 - _ROUNDING:
        return None
    angle = abs(float(np.angle(worst)))
    where = f"{radius:.6g}" if abs(radius - 1.0) > 5e-6 else "1"
    return PathDiagnostic(
        "unstable-polynomial",
        f"{{key}} has a root of radius {where} at {angle:.4g} rad/sample; "
        "all roots (in z) must lie inside the unit circle",
        "check the signs, and that the coefficients ascend in q^-1 and begin with 1"
        + _decimal_comma(polynomial),
    )


def _decimal_comma(polynomial: Polynomial) -> str:
    """What to add where 0,7 was most likely meant for 0.7: whole numbers with a zero before another."""
    whole = all(float(c).is_integer() for c in polynomial)
    if whole and 0.0 in polynomial[1:-1]:
        return "; if 0,7 was meant for a number, write 0.7: a comma begins the next coefficient"
    return ""


def check_no_growth(polynomial: Polynomial) -> PathDiagnostic | None:
    """In q^-1, ascending: all roots lie inside the unit circle, but for integrators at z = 1."""
    rest = np.asarray(polynomial, dtype=float)
    while rest.size > 1 and abs(np.sum(rest)) <= _ROUNDING * np.sum(np.abs(rest)):
        rest = np.cumsum(rest)[:-1]  # divided by 1 - q^-1
    return check_delay_stable(tuple(rest.tolist()))


def check_no_growth_in_s(polynomial: Polynomial) -> PathDiagnostic | None:
    """In s, descending: all roots lie in the open left half plane, but for integrators at s = 0."""
    last = max((i for i, c in enumerate(polynomial) if c), default=0)
    return check_left_half_plane(polynomial[: last + 1])


def check_left_half_plane(polynomial: Polynomial) -> PathDiagnostic | None:
    """In s, descending: all roots lie in the open left half plane."""
    roots, found = _roots(polynomial)
    if found or not roots.size:
        return found
    worst = roots[np.argmax(roots.real)]
    if worst.real < 0:
        return None
    place = f"{worst.real + 0.0:.4g}" + (f" +- {abs(worst.imag):.4g}j" if abs(worst.imag) > 1e-12 else "")
    return PathDiagnostic(
        "unstable-polynomial",
        f"{{key}} has a root at s = {place}; all poles must lie in the left half plane",
        "check the signs, and that the powers of s descend: [1, 2, 3] is s^2 + 2 s + 3",
    )


def _roots(polynomial: Polynomial) -> tuple[np.ndarray, PathDiagnostic | None]:
    try:
        with np.errstate(all="ignore"):
            roots = np.roots(np.asarray(polynomial, dtype=float))
    except np.linalg.LinAlgError:
        roots = np.full(1, np.nan)
    if not np.all(np.isfinite(roots)):
        return np.zeros(0), PathDiagnostic(
            "bad-polynomial",
            "the roots of {key} cannot be computed: its coefficients differ by too many orders of magnitude",
            "rescale it, or choose another time unit",
        )
    return roots, None
