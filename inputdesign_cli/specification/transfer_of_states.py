"""The transfer functions of a system in state space, in exact fractions.

A float is a fraction, so the characteristic polynomial and the numerators are fractions too. Zeros and
common factors are exact, whatever the unit of time and the coordinates of the states.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from inputdesign_cli.errors import SpecError, bad_spec

Exact = list[Fraction]
Entry = tuple[list[float], list[float]]
"""Numerator and denominator, descending."""

# Largest relative change of the response by cancelling a pole and a zero, and by the whole conversion.
_CANCELS = 1e-9
_DIFFERS = 1e-8
# The response of the states is known to this share of the terms of its sum.
_ROUNDING = 1e-12
_PRIME = 2**61 - 1


def transfer_functions(
    A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, *, discrete: bool
) -> list[list[Entry]]:
    """Return rows of columns of numerators and denominators without common factors.

    Args:
        A, B, C, D: (n, n), (n, r), (p, n) and (p, r).

    Raises:
        SpecError: `not-finite`; `inaccurate-conversion` if polynomials of floats have another response over
            frequency than the states.
    """
    matrices = [np.asarray(part, dtype=float) for part in (A, B, C, D)]
    if not all(np.isfinite(part).all() for part in matrices):
        raise bad_spec("not-finite", "the matrices of the system must be finite", key="plant")
    tops, bottom = _fractions(*matrices)
    return [
        [
            _converted(*_coprime(top, bottom), _one_channel(i, j, *matrices), discrete=discrete)
            for j, top in enumerate(row)
        ]
        for i, row in enumerate(tops)
    ]


def _fractions(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray) -> tuple[list[list[Exact]], Exact]:
    """Return C adj(s I - A) B + D det(s I - A), and det(s I - A), by the algorithm of Faddeev and Leverrier.

    A power of two makes integers of each matrix. There are n products of n by n matrices.
    """
    (a, per_a), (b, per_b), (c, per_c) = _integers(A), _integers(B), _integers(C)
    n, scale = len(A), per_b * per_c
    identity = np.array([[int(i == j) for j in range(n)] for i in range(n)], dtype=object).reshape(n, n)
    adjoint, bottom = identity, [Fraction(1)]
    late = [np.zeros(D.shape, dtype=object)]
    for k in range(1, n + 1):
        late.append(c @ adjoint @ b)
        product = a @ adjoint
        last = -int(np.trace(product)) // k
        bottom.append(Fraction(last, per_a**k))
        adjoint = product + last * identity
    tops = [
        [
            [
                Fraction(int(part[i, j]), scale * per_a ** max(k - 1, 0)) + Fraction(D[i, j]) * below
                for k, (part, below) in enumerate(zip(late, bottom, strict=True))
            ]
            for j in range(D.shape[1])
        ]
        for i in range(D.shape[0])
    ]
    return tops, bottom


def _integers(matrix: np.ndarray) -> tuple[np.ndarray, int]:
    """The matrix times a power of two, in integers, and that power."""
    ratios = [value.as_integer_ratio() for value in matrix.ravel().tolist()]
    per = max((below for _, below in ratios), default=1)
    whole = np.array([above * (per // below) for above, below in ratios], dtype=object)
    return whole.reshape(matrix.shape), per


def _coprime(top: Exact, bottom: Exact) -> tuple[Exact, Exact]:
    """Cancel the greatest common divisor, after a fast test for one in arithmetic modulo a prime."""
    top = _without_lead(top)
    if not top:
        return [Fraction(0)], [Fraction(1)]
    if len(_common(_modulo(bottom), _modulo(top), _PRIME)) == 1:
        return top, bottom
    shared = _common(bottom, top)
    return _divided(top, shared)[0], _divided(bottom, shared)[0]


def _common(one: Exact, other: Exact, modulus: int = 0) -> Exact:
    """The greatest common divisor by Euclid, monic; of a monic polynomial and one that is not 0."""
    while other:
        inverse = Fraction(pow(int(other[0]), -1, modulus)) if modulus else 1 / other[0]
        other = [c * inverse % modulus if modulus else c * inverse for c in other]
        one, other = other, _divided(one, other, modulus)[1]
    return one


def _modulo(polynomial: Exact) -> Exact:
    """In integers modulo the prime; the denominators are powers of two."""
    inverses = (pow(c.denominator, -1, _PRIME) for c in polynomial)
    return _without_lead(
        [Fraction(c.numerator * i % _PRIME) for c, i in zip(polynomial, inverses, strict=True)]
    )


def _divided(above: Exact, below: Exact, modulus: int = 0) -> tuple[Exact, Exact]:
    """Quotient and remainder by a monic polynomial."""
    rest, quotient = list(above), []
    for k in range(len(above) - len(below) + 1):
        quotient.append(rest[k])
        for i, c in enumerate(below, start=k):
            rest[i] -= quotient[-1] * c
            if modulus:
                rest[i] %= modulus
    return quotient, _without_lead(rest[len(quotient) :])


def _without_lead(polynomial: Exact) -> Exact:
    first = next((i for i, c in enumerate(polynomial) if c), len(polynomial))
    return polynomial[first:]


def _one_channel(
    i: int, j: int, A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray
) -> tuple[np.ndarray, ...]:
    """A, b, c, d of one output and one input, the states scaled by powers of two."""
    if not len(A):
        return A, B[:, [j]], C[[i]], D[[i]][:, [j]]
    import scipy.linalg  # not to be read with every spec

    balanced, _, _, scale, _ = scipy.linalg.lapack.dgebal(A, scale=1, permute=0)
    return balanced, B[:, [j]] / scale[:, None], C[[i]] * scale, D[[i]][:, [j]]


def _converted(top: Exact, bottom: Exact, states: tuple[np.ndarray, ...], *, discrete: bool) -> Entry:
    """The simplest floats that have the response of the states."""
    try:
        above, below = [float(c) for c in top], [float(c) for c in bottom]
    except OverflowError:
        raise _inaccurate() from None
    led = above[_leads_of_rounding(above, len(below) - len(above), states) :]
    for entry in (_without_near_pairs(led, below, discrete=discrete), (led, below), (above, below)):
        if _agree(entry, states, discrete=discrete):
            return entry
    raise _inaccurate()


def _leads_of_rounding(top: list[float], excess: int, states: tuple[np.ndarray, ...]) -> int:
    """Count the first coefficients d, c b, c A b, .. whose terms cancel but for rounding.

    Args:
        top: numerator.
        excess: poles more than zeros.
        states: A, b, c, d.
    """
    A, b, c, d = states
    n, term, count = len(A), np.abs(b), 0
    sizes = [np.abs(d).item()]
    for _ in range(n):
        sizes.append((np.abs(c) @ term).item())
        term = np.abs(A) @ term
    for value, size in zip(top[:-1], sizes[excess:], strict=False):
        if abs(value) > _ROUNDING * size:
            break
        count += 1
    return count


def _inaccurate() -> SpecError:
    message = "the transfer functions of this system in state space cannot be represented in floating point"
    hint = "name the entries of the states that are estimated, or use a longer unit of time"
    return bad_spec("inaccurate-conversion", message, hint=hint, key="plant")


def _without_near_pairs(top: list[float], bottom: list[float], *, discrete: bool) -> Entry:
    """Cancel poles with zeros that equal them but for rounding: (s - z)/(s - p) is 1 at every frequency."""
    zeros, poles = np.roots(top), np.roots(bottom)
    kept = []
    for zero in zeros:
        # The largest deviation from 1 is |z - p| over the distance of the pole from the stability boundary.
        away = np.abs(np.abs(poles) - 1.0) if discrete else np.abs(poles.real)
        effect = np.abs(poles - zero)
        near = np.flatnonzero(effect <= _CANCELS * away)
        if near.size:
            poles = np.delete(poles, near[np.argmin(effect[near])])
        else:
            kept.append(zero)
    if len(kept) == zeros.size:
        return top, bottom
    above, below = np.atleast_1d(np.poly(kept)), np.atleast_1d(np.poly(poles))
    return (top[0] * above.real).tolist(), below.real.tolist()


def _agree(entry: Entry, states: tuple[np.ndarray, ...], *, discrete: bool) -> bool:
    """Whether polynomials and states have the same response on a grid around their corner frequencies."""
    A, b, c, d = states
    top, bottom = entry
    roots = np.concatenate([np.roots(top), np.roots(bottom), np.linalg.eigvals(A) if len(A) else []])
    if discrete:
        bends = np.concatenate([np.abs(np.angle(roots)), np.abs(np.abs(roots) - 1.0)])
    else:
        bends = np.concatenate([np.abs(roots), np.abs(roots.imag)])
    bends = bends[bends > 0]
    low, high = (bends.min() / 100, bends.max() * 100) if bends.size else (0.01, 100.0)
    grid = np.geomspace(max(low, 1e-12 * high), high, 200)
    # Not at a root itself, where an undamped one divides by zero.
    w = np.concatenate([grid, bends * 0.7]) * 1.0012345
    points = np.exp(1j * w[w <= np.pi]) if discrete else 1j * w
    inverse = np.linalg.inv(points[:, None, None] * np.eye(len(A)) - A)
    exact = (c @ inverse @ b + d)[:, 0, 0]
    size = (np.abs(c) @ np.abs(inverse) @ np.abs(b) + np.abs(d))[:, 0, 0]
    with np.errstate(all="ignore"):
        found = np.polyval(top, points) / np.polyval(bottom, points)
        allowed = _DIFFERS * np.abs(exact) + _ROUNDING * size
        return bool(np.all(np.abs(found - exact) <= allowed))
