"""A small log of a time, an input and an output."""

import numpy as np
import scipy.signal


def lag_log(path, *, samples=300, seed=0, noise=0.2, gain=1.0, head="time_min,input,output"):
    """A log: u about 40, held for five samples, and y about 20, a lag of first order, three samples late."""
    rng = np.random.default_rng(seed)
    u = 40.0 + np.repeat(rng.choice([-1.0, 1.0], samples // 5 + 1), 5)[:samples]
    x = scipy.signal.lfilter([0, 0, 0, 0.2], [1, -0.8], u - 40.0)
    y = 20.0 + gain * x + noise * rng.standard_normal(samples)
    rows = np.column_stack([0.5 * np.arange(samples), u, y])
    path.write_text(f"{head}\n" + "\n".join(",".join(f"{x:.8g}" for x in row) for row in rows) + "\n")
    return path
