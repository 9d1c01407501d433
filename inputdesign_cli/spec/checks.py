"""Checks across sections. Each is a function of the spec that yields findings with absolute paths."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from inputdesign_cli.spec import checks_goal, checks_plant, checks_size
from inputdesign_cli.spec.findings import Finding
from inputdesign_cli.spec.model import Spec
from inputdesign_cli.spec.places import Path, parse_key

Check = Callable[[Spec], Iterator[Finding]]

# What each check reads. It is skipped where one of these could not be read: its answer would mislead.
CHECKS: tuple[tuple[Check, tuple[str, ...]], ...] = (
    (checks_plant.stable_unless_controlled, ("plant", "experiment.controller")),
    (checks_plant.controller_fits, ("plant", "experiment.controller")),
    (checks_plant.kept_loop_fits, ("plant", "accuracy.model_error.sensitivity")),
    (checks_plant.noise_fits, ("plant", "noise")),
    (checks_plant.true_system_fits, ("plant", "simulation.plant", "experiment.controller")),
    (checks_plant.true_noise_fits, ("plant", "simulation.noise")),
    (checks_plant.spectrum_fits, ("plant", "spectrum.type")),
    (checks_plant.regression_fits, ("plant", "accuracy.mean_squared_error")),
    (checks_plant.weights_fit, ("plant.sample", "plant.continuous")),
    (checks_plant.control_fits, ("plant", "accuracy.closed_loop_error")),
    (checks_size.channels, ("plant",)),
    (checks_size.bands, ("plant.sample", "sample_time", "plant.continuous")),
    (checks_size.frequencies, ("plant.sample", "sample_time", "limits.band")),
    (checks_goal.something_asked, ("accuracy", "spectrum.given", "objective")),
    (checks_goal.goals_agree, ("accuracy", "spectrum.given", "objective")),
    (checks_goal.limits_present, ("accuracy", "limits", "objective", "spectrum.given", "plant")),
    (checks_goal.sensitivity_has_loop, ("experiment.controller", "accuracy.model_error.sensitivity")),
    (checks_goal.lengths_agree, ("experiment.samples", "limits.samples", "objective")),
)


def related(path: Path, broken: Iterable[Path]) -> bool:
    """Whether the path is one of the broken ones, contains one, or lies inside one."""
    return any(path[: len(b)] == b or b[: len(path)] == path for b in broken)


def run_checks(spec: Spec, broken: set[Path]) -> list[Finding]:
    """All findings of all checks whose inputs could be read."""
    return [
        finding
        for check, reads in CHECKS
        if not any(related(parse_key(key), broken) for key in reads)
        for finding in check(spec)
    ]
