"""The noise of a plant that was explored in a log: answers hold, and the log has the rest."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.outcome.results import Json
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.specification import Noise, Spec
from inputdesign_cli.wizard.grammar import short
from inputdesign_cli.wizard.means import DRIFTING, at_rest, drifts, names_resolution, noise_level
from inputdesign_cli.wizard.questions import AS_LOG

_LONG = 100_000  # samples after which no pole of a log remembers anything


def log_noise_lines(explored: Spec, source: str, text: str, drift: str, folder: Path) -> list[str]:
    """Return the lines of `noise` from the answers, and from the model of a log where they leave it open.

    The size is the one that is stated; a resolution is the least that noise can be, and the log may show
    more. Where no drift is stated, the log decides. Noise without drift is correlated as in the log, unless
    data at rest show its correlation.

    Args:
        explored: the model of the log.
        source: the name of the log.
        text, drift: the answers.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
    noise = explored.noise
    found = np.atleast_1d(np.asarray(noise.variance, dtype=float))
    powers = np.diag(found) if found.ndim == 2 else found
    moves = bool(np.any(noise.drift))
    wanted = drifts(drift, otherwise=moves)
    if text == AS_LOG and wanted == moves:
        variance: Json = np.asarray(noise.variance).tolist()
        return [f"noise:  # as in {source}", f"  variance: {json.dumps(variance)}", *_shape(noise)]
    size, colour, comment = float(np.max(powers)), 0.0, "the variance in the log"
    if text != AS_LOG:
        size, colour, comment = noise_level(text, folder, explored.sample_time)
    variance = float(short(size))
    A = getattr(explored.plant, "A", None) or (1.0,)
    steady = not (wanted or moves or at_rest(text))
    gains = _gains(noise, A, powers.size) if steady else np.ones(powers.size)
    if names_resolution(text) and np.max(powers * gains) > size:
        variance, comment = np.asarray(noise.variance).tolist(), f"of {source}: more than rounding leaves"
    elif np.any(gains > 1.0):
        own = (size / gains).tolist()
        variance = float(short(own[0])) if powers.size == 1 else np.diag(own).tolist()
        comment += f", correlated as in {source}"
    listed = ", ".join(map(short, (powers * gains).tolist()))
    has = f"the log has a variance of {listed}, {'and drift' if moves else 'and no drift'}"
    lines = [f"noise:  # as you said; {has}", f"  variance: {json.dumps(variance)}  # {comment}"]
    if steady or (wanted and moves):  # with the colour that was estimated along
        return [*lines, *_shape(noise)]
    if wanted:
        lines.append("  drift: true  # an integrator in the noise")
    elif colour:
        lines.append(f"  D: [1, {short(-colour)}]")
    # 1/A stands before C: with the factor A in C, the noise of y is that without A.
    own_poles: list[Json] = [A] if _flat(A) else list(A)
    shaped = [np.convolve(DRIFTING if wanted else (1.0,), row).tolist() for row in own_poles]
    return lines if shaped == [[1.0]] else [*lines, f"  C: {json.dumps(shaped[0] if _flat(A) else shaped)}"]


def _gains(noise: Noise, A: Sequence[Json], outputs: int) -> NDArray[np.float64]:
    """Return the variance of the noise of every output (p,) over that of its white e, none of it drifting."""
    impulse = np.zeros(_LONG)
    impulse[0] = 1.0
    C, D, own = ([rows] * outputs if _flat(rows) else rows for rows in (noise.C, noise.D, A))
    return np.array(
        [np.sum(filtered(c, np.convolve(d, a), impulse) ** 2) for c, d, a in zip(C, D, own, strict=True)]
    )


def _shape(noise: Noise) -> list[str]:
    """Return the drift, where there is one, and C and D, where they are not 1."""
    drift = (
        [f"  drift: {json.dumps(noise.drift)}  # an integrator in the noise"] if np.any(noise.drift) else []
    )
    rows = (("C", noise.C), ("D", noise.D))
    return [*drift, *(f"  {name}: {json.dumps(found)}" for name, found in rows if found != (1.0,))]


def _flat(polynomials: Sequence[Json]) -> bool:
    return not isinstance(polynomials[0], Sequence)
