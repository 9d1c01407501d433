"""Records of a loop whose controller is a law from textbooks, a sample at a time."""

import numpy as np
import scipy.signal

SAMPLES = 800


def loop(seed, law, *, steps=0.3, reported=0.0, pole=0.9, delay=3, held=100, samples=SAMPLES):
    """u, y of a lag of gain 1 behind a delay, and AR noise; `law` makes the controller of the error."""
    rng = np.random.default_rng(seed)
    v = scipy.signal.lfilter([1], [1, -0.9], 0.05 * rng.standard_normal(samples))
    r = np.repeat(steps * rng.uniform(-1, 1, samples // held), held)
    u, x, y, answer = np.zeros(samples), np.zeros(samples), np.zeros(samples), law()
    for k in range(samples):
        x[k] = pole * x[k - 1] + (1.0 - pole) * u[k - delay] if k >= delay else 0.0
        y[k] = x[k] + v[k]
        u[k] = answer(r[k] - y[k])
    return u[:, None] + reported * rng.standard_normal((samples, 1)), y[:, None]


def pid(gain, integral=0.0, derivative=0.0):
    """The PID controller of textbooks, a sample at a time."""

    def law():
        state = {"sum": 0.0, "last": 0.0}

        def answer(error):
            state["sum"] += integral * error
            change, state["last"] = error - state["last"], error
            return gain * error + state["sum"] + derivative * change

        return answer

    return law


LAWS = {"P": pid(2.0), "PI": pid(1.0, 0.08), "PID": pid(1.0, 0.08, 1.5)}
