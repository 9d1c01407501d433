"""Margins kept after a campaign of the wizard: the heater template, true plants 20 % off in every parameter.

The plant is simulated and its sensitivity evaluated by plain difference equations. `wizard.py [RUNS] [TIME]`.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from inputdesign_cli import parse_spec, tasks
from inputdesign_cli.wizard.composing import compose

NOMINAL = {"gain": 2.1, "time_constant": 180.0, "dead_time": 25.0}


def sampled(K, T, L, step):
    """Delay in samples, pole and the two coefficients of a lag with dead time behind a hold."""
    whole = int(L // step)
    a = np.exp(-step / T)
    first = K * (1 - np.exp(-(step - L + whole * step) / T))
    return whole, a, first, K * (1 - a) - first


def response(plant, u):
    whole, a, first, second = plant
    late = np.concatenate([np.zeros(whole + 1), u])[: u.size]
    y = np.zeros(u.size)
    for t in range(1, u.size):
        y[t] = a * y[t - 1] + first * late[t] + second * late[t - 1]
    return y


def peak_db(plant, Kp, Ti, step):
    whole, a, first, second = plant
    z = np.exp(1j * np.geomspace(1e-4, np.pi / step, 4000) * step)
    G = z ** (-whole - 1) * (first + second / z) / (1 - a / z)
    C = Kp * (1 + step / (2 * Ti) * (1 + 1 / z) / (1 - 1 / z))
    return 20 * np.log10(np.max(1 / np.abs(1 + G * C)))


def main(runs=100, time="20 min"):
    answers = {
        "plant": "heater",
        "wish": "PI loop with 6 dB",
        "range": "plus/minus 5 around 40",
        "time": time,
        "noise": "standard deviation 0.2",
    }
    changes = {"uncertainty.scenarios": 10, "uncertainty.fresh": 0, "solver.any_spectrum": False}
    spec = compose(answers, "x", Path()).spec().with_(**changes, **{"signal.candidates": 1})
    found = tasks.solve(spec)
    u, step, rng = found.signal[:, 0] - 40.0, spec.sample_time, np.random.default_rng(5)
    print(f"r_u / r_adm of the record {found.result['signal']['worst_ratio']:.3g}")
    structure, peaks = spec.with_(uncertainty=None), []
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        for _ in range(runs):
            true = (v * (1 + 0.2 * s) for v, s in zip(NOMINAL.values(), rng.choice([-1, 1], 3), strict=True))
            plant = sampled(*true, step)
            y = response(plant, u) + 0.2 * rng.standard_normal(u.size)
            rows = np.c_[step * np.arange(u.size), u, y]
            np.savetxt(log, rows, delimiter=",", header="time,u,y", comments="")
            model = tasks.identify(structure, log, operating_point={"u1": 0.0, "y1": 0.0}).files["model.yaml"]
            fitted = parse_spec(model.decode(), design=False).plant.named_parameters
            K, T, L = (one.value for one in fitted)
            reach = 2 * (L + step / 2)  # Skogestad's rule, as fast as the dead time
            peaks.append(peak_db(plant, T / (K * reach), min(T, 4 * reach), step))
    print(
        f"margins of 6 dB kept in {np.sum(np.array(peaks) <= 6)} of {runs}, largest peak {max(peaks):.3g} dB"
    )


if __name__ == "__main__":
    main(*(int(text) for text in sys.argv[1:2]), *sys.argv[2:3])
