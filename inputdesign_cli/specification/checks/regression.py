"""Do a regression and what is asked of it fit each other."""

from __future__ import annotations

from collections.abc import Iterator

from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.wording import count


def regression_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """A regression is designed for mean-squared error, and that error is one of regressions."""
    error, plant = spec.accuracy.mean_squared_error, spec.plant
    path = ("accuracy", "mean_squared_error")
    if plant.kind != "regression":
        if error is not None:
            message = "{key} is for a linear regression, but the plant is not one"
            hint = "write plant: {regression: {estimated: 1, neglected: 1}}, or ask for a model_error"
            yield PathDiagnostic("regression-mismatch", message, hint, path)
        return
    for key in (*spec.accuracy.requirements, *spec.accuracy.goals):
        if key != "mean_squared_error":
            message, hint = "{key} does not go with a regression", "ask for accuracy.mean_squared_error"
            yield PathDiagnostic("regression-mismatch", message, hint, ("accuracy", key))
    if error is None:
        return
    for name, given, size in (
        ("estimated", error.estimated, plant.regression.estimated),
        ("neglected", error.neglected, plant.regression.neglected),
    ):
        if given is not None and len(given) != size:
            message = f"{{key}} holds {count(len(given), 'weight')}, but {size} regressors are {name}"
            hint = "write one weight per regressor; plant.regression says how many there are"
            yield PathDiagnostic("wrong-shape", message, hint, (*path, name))
