"""The excitation that a result describes, as matrices over frequency; numpy and the result alone."""

import numpy as np


class NotJudgedError(Exception):
    """The spec or its result is beyond these formulas."""


def complex_of(value):
    if isinstance(value, list):
        return np.array([complex_of(part) for part in value])
    return complex(value["re"], value["im"]) if isinstance(value, dict) else complex(value)


class Excitation:
    """A density over the circle (n equal weights), or the powers of sinusoids, as matrices (r, r)."""

    def __init__(self, inputs, *, lags=None, lines=None, powers=None):
        self.inputs, self.lags, self.lines, self.power_matrices = inputs, lags, lines, powers

    def nodes(self, grid):
        """Frequencies (rad a sample) and matrices whose sum is the covariance of the excitation."""
        if self.lines is not None:
            return self.lines, self.power_matrices
        phi = np.repeat(self.lags[:1], grid.size, axis=0)
        for lag, c in enumerate(self.lags[1:], start=1):
            turned = np.exp(-1j * lag * grid)[:, None, None] * c
            phi = phi + turned + np.conj(np.swapaxes(turned, 1, 2))
        if np.linalg.eigvalsh(phi)[:, 0].min() < -1e-6 * np.abs(phi).max():
            raise NotJudgedError("a spectrum below zero between its nodes")
        return grid, phi / grid.size


def excitation_of(spec, result, inputs):
    """The spectrum that `result.json` describes."""
    spectrum, step = result["spectrum"], float(spec.get("sample_time", 1.0))
    if "powers" in spectrum:
        lines = np.array(spectrum["frequencies"], dtype=float) * step
        powers = complex_of(list(np.array(spectrum["powers"]).tolist()))
        return Excitation(inputs, lines=lines, powers=powers.reshape(-1, inputs, inputs))
    if spectrum["type"] == "fir":
        lags = complex_of(np.array(spectrum["coefficients"]).tolist())
        return Excitation(inputs, lags=lags.reshape(-1, inputs, inputs))
    if spectrum["type"] == "white" and not spectrum.get("band"):
        return Excitation(inputs, lags=np.array([np.eye(inputs) * spectrum["power"] / inputs], complex))
    raise NotJudgedError(spectrum["type"])
