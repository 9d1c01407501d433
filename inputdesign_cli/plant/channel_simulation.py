"""What u and e cause at the outputs of a polynomial model, sample by sample, from rest."""

from __future__ import annotations

import numpy as np
import scipy.signal

from inputdesign_cli.plant.channels import PolynomialChannels
from inputdesign_cli.plant.polynomial import Array, roots_in_z


def caused_by_inputs(model: PolynomialChannels, u: Array) -> Array:
    """(.., n, p): G u for samples u (.., n, r)."""
    # Channels come first in memory: a filter passes over one of them at a time.
    y = np.moveaxis(np.zeros((model.outputs, *u.shape[:-1])), 0, -1)
    for i in range(model.outputs):
        for j in range(model.inputs):
            if np.any(model.B[i][j]):
                below = np.convolve(_one(model.A, i), model.F[i][j])
                y[..., i] += scipy.signal.lfilter(model.B[i][j], below, u[..., j])
    return y


def caused_by_noise(model: PolynomialChannels, e: Array) -> Array:
    """(.., n, p): H e for samples e (.., n, p)."""
    v = np.moveaxis(np.empty((model.outputs, *e.shape[:-1])), 0, -1)
    for i in range(model.outputs):
        below = np.convolve(_one(model.A, i), _one(model.D, i))
        v[..., i] = scipy.signal.lfilter(_one(model.C, i), below, e[..., i])
    return v


def stable_outputs(model: PolynomialChannels) -> tuple[bool, ...]:
    """Output by output, whether its row of G is stable."""
    rows = [
        [_one(model.A, i), *(F for B, F in zip(model.B[i], model.F[i], strict=True) if np.any(B))]
        for i in range(model.outputs)
    ]
    return tuple(all(np.all(np.abs(roots_in_z(p)) < 1.0) for p in row) for row in rows)


def _one(polynomials: tuple[Array, ...], output: int) -> Array:
    return polynomials[0] if len(polynomials) == 1 else polynomials[output]
