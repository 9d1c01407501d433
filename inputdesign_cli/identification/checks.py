"""Check that data determine a model, channel by channel, and name undetermined parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import bad_spec

# Residuals up to this power, relative to the output, are the rounding of files with eight digits.
_EXACT = 1e-16
# Correlation matrices of residuals with an eigenvalue up to this are singular to rounding.
_SINGULAR = 1e-13
# Fewer samples than this for each parameter say nothing about a covariance.
_SAMPLES_A_PARAMETER = 3


def signal_name(letter: str, channel: int, channels: int) -> str:
    """Return the name of a channel's signal in messages: `u2`, or `u` where it is the only one."""
    return letter if channels == 1 else f"{letter}{channel + 1}"


def check_length(samples: int, parameters: int, memory: int, *, outputs: int = 1) -> None:
    """Check that there are enough samples for `parameters` parameters and a predictor with this `memory`.

    Raises:
        SpecError: `too-few-samples`.
    """
    needed = -(-_SAMPLES_A_PARAMETER * parameters // outputs) + memory
    if samples < needed:
        raise bad_spec(
            "too-few-samples",
            f"{samples} samples are too few for {parameters} parameters: at least {needed} are needed",
            hint="record more samples, or lower the orders",
            key="u",
        )


def check_varying(names: Sequence[str], u: Array, y: Array) -> None:
    """Check that no channel of u (samples, r) and y (samples, p) keeps one value throughout.

    Raises:
        SpecError: `constant-input`, whose message has the `names` of the parameters, or `constant-output`.
    """
    static = f"only a static gain could be seen, not {', '.join(names)} each"
    if u.shape[1] > 1:
        static = "it shows no dynamics of its own, whatever the other inputs show"
    for letter, signals, code, says in (
        ("u", u, "constant-input", static),
        ("y", y, "constant-output", "it shows neither the input nor noise"),
    ):
        for index, signal in enumerate(signals.T):
            if np.ptp(signal) <= 1e-12 * max(float(np.abs(signal).max()), 1e-300):
                name = signal_name(letter, index, signals.shape[1])
                raise bad_spec(
                    code,
                    f"{name} has the same value {signal[0]:g} in every sample: {says}",
                    hint="is the signal in another column, or the logger stuck?",
                    key=name,
                )


def check_noisy(covariance: Array, y: Array) -> None:
    """Check that residuals of this `covariance` (p, p) exceed rounding of y (n, p) and are independent.

    Raises:
        SpecError: `noise-free-data`.
    """
    for index, power in enumerate(np.mean(y**2, axis=0)):
        if covariance[index, index] <= _EXACT * power:
            name = signal_name("y", index, y.shape[1])
            raise bad_spec(
                "noise-free-data",
                f"the model explains {name} to the last digit: there is no noise to estimate its variance",
                hint=f"is {name} computed from u? Real data have noise",
                key=name,
            )
    rms = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(rms, rms))
    if values[0] <= _SINGULAR:
        share = np.abs(vectors[:, 0])
        names = " and ".join(f"y{i + 1}" for i in np.flatnonzero(share > 0.05 * share.max()))
        raise bad_spec(
            "noise-free-data",
            f"the residuals of {names} determine each other: these outputs carry the same noise",
            hint="is one of the outputs computed from the others? Leave it out",
            key="y",
        )
