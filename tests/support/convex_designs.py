"""Convex designs for tests, also for several plants, and checks that every design must pass."""

import dataclasses

import cvxpy as cp
import numpy as np

from inputdesign_cli.accuracy import Criterion, Cut, ModelError, Relative, Requirement, Violation
from inputdesign_cli.design.convex.demands import Alternative, Question
from inputdesign_cli.design.convex.designs import solve_design
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import PolynomialModel, close_loop
from inputdesign_cli.spectrum import FirBasis, LinesBasis

BAND = (0.0, np.pi)
DENSE = np.unique(np.concatenate([np.linspace(*BAND, 8001), np.geomspace(1e-5, np.pi, 8001)]))
ORDER = 8


def asked(experiment, goal="cost", requirements=(), order=ORDER, **more):
    """A question about FIR spectra of one input; without another cost the power of the input is paid."""
    basis = more.pop("basis", FirBasis(1, order))
    if goal == "cost":
        more.setdefault("cost", {"input": 1.0})
    return Question(experiment, basis, goal, list(requirements), **more)


def solve(*args, tolerance=1e-7, **more):
    return solve_design(asked(*args, **more), tolerance=tolerance)


def alone(*args, **more):
    """The result without the bound over every spectrum."""
    return solve_design(asked(*args, **more), tolerance=1e-7, any_spectrum_tolerance=None).result


def optimum(*args, **more):
    return alone(*args, **more).objective


def relative(fraction=0.01, alpha=2.45, band=BAND, kind=ModelError, admissible=None):
    """The maker of a bound on the error of G, by default relative to the |G| of the plant it is made for."""

    def make(experiment):
        most = admissible or Relative(experiment.model, fraction, (0, 0))
        return kind(experiment=experiment, band=band, entry=(0, 0), admissible=most, alpha=alpha)

    return [make]


def anywhere():
    return LinesBasis.anywhere(*BAND, 1)


def criterion(letter):
    return [lambda e: Criterion(letter, e.factor)]


def moved(experiment, theta):
    """The same experiment on another plant of the structure, its loop closed by the same controller."""
    model, loop = experiment.model.at(theta), experiment.loop
    return dataclasses.replace(experiment, model=model, loop=loop and close_loop(model, loop.controller))


def alternatives(experiment, thetas, fraction):
    """One scenario for each theta (k,), the accuracy relative to its own G."""
    return [Alternative(moved(experiment, theta), relative(fraction)) for theta in thetas]


def around(experiment, number, spread, seed=0):
    """Parameters scattered around the nominal ones, by this share of each."""
    theta = experiment.model.theta
    rng = np.random.default_rng(seed)
    return [theta * (1.0 + spread * rng.standard_normal(theta.size)) for _ in range(number)]


def random_spectra(rng, order, number):
    """Coefficients of the spectra of random moving averages."""
    for _ in range(number):
        taps = rng.normal(size=order + 1)
        yield np.correlate(taps, taps, mode="full")[order:]


def meets(requirements, information, most=1.0):
    """Assert that all requirements hold at every frequency of a dense grid."""
    for requirement in requirements:
        low, high = getattr(requirement, "band", BAND)
        w = DENSE[(low <= DENSE) & (high >= DENSE)]
        assert requirement.ratios(information, w).max() <= most * (1 + 1e-6), requirement.name


def check(design, tolerance=1e-6):
    """Proof, limits and requirements of a design of one input, recomputed on a dense grid."""
    result, problem, anything = design.result, design.problem, design.any_spectrum
    if design.white_power == 0.0:
        assert problem.demands.worst_ratio(problem.baselines).ratio <= 1.0
        return
    assert result.certificate.bound <= result.objective * (1 + 1e-9)
    assert result.gap <= tolerance
    assert anything.certificate.bound <= result.objective * (1 + 1e-9)
    basis, x = result.basis, result.x
    for limit in problem.limits:
        power = dataclasses.replace(problem, basis=basis, finer=None).power(limit.kind).at(x)
        assert power <= limit.bound * (1 + 1e-9) if limit.upper else power >= limit.bound * (1 - 1e-9)
    if problem.goal == "cost":
        assert result.objective <= problem.price.at(design.white_power * problem.basis.even) * (1 + 1e-9)
        # The bound over every spectrum against the cost of a spectrum of sinusoids that meets the accuracy.
        assert anything.certificate.bound >= anything.objective * (1 - 1e-4)
        for scenario, *told in zip(
            problem.scenarios, result.informations, anything.informations, strict=True
        ):
            for information in told:
                meets(scenario.requirements, information)
    meets(problem.side, result.information)
    if isinstance(basis, FirBasis) and basis.inputs == 1:
        phi = basis.density(x, DENSE)
        assert phi.min() >= -1e-6 * phi.max()
        for density in problem.densities:
            level = density.level(DENSE)
            assert np.all(phi <= level * (1 + 1e-6)) if density.upper else np.all(phi >= level * (1 - 1e-6))


def pole_form(Z, C):
    """The form of |Z x|^2 <= |1 + C x|^2, Z and C (2, k): an error against the distance to a pole."""
    return np.block([[Z.T @ Z - C.T @ C, -C[:1].T], [-C[:1], -np.ones((1, 1))]])


def resonant():
    """A lightly damped OE system, for which cheap inputs and quiet outputs need different spectra."""
    model = PolynomialModel.single([0, 1.0, 0.3], F=[1, -1.4, 0.81], variance=0.2)
    return Experiment(model, 300)


class OnGrid(Requirement):
    """`whole` at these frequencies alone, as programs of the literature do, the worst `most` at a time."""

    def __init__(self, whole: Requirement, grid: np.ndarray, most: int | None = None):
        self.whole, self.grid, self.most = whole, grid, most

    @property
    def name(self) -> str:
        return "on a grid"

    def violations(self, information, *, above: float = -np.inf) -> list[Violation]:
        found = self.ratios(information, self.grid)
        worst = np.argsort(-found)[: self.most]
        return [Violation(float(found[i]), float(self.grid[i])) for i in worst if found[i] > above]

    def ratios(self, information, frequencies) -> np.ndarray:
        return self.whole.ratios(information, frequencies)

    def cut(self, frequency: float | None) -> Cut:
        return self.whole.cut(frequency)


def gram_program(problem, order, unit=1.0):
    """A FIR spectrum as a Gram matrix: (c, M as an expression, constraints), unknowns over `unit`."""
    scaled = cp.Variable(order + 1)
    c = unit * scaled
    gram = cp.Variable((order + 1, order + 1), PSD=True)
    constraints = [cp.trace(gram) == scaled[0]]
    constraints += [cp.sum(cp.diag(gram, k)) == scaled[k] for k in range(1, order + 1)]
    maps = problem.information_map
    M = problem.baseline_information + sum(c[i] * maps[i] for i in range(order + 1))
    return c, M, constraints
