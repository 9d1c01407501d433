"""All checks across sections; each is a function of the spec that yields diagnostics with absolute paths."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from inputdesign_cli.specification.checks import goal, loop, plant, size
from inputdesign_cli.specification.models.section import PathDiagnostic
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.yaml.places import Path, parse_key

Check = Callable[[Spec], Iterator[PathDiagnostic]]

# The keys that each check reads. It is skipped if one could not be read: its answer would mislead.
CHECKS: tuple[tuple[Check, tuple[str, ...]], ...] = (
    (plant.stable_unless_controlled, ("plant", "experiment.controller")),
    (loop.controller_fits, ("plant", "experiment.controller")),
    (loop.kept_loop_fits, ("plant", "accuracy.model_error.sensitivity")),
    (plant.noise_fits, ("plant", "noise")),
    (plant.names_differ, ("plant.parameters", "noise")),
    (plant.true_system_fits, ("plant", "simulation.plant", "experiment.controller")),
    (plant.true_noise_fits, ("plant", "simulation.noise")),
    (plant.spectrum_fits, ("plant", "spectrum.type")),
    (plant.regression_fits, ("plant", "accuracy.mean_squared_error")),
    (plant.weights_fit, ("plant.sample", "plant.continuous", "limits.spectrum")),
    (loop.control_fits, ("plant", "accuracy.closed_loop_error")),
    (size.channels, ("plant",)),
    (size.named_channels, ("plant", "channels")),
    (size.delays, ("plant", "sample_time", "experiment.samples")),
    (size.bands, ("plant.sample", "sample_time", "plant.continuous")),
    (size.frequencies, ("plant.sample", "sample_time", "limits.band")),
    (goal.something_asked, ("accuracy", "spectrum.given", "objective")),
    (goal.goals_agree, ("accuracy", "spectrum.given", "objective")),
    (goal.limits_present, ("accuracy", "limits", "objective", "spectrum.given", "plant")),
    (loop.sensitivity_has_loop, ("experiment.controller", "accuracy.model_error.sensitivity")),
    (goal.lengths_agree, ("experiment.samples", "limits.samples", "objective")),
)

# These checks do not matter if a model is only to be estimated.
OF_DESIGNS = (goal.something_asked, goal.limits_present)


def related(path: Path, broken: Iterable[Path]) -> bool:
    """Whether the path is one of the broken ones, contains one, or lies inside one."""
    return any(path[: len(b)] == b or b[: len(path)] == path for b in broken)


def run_checks(spec: Spec, broken: set[Path], *, design: bool) -> list[PathDiagnostic]:
    """Return the diagnostics of all checks whose keys could be read.

    Args:
        spec: The spec, which is valid section by section.
        broken: The paths that could not be read.
        design: Whether the question of a design must be complete.
    """
    return [
        found
        for check, reads in CHECKS
        if (design or check not in OF_DESIGNS) and not any(related(parse_key(key), broken) for key in reads)
        for found in check(spec)
    ]
