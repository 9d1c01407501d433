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
            does not say its dt; `bad-argument` for an argument that does not go with the system;
            `improper-transfer`, `inaccurate-conversion`; what is wrong with the spec.
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
    _check_arguments(discrete, sample_time, delay, known, blocks)
    if parameters is None:
        plant = _transfer(system, discrete=discrete)
    elif isinstance(system, control.StateSpace):
        plant = _states(system, parameters, discrete=discrete)
    else:
        hint = "leave it out: its coefficients are the parameters; or give it as control.ss(..)"
        raise _bad_argument("parameters", "names entries of a system in state space", hint)
    if delay is not None:
        plant["continuous" if parameters is None else "state_space"]["delay"] = delay
    if not discrete and sample_time is not None:
        plant["sample"] = "zoh"
    if len(known):
        plant["known"] = list(known)
    time = system.dt if discrete else sample_time
    data = {"plant": plant, "noise": {"variance": 1.0} if noise is None else noise, **blocks}
    return Spec.from_dict(
        data if time is None else {"sample_time": time, **data}, design="accuracy" in blocks
    )


def _bad_argument(name: str, message: str, hint: str) -> SpecError:
    return bad_spec("bad-argument", f"{name} {message}", hint=hint, key=name)


def _check_arguments(
    discrete: bool, sample_time: object, delay: object, known: object, blocks: Mapping[str, Plain]
) -> None:
    """Raise `SpecError` where an argument would be ignored, or does not go with the others."""
    if discrete and sample_time is not None:
        hint = "leave it out, or resample the system"
        raise _bad_argument("sample_time", "is of a system in continuous time; this one has its dt", hint)
    if discrete and delay is not None:
        message = "is of a system in continuous time; in discrete time it is among the poles"
        raise _bad_argument("delay", message, "multiply the system by z^-d")
    if isinstance(known, str) or not isinstance(known, Sequence):
        raise _bad_argument("known", "must be a list of names of parameters", "write known=['b0']")
    if "plant" in blocks:
        raise _bad_argument("plant", "is the system itself", "leave it out, or use Spec.from_dict")


def _states(
    system: control.StateSpace, parameters: Mapping[str, Place], *, discrete: bool
) -> dict[str, Plain]:
    arrays = {"A": system.A, "B": system.B, "C": system.C, "D": system.D}
    if not isinstance(parameters, Mapping):
        raise _bad_parameter("must be a mapping of names to entries")
    matrices: dict[str, Plain] = {letter: array.tolist() for letter, array in arrays.items()}
    values: dict[str, Plain] = {}
    taken: dict[Place, str] = {}
    for name, place in parameters.items():
        letter, i, j = found = _place(str(name), place, arrays)
        other = taken.setdefault(found, str(name))
        if other != name:
            raise _bad_parameter(f"names the entry {letter}[{i}, {j}] twice: {other} and {name}")
        values[str(name)], matrices[letter][i][j] = matrices[letter][i][j], str(name)
    time = "discrete" if discrete else "continuous"
    return {"parameters": values, "state_space": {**matrices, "time": time}}


def _place(name: str, place: object, arrays: Mapping[str, np.ndarray]) -> Place:
    """The entry of a parameter; indices below 0 count from the end, as in Python."""
    if isinstance(place, str) or not isinstance(place, Sequence) or len(place) != 3:
        raise _bad_parameter(f"{name} must be a matrix, a row and a column, not {place!r}")
    letter, *indices = place
    if not isinstance(letter, str) or letter not in arrays:
        raise _bad_parameter(f"{name} is in {letter!r}: the matrices are {', '.join(arrays)}")
    rows, columns = arrays[letter].shape
    try:
        return letter, range(rows)[indices[0]], range(columns)[indices[1]]
    except TypeError:
        raise _bad_parameter(f"{name}: row and column must be whole numbers, not {indices}") from None
    except IndexError:
        message = f"{name}: {letter} is {rows} x {columns} and has no entry {indices}, from 0"
        raise _bad_parameter(message) from None


def _bad_parameter(message: str) -> SpecError:
    return _bad_argument("parameters", message, "write parameters={'k': ('B', 1, 0)}: B, row 1, column 0")


def _transfer(system: control.TransferFunction | control.StateSpace, *, discrete: bool) -> dict[str, Plain]:
    """The plant of numerators and denominators, in rows of columns; in discrete time in q^-1."""
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
    """In q^-1, ascending, and monic; poles at 0 are delays and no coefficients to be estimated.

    Raises:
        SpecError: `improper-transfer`.
    """
    above, below = (np.trim_zeros(np.array(part, dtype=float), "f") for part in (top, bottom))
    if above.size > below.size:
        message = (
            f"the system has degree {above.size - 1} in z above and {below.size - 1} below: its output "
            "would come before its input"
        )
        raise bad_spec("improper-transfer", message, hint="multiply it by z^-d", key="plant")
    late = [0.0] * (below.size - above.size)
    ascending = np.trim_zeros(below / below[0], "b").tolist()
    return [*late, *np.trim_zeros(above / below[0], "b")] if above.size else [0.0], ascending
