"""The noise of a plant that was explored in a log: what the user says of it holds, the log tells the rest."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.outcome.results import Json
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.specification import Noise, Spec
from inputdesign_cli.wizard.means import DRIFTING, at_rest, drifts, names_resolution, noise_level
from inputdesign_cli.wizard.phrases import short
from inputdesign_cli.wizard.questions import AS_LOG

_LONG = 100_000  # samples after which no pole that a log tells remembers anything


def log_noise_lines(explored: Spec, source: str, text: str, drift: str, folder: Path) -> list[str]:
    """The lines of `noise` from the answers, and from the model of a log where they leave it open.

    The size is the one that is stated; a resolution is the least that noise can be, and the log may tell
    more. Where no drift is stated, the log says whether there is one. How noise without drift is correlated
    is what the log tells, unless data at rest do.

    Args:
        explored: the model of the log.
        source: the name of the log.
        text, drift: the answers.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
    told = explored.noise
    found = np.atleast_1d(np.asarray(told.variance, dtype=float))
    powers = np.diag(found) if found.ndim == 2 else found
    moves = bool(np.any(told.drift))
    if text == AS_LOG and drifts(drift, otherwise=moves) == moves:
        return _as_told(told, source)
    size, colour, comment = _level(text, folder, powers, explored.sample_time)
    variance: Json = float(f"{size:.6g}")
    wanted = drifts(drift, otherwise=moves)
    A = getattr(explored.plant, "A", None) or (1.0,)
    steady = not (wanted or moves or at_rest(text))
    gains = _gains(told, A, powers.size) if steady else np.ones(powers.size)
    if names_resolution(text) and np.max(powers * gains) > size:
        variance, comment = np.asarray(told.variance).tolist(), f"of {source}: more than rounding leaves"
    elif np.any(gains > 1.0):
        own = (size / gains).tolist()
        variance = float(f"{own[0]:.6g}") if powers.size == 1 else np.diag(own).tolist()
        comment += f", correlated as {source} tells"
    listed = ", ".join(map(short, (powers * gains).tolist()))
    has = f"the log tells a variance of {listed}, {'and drift' if moves else 'and no drift'}"
    lines = [f"noise:  # as you said; {has}", f"  variance: {json.dumps(variance)}  # {comment}"]
    if steady or (wanted and moves):  # with the colour that was estimated along
        return [*lines, *_shape(told)]
    base = DRIFTING if wanted else (1.0,)
    lines += ["  drift: true  # an integrator in the noise"] if wanted else []
    lines += [] if wanted or not colour else [f"  D: [1, {short(-colour)}]"]
    shaped = _times(base, A)
    return [*lines, f"  C: {json.dumps(shaped)}"] if shaped != [1.0] else lines


def _gains(told: Noise, A: Sequence[Json], outputs: int) -> NDArray[np.float64]:
    """(p,): the variance of the noise of every output over that of its white e, none of it drifting."""
    impulse = np.zeros(_LONG)
    impulse[0] = 1.0
    C, D, own = ([rows] * outputs if _flat(rows) else rows for rows in (told.C, told.D, A))
    return np.array(
        [np.sum(filtered(c, np.convolve(d, a), impulse) ** 2) for c, d, a in zip(C, D, own, strict=True)]
    )


def _as_told(told: Noise, source: str) -> list[str]:
    """All of the noise of the model."""
    variance = json.dumps(np.asarray(told.variance).tolist())
    return [f"noise:  # as {source} tells", f"  variance: {variance}", *_shape(told)]


def _level(text: str, folder: Path, powers: NDArray[np.float64], step: float) -> tuple[float, float, str]:
    """See `noise_level`; the largest variance of the log where that is to tell it."""
    if text == AS_LOG:
        return float(np.max(powers)), 0.0, "the variance that the log tells"
    return noise_level(text, folder, step)


def _shape(told: Noise) -> list[str]:
    """The drift, where there is one, and C and D, where they are not 1."""
    drift = [f"  drift: {json.dumps(told.drift)}  # an integrator in the noise"] if np.any(told.drift) else []
    rows = (("C", told.C), ("D", told.D))
    return [*drift, *(f"  {name}: {json.dumps(found)}" for name, found in rows if found != (1.0,))]


def _flat(polynomials: Sequence[Json]) -> bool:
    return not isinstance(polynomials[0], Sequence)


def _times(base: Sequence[float], A: Sequence[Json]) -> Json:
    """C that makes the noise of y that of `base`, whatever the A (1/A stands before it)."""
    if _flat(A):
        return np.convolve(base, A).tolist()
    return [np.convolve(base, row).tolist() for row in A]
