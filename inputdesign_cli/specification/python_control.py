"""Systems of python-control as specs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from inputdesign_cli.errors import bad_spec
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.yaml.plain import Plain

if TYPE_CHECKING:
    import control

Place = tuple[str, int, int]
_CANCELS = 1e-7


def from_control(
    system: control.TransferFunction | control.StateSpace,
    *,
    sample_time: float | None = None,
    delay: float | Sequence[Sequence[float]] | None = None,
    parameters: Mapping[str, Place] | None = None,
    known: Sequence[str] = (),
    noise: Mapping[str, Plain] | None = None,
    **blocks: Plain,
) -> Spec:
    """The spec with this system as its plant.

    Args:
        system: in discrete time with its dt, or in continuous time.
        sample_time: of a system in continuous time that is sampled behind a hold; without, it stays in s.
        delay: dead time of a system in continuous time, a number or rows of columns.
        parameters: of a state-space system, the entries that are estimated: {"k": ("B", 1, 0)}; without, its
            transfer functions are the plant, and all their coefficients are estimated.
        known: names of parameters that are not estimated.
        noise: the block; white noise of variance 1 where nothing is given.
        blocks: other blocks of the spec: experiment, accuracy, spectrum ..

    Raises:
        SpecError: `not-supported` for another kind of object; `not-sampled` for one in discrete time that
            does not say its dt; what is wrong with the spec.
    """
    import control

    if not isinstance(system, control.TransferFunction | control.StateSpace):
        kind = type(system).__name__
        hint = "fit a transfer function to it, or identify one from data: idesign identify, idesign explore"
        raise bad_spec("not-supported", f"a {kind} has no parameters to be estimated", hint=hint, key="plant")
    discrete = system.isdtime(strict=True)
    if discrete and system.dt is True:
        message = "the system is in discrete time and does not say its sampling time"
        raise bad_spec("not-sampled", message, hint="give it one: tf(num, den, 0.1)", key="sample_time")
    data: dict[str, Plain] = {"sample_time": float(system.dt)} if discrete else {}
    if not discrete and sample_time is not None:
        data["sample_time"] = float(sample_time)
    if parameters is not None and isinstance(system, control.StateSpace):
        plant = _states(system, parameters, discrete=discrete)
    else:
        plant = _transfer(system, discrete=discrete)
    if delay is not None:
        if discrete:
            message = "a delay of a system in discrete time is among its own delays"
            raise bad_spec("unsuitable-key", message, hint="multiply it by z^-d", key="plant")
        inside = plant["state_space" if parameters is not None else "continuous"]
        inside["delay"] = np.asarray(delay, dtype=float).tolist()
    if not discrete and sample_time is not None:
        plant["sample"] = "zoh"
    if known:
        plant["known"] = list(known)
    data |= {"plant": plant, "noise": dict(noise or {"variance": 1.0}), **blocks}
    return Spec.from_dict(data, design="accuracy" in blocks)


def _states(
    system: control.StateSpace, parameters: Mapping[str, Place], *, discrete: bool
) -> dict[str, Plain]:
    matrices = {
        "A": system.A.tolist(),
        "B": system.B.tolist(),
        "C": system.C.tolist(),
        "D": system.D.tolist(),
    }
    values = {}
    for name, (letter, i, j) in parameters.items():
        values[name], matrices[letter][i][j] = matrices[letter][i][j], name
    return {
        "parameters": values,
        "state_space": matrices | {"time": "discrete" if discrete else "continuous"},
    }


def _transfer(system: control.TransferFunction | control.StateSpace, *, discrete: bool) -> dict[str, Plain]:
    rows = [[_entry(system, i, j) for j in range(system.ninputs)] for i in range(system.noutputs)]
    if not discrete:
        above, below = ([[entry[k] for entry in row] for row in rows] for k in (0, 1))
        return {"continuous": {"numerator": _plain(above), "denominator": _plain(below)}}
    held = [[_in_delays(*entry) for entry in row] for row in rows]
    B, F = ([[entry[k] for entry in row] for row in held] for k in (0, 1))
    return {"B": _plain(B), "F": _plain(F)}


def _entry(
    system: control.TransferFunction | control.StateSpace, output: int, input: int
) -> tuple[list[float], list[float]]:
    """Numerator and denominator of an entry, descending, without what they have in common."""
    import scipy.signal

    if hasattr(system, "A"):
        # One output and one input at a time: an entry has no more poles than reach it.
        top, bottom = scipy.signal.ss2tf(
            system.A, system.B[:, [input]], system.C[[output]], system.D[[output]][:, [input]]
        )
        zeros, poles = np.roots(_trimmed(top[0])), np.roots(bottom)
        gain = _trimmed(top[0])[0] if np.any(np.abs(top[0]) > 0) else 0.0
        for zero in zeros.copy():
            near = np.abs(poles - zero)
            if near.size and near.min() <= _CANCELS * (1.0 + abs(zero)):
                poles = np.delete(poles, int(np.argmin(near)))
                zeros = np.delete(zeros, int(np.argmin(np.abs(zeros - zero))))
        return tuple(np.atleast_1d(np.real(p)).tolist() for p in (gain * np.poly(zeros), np.poly(poles)))
    above, below = (np.asarray(part[output][input], dtype=float) for part in (system.num, system.den))
    return np.atleast_1d(above).tolist(), np.atleast_1d(below).tolist()


def _trimmed(coefficients: np.ndarray) -> np.ndarray:
    """Without leading coefficients that are rounding."""
    size = np.abs(coefficients).max(initial=0.0)
    large = np.flatnonzero(np.abs(coefficients) > 1e-12 * size)
    return coefficients[large[0] :] if large.size else np.zeros(1)


def _in_delays(top: list[float], bottom: list[float]) -> tuple[list[float], list[float]]:
    """In q^-1, ascending, and monic."""
    lead = next(i for i, c in enumerate(bottom) if c)
    below = np.array(bottom[lead:])
    above = np.trim_zeros(np.array(top), "f")
    late = [0.0] * (below.size - above.size)
    return [*late, *(above / below[0]).tolist()] or [0.0], (below / below[0]).tolist()


def _plain(rows: list[list[list[float]]]) -> Plain:
    """One entry as it is, several as rows of columns."""
    return rows[0][0] if len(rows) == len(rows[0]) == 1 else rows
