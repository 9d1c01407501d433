"""Plants that the tests share."""

import numpy as np

from inputdesign_cli import parse_spec
from inputdesign_cli.expressions import Expression
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import ContinuousModel, Parametrisation, PolynomialModel, Reparametrised
from inputdesign_cli.questions.building.system import build_model


def stated(text):
    """The model that the sections of a spec state."""
    return build_model(parse_spec(text, design=False))


def arrays(rows):
    return tuple(tuple(np.array(entry, dtype=float) for entry in row) for row in rows)


def descending(rows):
    return arrays([[entry[::-1] for entry in row] for row in rows])


def lag_of(numerator, denominator, *delay, variance=1.0) -> ContinuousModel:
    """A plant of one channel from descending powers of s, perhaps with a dead time."""
    entries = descending([[list(numerator)]]), descending([[list(denominator)]])
    late = ((np.array(delay),),) if delay else ()
    return ContinuousModel.monic(*entries, variance * np.eye(1), delay=late)


def late_entries(common=False) -> ContinuousModel:
    """Two by two, one entry without dead time (unless they are common), one of higher order, one biproper."""
    delays = [[[0.8], [0.8]]] * 2 if common else [[[0.8], [1.3]], [[], [1.0]]]
    return ContinuousModel.monic(
        descending([[[1.0], [2.0, 0.5]], [[-0.7, 0.2], [1.2]]]),
        descending([[[1.0, 0.5], [1.0, 0.4]], [[1.0, 0.7, 1.3], [1.0, 0.9]]]),
        np.eye(2),
        delay=arrays(delays),
        common_delay=common,
    )


def known(model, *names) -> Reparametrised:
    """The model with these parameters known."""
    return Reparametrised(model, Parametrisation.identity(model.names, model.theta, names))


def process() -> ContinuousModel:
    """K e^(-Ls) / (Ts + 1) with L one fifth of T."""
    return lag_of([2.0], [3.3, 1.0], 3.3 / 5)


def in_words(model) -> Reparametrised:
    """The model of `process` in the parameters K and T."""
    terms = tuple(map(Expression.of, ("K/T", "1/T", "T/5")))
    at = Parametrisation(("K", "T"), ("K", "T"), np.array([2.0, 3.3]), np.ones(2, dtype=bool), terms)
    return Reparametrised(model, at)


def every_polynomial() -> PolynomialModel:
    """One input and one output, every polynomial present."""
    return PolynomialModel.single(
        [0, 2.0, 0.3], A=[1, -0.5], C=[1, 0.2], D=[1, 0.6], F=[1, -0.1, 0.4], variance=0.7
    )


def polynomials(model, theta=None):
    """A, B, C, D and F by letter, with the values of `theta` by the names of its parameters."""
    values = dict(zip(model.names, model.theta if theta is None else theta, strict=True))
    own = {"A": model.A[0], "B": model.B[0][0], "C": model.C[0], "D": model.D[0], "F": model.F[0][0]}
    return {
        letter: [values.get(f"{letter.lower()}{lag}", c) for lag, c in enumerate(p)]
        for letter, p in own.items()
    }


def two_by_two() -> ContinuousModel:
    """The nominal plant of the spectral design paper."""
    return ContinuousModel.monic(
        descending([[[3.125], [3.188]], [[5.313], [1.563]]]),
        descending([[[1, 1.5, 1.563], [1, 2, 1.063]], [[1, 0.5, 1.063], [1, 1, 0.312]]]),
        np.eye(2),
    )


def paper_experiment(power: float = 1000.0) -> Experiment:
    """The experiment of the spectral design paper on the half band [0, 2], whitened."""
    return Experiment(two_by_two(), 1, (0.0, 2.0)).whitened(power)


def arx(seed: int = 0, *, per_output: bool = True) -> PolynomialModel:
    """A 2 x 2 ARX plant with ten parameters and correlated noise."""
    rng = np.random.default_rng(seed)
    one = np.ones(1)
    B = arrays([[[0.0, *rng.normal(size=2)] for _ in range(2)] for _ in range(2)])
    A = (np.array([1.0, -0.7]), np.array([1.0, 0.4])) if per_output else (np.array([1.0, -0.9, 0.5]),)
    ones = ((one, one), (one, one))
    return PolynomialModel(B, A, ones, (one,), (one,), np.array([[1.0, 0.4], [0.4, 0.5]]))


def box_jenkins(seed: int = 1) -> PolynomialModel:
    """Two outputs, three inputs, every polynomial present, one entry of B zero."""
    rng = np.random.default_rng(seed)
    B = [[[0.0, *rng.normal(size=2)] for _ in range(3)] for _ in range(2)]
    B[0][2] = [0.0]
    F = [[[1.0, rng.uniform(-0.8, 0.8)] for _ in range(3)] for _ in range(2)]
    noise = rng.normal(size=(2, 2))
    return PolynomialModel(
        arrays(B),
        (np.array([1.0, 0.2]),),
        arrays(F),
        (np.array([1.0, 0.5]), np.array([1.0, -0.3])),
        (np.array([1.0, -0.6]),),
        noise @ noise.T + np.eye(2),
    )
