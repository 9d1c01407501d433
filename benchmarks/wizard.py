"""What is asked of each template of the wizard, after campaigns at true plants 20 % off in every parameter.

    python benchmarks/wizard.py [TEMPLATE ..] [RUNS]

Every parameter of the true plant is 20 % up or down at random. Plants are simulated by plain difference
equations, and what holds at the true plant is evaluated with them.
"""

import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import cont2discrete, lfilter

from inputdesign_cli import parse_spec, questions
from inputdesign_cli.wizard.composing import compose


@dataclass(frozen=True)
class Sampled:
    """b(z^-1)/a(z^-1) behind a delay, of a plant between a hold and a sampler."""

    b: np.ndarray
    a: np.ndarray
    late: int = 0

    def __call__(self, z):
        over = [np.polynomial.polynomial.polyval(1 / z, c) for c in (self.b, self.a)]
        return z ** (-self.late) * over[0] / over[1]

    def simulated(self, u):
        return lfilter(self.b, self.a, np.r_[np.zeros(self.late), u])[: u.size]


def lag(step, K, T, L):
    """K/(T s + 1) e^(-L s)."""
    whole, fall = int(L // step), np.exp(-step / T)
    first = K * (1 - np.exp(-(step - L + whole * step) / T))
    return Sampled(np.array([0, first, K * (1 - fall) - first]), np.array([1, -fall]), whole)


def integrator(step, k, L):
    """k/s e^(-L s)."""
    whole = int(L // step)
    part = L - whole * step
    return Sampled(k * np.array([0, step - part, part]), np.array([1.0, -1.0]), whole)


def resonance(step, K, zeta, w0):
    """K w0^2/(s^2 + 2 zeta w0 s + w0^2)."""
    b, a, _ = cont2discrete(([K * w0**2], [1, 2 * zeta * w0, w0**2]), step)
    return Sampled(b.ravel(), a)


def pi(step, Kp, Ti):
    """By the trapezoidal rule, as in the spec."""
    half = step / (2 * Ti)
    return Sampled(Kp * np.array([1 + half, half - 1]), np.array([1.0, -1.0]))


def skogestad(step, K, T, L):
    """The rule for PI, as fast as the dead time with half a sample."""
    reach = 2 * (L + step / 2)
    return pi(step, T / (K * reach), min(T, 4 * reach))


def peak_db(plant, controller, step):
    z = np.exp(1j * np.geomspace(1e-4 * np.pi, np.pi, 8000))
    return 20 * np.log10(np.max(1 / np.abs(1 + plant(z) * controller(z))))


@dataclass(frozen=True)
class Template:
    """The answers beside a template, its parameters, its sampled plant, and what closes the loop.

    Args:
        controller: of the loop that is asked for, from the step and an estimate.
        under: that of the experiment, from the step; None in open loop.
    """

    answers: dict
    true: dict
    sampled: object
    controller: object = None
    under: object = None


GAINS = np.array([[12.8, -18.9], [6.6, -19.4]])
TIMES = np.array([[1002.0, 1260], [654, 864]])
DEAD = np.array([[60.0, 180], [420, 180]])
TEMPLATES = {
    "heater": Template(
        {"wish": "PI loop with 6 dB", "range": "plus/minus 5 around 40", "time": "1 h", "noise": "0.2"},
        {"gain": 2.1, "time_constant": 180.0, "dead_time": 25.0},
        lag,
        skogestad,
    ),
    "tank": Template(
        {"wish": "PI loop with 6 dB", "range": "plus/minus 5", "time": "20 min", "noise": "0.1"},
        {"k": 0.05, "L": 5.0},
        integrator,
        lambda step, *_: pi(step, 0.8, 60.0),
        lambda step: pi(step, 0.8, 60.0),
    ),
    "motor": Template(
        {"wish": "PI loop with 6 dB", "range": "plus/minus 5 around 10", "time": "40 s", "noise": "0.05"},
        {"gain": 0.1, "time_constant": 0.5, "dead_time": 0.02},
        lag,
        skogestad,
    ),
    "axis": Template(
        {
            "wish": "own loop with 6 dB, Kp 0.03, Ti 0.02",
            "range": "plus/minus 1",
            "time": "5 s",
            "noise": "0.1",
        },
        {"gain": 1.0, "damping": 0.1, "natural_frequency": 30.0},
        resonance,
        lambda step, *_: pi(step, 0.03, 0.02),
    ),
    "column": Template(
        {
            "wish": "prediction within 10 % up to 0.005",
            "range": "plus/minus 1",
            "time": "20 h",
            "noise": "0.8",
        },
        {
            f"{name}{i + 1}{j + 1}": float(values[i, j])
            for name, values in (("K", GAINS), ("T", TIMES), ("L", DEAD))
            for i in range(2)
            for j in range(2)
        },
        None,
    ),
}


def matrix(step, values):
    """The entries of the column, from gains, time constants and dead times."""
    K, T, L = np.reshape(values, (3, 2, 2))
    return [[lag(step, K[i, j], T[i, j], L[i, j]) for j in range(2)] for i in range(2)]


def looped(plant, controller, r, e):
    """u and y of y = G u + e, u = r - C y, sample by sample; G has no direct path."""
    u, x, y = np.zeros(r.size), np.zeros(r.size), np.zeros(r.size)

    def sum_of(c, signal, t, late=0):
        return sum(v * signal[t - late - i] for i, v in enumerate(c) if t - late - i >= 0)

    fed = np.zeros(r.size)
    for t in range(r.size):
        x[t] = sum_of(plant.b, u, t, plant.late) - sum_of(np.r_[0, plant.a[1:]], x, t)
        y[t] = x[t] + e[t]
        fed[t] = sum_of(controller.b, y, t) - sum_of(np.r_[0, controller.a[1:]], fed, t)
        u[t] = r[t] - fed[t]
    return u, y


def campaign(one, spec, u, values, rng):
    """u (N, m) and y (N, p) of one campaign at the true plant."""
    sd, step = float(one.answers["noise"]), spec.sample_time
    e = sd * rng.standard_normal((u.shape[0], u.shape[1]))
    if one.sampled is None:
        G = matrix(step, values)
        return u, np.stack([sum(G[i][j].simulated(u[:, j]) for j in range(2)) for i in range(2)], 1) + e
    plant = one.sampled(step, *values)
    if one.under is None:
        return u, plant.simulated(u[:, 0])[:, None] + e
    applied, y = looped(plant, one.under(step), u[:, 0], e[:, 0])
    return applied[:, None], y[:, None]


def asked(one, step, estimate, values):
    """Of the true plant: its peak of |S| over 6 dB, or its error over what is admitted; one is enough."""
    if one.sampled is not None:
        return peak_db(one.sampled(step, *values), one.controller(step, *estimate), step) / 6.0
    z = np.exp(1j * step * np.geomspace(2 * np.pi / 72000, 0.005, 300))
    pairs = zip(np.ravel(matrix(step, estimate)), np.ravel(matrix(step, values)), strict=True)
    return max(float(np.max(np.abs(a(z) / b(z) - 1))) / 0.1 for a, b in pairs)


def measure(name, runs):
    one, rng = TEMPLATES[name], np.random.default_rng(5)
    answers = {"plant": name, **one.answers, "noise": f"standard deviation {one.answers['noise']}, white"}
    spec = compose(answers, "x", Path()).spec()
    changes = {"solver.any_spectrum": False, "signal.candidates": 1}
    if spec.uncertainty is not None:
        changes |= {"uncertainty.scenarios": 10, "uncertainty.fresh": 0}
    found = questions.solve(spec.with_(**changes))
    step = spec.sample_time
    offset = float(spec.signal.offset or 0.0)
    u, judged = found.signal - offset, spec.with_(**{"solver.any_spectrum": False})
    channels = range(1, u.shape[1] + 1)
    point = {f"{kind}{i}": 0.0 for kind in "uy" for i in channels}
    header = ",".join(["time", *(f"{kind}{i}" for kind in "uy" for i in channels)])
    shares, verdicts = [], []
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        for _ in range(runs):
            values = [
                v * (1 + 0.2 * s)
                for v, s in zip(one.true.values(), rng.choice([-1, 1], len(one.true)), strict=True)
            ]
            applied, y = campaign(one, spec, u, values, rng)
            rows = np.c_[step * np.arange(u.shape[0]), applied, y]
            np.savetxt(log, rows, delimiter=",", header=header, comments="")
            assessed = questions.assess(judged, log, operating_point=point)
            model = assessed.results.files["model.yaml"]
            fitted = parse_spec(model.decode(), design=False).plant.named_parameters
            shares.append(asked(one, step, [p.value for p in fitted], values))
            verdicts.append(assessed.verdict)
    kept, met = np.array(shares) <= 1.0, np.array(verdicts) == "met"
    missed, undecided = (verdicts.count(word) for word in ("missed", "undecided"))
    ratio = found.result["signal"]["worst_ratio"]
    print(
        f"{name:7s} r_u / r_adm of the record {ratio:.3g}; kept in {kept.sum()} "
        f"of {runs}, largest {max(shares):.3g} times what is asked",
        f"assess: met in {met.sum()} (kept in {(met & kept).sum()}), missed {missed}, undecided {undecided}",
        sep="\n        ",
        flush=True,
    )


def main(*words):
    runs = next((int(word) for word in words if word.isdigit()), 100)
    for name in [word for word in words if word in TEMPLATES] or TEMPLATES:
        started = time.process_time()
        measure(name, runs)
        print(f"        {time.process_time() - started:.0f} s of CPU", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
