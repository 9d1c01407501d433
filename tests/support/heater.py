"""A heater with a dead time, its records, and summaries of results."""

from pathlib import Path

import numpy as np
import scipy.signal

from inputdesign_cli.cli.summary import summary

STRUCTURE = """
sample_time: 5
plant: {B: [0, 0, 0, 0, 0, 0, 0.03, 0.02], F: [1, -0.97]}
noise: {D: [1, -0.8], variance: 0.001}
"""
HEATER = (
    STRUCTURE
    + """
experiment: {samples: 400}
accuracy: {model_error: {relative: 0.3, band: [0, 0.02]}}
spectrum: {type: fir, order: 6}
"""
)
# exp(-5/205), exp(-5/8): a gain of 2.35 behind a time constant of 205 s and a lag of 8 s.
SLOW, LAG = 0.97590, 0.53526


def heater(samples, seed, *, lag=False, drift=0.0, level=(0.0, 0.0), warm=0.0, power=9.0):
    """A heater, sampled every 5 s: dead time of 5.6 samples, coloured noise, drift in degrees an hour."""
    rng = np.random.default_rng(seed)
    u = np.sqrt(power) * np.repeat(rng.choice([-1.0, 1.0], samples // 8 + 1), 8)[:samples]
    B, F = np.array([0, 0, 0, 0, 0, 0, 0.4, 0.6]) * 2.35 * (1 - SLOW), [1, -SLOW]
    if lag:
        B, F = B * (1 - LAG), np.convolve(F, [1, -LAG])
    y = scipy.signal.lfilter(B, F, u) + warm * SLOW ** np.arange(samples)
    y += scipy.signal.lfilter([1], [1, -0.8], 0.03 * rng.standard_normal(samples))
    time = 5.0 * np.arange(samples)
    return {"time_s": time, "u": u + level[0], "y": y + level[1] + drift * time / 3600}


def covariance_of(result, names):
    """The covariance of some parameters."""
    at = [result["information"]["parameters"].index(name) for name in names]
    return np.array(result["information"]["covariance"])[np.ix_(at, at)]


def said(results):
    """The summary in the terminal."""
    return summary(results.outcome, results.time_unit, [Path("run/result.json")])
