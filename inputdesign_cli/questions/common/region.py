"""All plants that may be the true one, where they are a ball or a box in some coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.question import Alternative


@dataclass(frozen=True)
class Region:
    """The plants centre + columns z, (k,) and (k, m): z in the unit ball, or with `box` in [-1, 1]^m.

    `name` says in words what it is; `at` gives the plant at theta (k,), None where there is none.
    """

    name: str
    centre: Array
    columns: Array
    box: bool
    at: Callable[[Array], Alternative | None]

    def theta(self, z: Array) -> Array:
        """(k,): the parameters at z (m,)."""
        return np.asarray(self.centre + self.columns @ z)

    def nearest(self, theta: Array) -> Array:
        """(m,): a point of the region near these parameters."""
        z = np.linalg.lstsq(self.columns, theta - self.centre, rcond=None)[0]
        if self.box:
            return np.asarray(np.clip(z, -1.0, 1.0), dtype=float)
        return np.asarray(z / max(float(np.linalg.norm(z)), 1.0), dtype=float)

    def farthest(self, gradient: Array) -> Array:
        """(m,): the point of the region that is farthest in this direction."""
        if self.box:
            return np.asarray(np.sign(gradient), dtype=float)
        return np.asarray(gradient / max(float(np.linalg.norm(gradient)), 1e-300), dtype=float)
