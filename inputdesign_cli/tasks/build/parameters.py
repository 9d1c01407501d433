"""Parameters that a spec names: whether the model has them, and matrices over some of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.specification import Spec


def check_known(spec: Spec, known: Sequence[str], name: str, key: str) -> None:
    """Raise `SpecError` (`unknown-parameter`) for the name of a parameter that the model does not have."""
    if name not in known:
        raise spec.complain(
            "unknown-parameter",
            f'the model has no parameter "{name}"',
            hint=f"its parameters are {', '.join(known)}",
            key=key,
        )


def embedded(spec: Spec, known: Sequence[str], matrix: Array, names: Sequence[str] | None, key: str) -> Array:
    """A matrix over some named parameters (all, when none are named) as one over all `known`: (k, k).

    Raises:
        SpecError: `unknown-parameter` or `wrong-shape`.
    """
    for name in names or ():
        check_known(spec, known, name, key)
    listed = tuple(names or known)
    if len(matrix) != len(listed):
        raise spec.complain(
            "wrong-shape",
            f"the matrix is {len(matrix)} x {len(matrix)}, but there are {len(listed)} parameters",
            hint=f"order its rows as {', '.join(known)}, or name its parameters",
            key=key,
        )
    full = np.zeros((len(known), len(known)))
    index = [list(known).index(name) for name in listed]
    full[np.ix_(index, index)] = matrix
    return full
