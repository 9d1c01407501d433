"""Random plants, loops and admissible errors with fixed seeds, for which designs are tried."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import Absolute, AdmissibleError, ModelError, Relative, Sensitivity, Table
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import Loop, PolynomialModel, Rational, TransferMatrix, close_loop

STRUCTURES = ("oe", "arx", "armax", "bj", "fir", "general")


def monic(rng: np.random.Generator, order: int, *, radius: tuple[float, float]) -> np.ndarray:
    """A monic polynomial with roots at radii in `radius`, complex pairs and real ones mixed."""
    roots: list[complex] = []
    while len(roots) < order:
        r = rng.uniform(*radius)
        if order - len(roots) >= 2 and rng.random() < 0.7:
            angle = rng.uniform(0.05, 3.0)
            roots += [r * np.exp(1j * angle), r * np.exp(-1j * angle)]
        else:
            roots.append(r * rng.choice([-1.0, 1.0]))
    return np.real(np.poly(roots)) if roots else np.ones(1)


def random_model(rng: np.random.Generator, structure: str, order: int) -> PolynomialModel:
    """A stable plant of this structure; poles to radius 0.99, numerators and noise zeros to 0.9."""
    plant_poles = monic(rng, order, radius=(0.3, 0.99))
    noise = monic(rng, rng.integers(1, 3), radius=(0.1, 0.9))
    extra = monic(rng, rng.integers(1, 3), radius=(0.1, 0.9))
    delay = int(rng.integers(1, 4))
    B = np.concatenate(
        [np.zeros(delay), rng.normal() * monic(rng, rng.integers(0, max(order, 1)), radius=(0.1, 0.9))]
    )
    one = np.ones(1)
    A, C, D, F = {
        "oe": (one, one, one, plant_poles),
        "arx": (plant_poles, one, one, one),
        "armax": (plant_poles, noise, one, one),
        "bj": (one, noise, extra, plant_poles),
        "fir": (one, one, one, one),
        "general": (extra, noise, monic(rng, 1, radius=(0.1, 0.9)), plant_poles),
    }[structure]
    return PolynomialModel.single(A=A, B=B, C=C, D=D, F=F, variance=float(rng.uniform(0.1, 2.0)))


def random_loop(rng: np.random.Generator, model: PolynomialModel, *, closed: bool) -> Loop | None:
    """None for open loop, or a random low-order controller at a gain well inside stability."""
    if not closed:
        return None
    pole = rng.uniform(0.2, 0.995)
    shape = np.array([1.0, -rng.uniform(0.0, 0.9)])
    slowest = max(np.abs(np.roots(np.convolve(model.A[0], model.F[0][0]))).max(initial=0.0), pole)
    gain = 1.0
    for _ in range(80):
        loop = close_loop(model, TransferMatrix.build([[gain * shape]], [[[1.0, -pole]]]))
        if np.abs(loop.closed_poles).max(initial=0.0) < 0.5 + 0.5 * slowest:
            return loop
        gain *= 0.7
    raise AssertionError("a small enough gain never destabilises a stable plant")


@dataclass(frozen=True)
class Case:
    """One random design problem."""

    name: str
    model: PolynomialModel
    loop: Loop | None
    admissible: AdmissibleError
    alpha: float
    samples: int
    order: int
    cost: dict[str, float]
    band: tuple[float, float]

    def experiment(self, samples: int | None = None) -> Experiment:
        """Return its experiment, of another length if one is given."""
        return Experiment(self.model, samples or self.samples, loop=self.loop)

    def requirement(self, experiment: Experiment) -> ModelError:
        """Return its accuracy in the coordinates of an experiment."""
        return ModelError(
            experiment=experiment, band=self.band, entry=(0, 0), admissible=self.admissible, alpha=self.alpha
        )


def random_case(seed: int) -> Case:
    """The design problem of this seed: structure, order, loop, r_adm, cost and FIR order all random."""
    rng = np.random.default_rng(seed)
    structure = STRUCTURES[seed % len(STRUCTURES)]
    model = random_model(rng, structure, int(rng.integers(1, 7)))
    closed = bool((seed // len(STRUCTURES)) % 2)
    loop = random_loop(rng, model, closed=closed)
    kind = ("relative", "absolute", "table", "sensitivity" if closed else "relative")[(seed // 3) % 4]
    w = np.geomspace(1e-3, np.pi, 25)
    size = np.abs(model.plant_at(w)[:, 0, 0])
    level = float(np.median(size))
    admissible: AdmissibleError
    if kind == "absolute":
        admissible = Absolute(0.05 * level)
    elif kind == "table":
        admissible = Table(w, 0.1 * size * np.exp(0.3 * rng.normal(size=w.size)))
    elif kind == "sensitivity":
        assert loop is not None
        grid = np.linspace(0, np.pi, 20001)
        C, G = loop.controller.at(grid)[:, 0, 0], model.plant_at(grid)[:, 0, 0]
        peak = float(np.max(1 / np.abs(1 + C * G)))
        admissible = Sensitivity(loop, Rational.build([0.8 / peak], [1.0]))
    else:
        admissible = Relative(model, float(rng.choice([0.01, 0.1, 0.25])), (0, 0))
    weights = {"input": float(rng.uniform(0, 1)), "output": float(rng.uniform(0, 1)), "excitation": 0.01}
    return Case(
        name=f"{seed}-{structure}-{'closed' if closed else 'open'}-{kind}",
        model=model,
        loop=loop,
        admissible=admissible,
        alpha=float(rng.uniform(1.5, 4.0)),
        samples=int(rng.integers(100, 2000)),
        order=int(rng.choice([0, 3, 10, 20, 40])),
        cost=weights,
        band=(1e-3, np.pi) if kind == "table" else (0.0, np.pi),
    )
