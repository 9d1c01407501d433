"""Systems of python-control as specs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.transfer_of_states import Entry, transfer_functions
from inputdesign_cli.specification.yaml.plain import Plain

if TYPE_CHECKING:
    import control

Place = tuple[str, int, int]


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
    """Return the spec with this system as its plant: in discrete time with its dt, or in continuous time.

    In continuous time, a `sample_time` samples it behind a hold, and `delay` is its dead time, a number or
    rows of columns. `parameters` are the estimated entries of a state-space system: {"k": ("B", 1, 0)}.
    Without them, its transfer functions are the plant, and all their coefficients except `known` ones are
    estimated. The `noise` is white of variance 1 by default; `blocks` are others of the spec: experiment,
    accuracy, spectrum ..

    Raises `SpecError`: `not-supported` for another kind of object; `not-sampled` without a dt; `bad-
    argument` for an argument that does not go with the system; `improper-transfer`, `inaccurate-
    conversion`; or an error of the spec.
    """
    import control

    if not isinstance(system, control.TransferFunction | control.StateSpace):
        kind = type(system).__name__
        hint = "fit a transfer function to it, or identify one from data: idesign identify, idesign explore"
        raise bad_spec("not-supported", f"a {kind} has no parameters to be estimated", hint=hint, key="plant")
    discrete, in_states = system.isdtime(strict=True), isinstance(system, control.StateSpace)
    if discrete and system.dt is True:
        message = "the system is in discrete time and does not say its sampling time"
        raise bad_spec("not-sampled", message, hint="give it one: tf(num, den, 0.1)", key="sample_time")
    for name, wrong, why, hint in (
        ("sample_time", discrete and sample_time is not None, "the system has its own dt", "leave it out"),
        ("delay", discrete and delay is not None, "delays of samples are poles", "multiply by z^-d"),
        ("known", not _listed(known), "it is no list of names", "write known=['b0']"),
        ("plant", "plant" in blocks, "it is the system itself", "leave it out, or use Spec.from_dict"),
        ("parameters", parameters is not None and not in_states, "the system has no states", "leave it out"),
    ):
        if wrong:
            raise bad_spec("bad-argument", f"{name} cannot be given: {why}", hint=hint, key=name)
    if parameters is None:
        plant, key = _transfer(system, discrete=discrete), "continuous"
    else:
        plant, key = _states(system, parameters, discrete=discrete), "state_space"
    if delay is not None:
        plant[key]["delay"] = delay
    if not discrete and sample_time is not None:
        plant["sample"] = "zoh"
    if len(known):
        plant["known"] = list(known)
    time = system.dt if discrete else sample_time
    clock = {} if time is None else {"sample_time": time}
    data = {**clock, "plant": plant, "noise": {"variance": 1.0} if noise is None else noise, **blocks}
    return Spec.from_dict(data, design="accuracy" in blocks)


def _listed(value: object) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _states(
    system: control.StateSpace, parameters: Mapping[str, Place], *, discrete: bool
) -> dict[str, Plain]:
    """Return the plant of matrices with names in place of the entries that are estimated."""
    arrays = {"A": system.A, "B": system.B, "C": system.C, "D": system.D}
    matrices: dict[str, Plain] = {letter: array.tolist() for letter, array in arrays.items()}
    values: dict[str, Plain] = {}
    if not isinstance(parameters, Mapping):
        raise _bad_parameter("must be a mapping of names to entries")
    for name, place in parameters.items():
        try:
            letter, row, column = place
            entries = matrices[letter][row]
            if isinstance(entries[column], str):
                raise IndexError
            values[str(name)], entries[column] = entries[column], str(name)
        except (TypeError, ValueError, LookupError):
            sizes = ", ".join(f"{letter} is {len(a)} x {a.shape[1]}" for letter, a in arrays.items())
            raise _bad_parameter(f"has no free entry {place!r} for {name}: {sizes}, from 0") from None
    time = "discrete" if discrete else "continuous"
    return {"parameters": values, "state_space": {**matrices, "time": time}}


def _bad_parameter(message: str) -> SpecError:
    hint = "write parameters={'k': ('B', 1, 0)}: B, row 1, column 0"
    return bad_spec("bad-argument", f"parameters {message}", hint=hint, key="parameters")


def _transfer(system: control.TransferFunction | control.StateSpace, *, discrete: bool) -> dict[str, Plain]:
    """Return the plant of numerators and denominators, in rows of columns; in discrete time in q^-1."""
    entries: list[list[Entry]]
    if hasattr(system, "A"):
        entries = transfer_functions(system.A, system.B, system.C, system.D, discrete=discrete)
    else:
        each = [[(i, j) for j in range(system.ninputs)] for i in range(system.noutputs)]
        entries = [[(list(system.num[i][j]), list(system.den[i][j])) for i, j in row] for row in each]
    if discrete:
        entries = [[_in_delays(*entry) for entry in row] for row in entries]
    above, below = ([[entry[k] for entry in row] for row in entries] for k in (0, 1))
    parts = [rows[0][0] if len(rows) == len(rows[0]) == 1 else rows for rows in (above, below)]
    if discrete:
        return dict(zip("BF", parts, strict=True))
    return {"continuous": dict(zip(("numerator", "denominator"), parts, strict=True))}


def _in_delays(top: list[float], bottom: list[float]) -> Entry:
    """Return the entry in q^-1, ascending and monic; poles at 0 are delays and not estimated.

    Raises `SpecError`: `improper-transfer`.
    """
    above, below = (np.trim_zeros(np.array(part, dtype=float), "f") for part in (top, bottom))
    if above.size > below.size:
        message = f"the system has {above.size - below.size} more zeros than poles in z: it looks ahead"
        raise bad_spec("improper-transfer", message, hint="multiply it by z^-d", key="plant")
    late = [0.0] * (below.size - above.size)
    ascending = np.trim_zeros(below / below[0], "b").tolist()
    return [*late, *np.trim_zeros(above / below[0], "b")] if above.size else [0.0], ascending
