"""Discrete-time state-space models put together from blocks."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import scipy.linalg

from inputdesign_cli.plant.polynomial import Array


class StateSpace(NamedTuple):
    """x(t + 1) = A x + B v, z = C x + D v with n states, m inputs v and q outputs z."""

    A: Array
    B: Array
    C: Array
    D: Array

    @classmethod
    def of(cls, blocks: Iterable[tuple[Array, Array, Array]], direct: Array) -> StateSpace:
        """Blocks (A, B, C) that share all inputs and of which the outputs add up; D (q, m) is `direct`."""
        outputs, inputs = direct.shape
        none = (np.zeros((0, 0)), np.zeros((0, inputs)), np.zeros((outputs, 0)))
        A, B, C = zip(none, *blocks, strict=True)
        return cls(scipy.linalg.block_diag(*A), np.concatenate(B), np.concatenate(C, axis=1), direct)
