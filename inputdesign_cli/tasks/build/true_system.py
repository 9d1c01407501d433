"""Spec -> the true system of a simulation: the nominal one, but for what `simulation` says of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.plant.sampling import hold_entries
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.experiment import Noise
from inputdesign_cli.specification.models.plant import ContinuousPlant, PolynomialPlant
from inputdesign_cli.tasks.build.system import build_loop, build_model
from inputdesign_cli.tasks.simulation import TrueSystem


def build_true_system(spec: Spec) -> TrueSystem | None:
    """The system of `simulation.plant` and `simulation.noise`; None where neither is given.

    Raises:
        SpecError: a loop that is unstable with the true plant.
    """
    study = spec.simulation
    if study is None or (study.plant is None and study.noise is None):
        return None
    plant, noise = study.plant or spec.plant, spec.noise
    if study.noise is not None:
        stated = study.noise
        noise = Noise.model_construct(C=stated.C, D=stated.D, variance=stated.variance or 1.0)
    if plant.kind == "continuous" and (spec.plant.kind == "polynomial" or noise.filters):
        plant = _polynomials(plant, spec.sample_time)
    model = build_model(spec.model_copy(update={"plant": plant, "noise": noise}))
    controller = spec.experiment.controller
    with _blaming_truth():
        loop = None if controller is None else build_loop(model, controller)
    return TrueSystem(model, loop, None if study.noise is None else study.noise.relative_std)


def _polynomials(plant: ContinuousPlant, sample_time: float) -> PolynomialPlant:
    """A true plant in s behind a hold as B/F in q^-1: C and D then filter the noise alone."""
    matrix = plant.continuous
    held = hold_entries(matrix.numerator_matrix, matrix.denominator_matrix, sample_time)
    above = tuple(tuple(tuple(entry.numerator.tolist()) for entry in row) for row in held)
    below = tuple(tuple(tuple(entry.denominator_polynomial.tolist()) for entry in row) for row in held)
    return PolynomialPlant.model_construct(A=(1.0,), B=above, F=below)


@contextmanager
def _blaming_truth() -> Iterator[None]:
    """A loop that the nominal plant leaves stable, and the true one does not, is the fault of the latter."""
    try:
        yield
    except SpecError as error:
        found = error.diagnostics[0]
        raise bad_spec(
            found.code,
            f"with the true plant {found.message}",
            hint="give a true plant that the controller stabilises as well",
            key="simulation.plant",
        ) from error
