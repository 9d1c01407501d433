"""Judge a given model by data that it has not seen."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from inputdesign_cli.explore import Fits, fits
from inputdesign_cli.findings.explored_models import HALF, LEAST_FIT
from inputdesign_cli.identification import cross_correlations
from inputdesign_cli.identification.checks import check_varying, signal_name
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.identify import blaming_columns
from inputdesign_cli.questions.assessment.outcome import fit_of
from inputdesign_cli.questions.exploration.explore import Exploration
from inputdesign_cli.questions.exploration.outcome import validation_of
from inputdesign_cli.records import Preparation, Record, read_data, read_sheet, with_channels

# Probability that past inputs explain the residuals of a model by chance alone.
_SURELY = 1e-6
_SEE = "see whether the model is of this plant, and gain, delay, units and columns agree"


def judge(model: Model, header: Header, paths: Sequence[Path], preparation: Preparation) -> Exploration:
    """Return the fit and the tests of a given model on other data.

    Raises:
        DataError: the data cannot be used, or an output never changes.
    """
    started = time.perf_counter()
    counts = {"u": header.units.inputs, "y": header.units.outputs}
    sheet = read_sheet(paths[0], preparation=preparation)
    own = {
        name: column
        for name, column in with_channels(sheet, preparation.columns).items()
        if name in preparation.columns or int(name[1:]) <= counts[name[0]]
    }
    preparation = replace(preparation, columns=own)
    data = read_data(paths, header.units, preparation)
    with blaming_columns(paths[0], data):
        check_varying((), data.u[:, :0], data.y)
    found = fits(model, data.parts)
    simulated = [
        (fit if np.all(np.isfinite(curve)) else None, curve)
        for fit, curve in zip(found.simulation, found.simulated.T, strict=True)
    ]
    columns, curves = fit_of(header.units, data, found.errors, simulated, data.time)
    reasons = tuple(_reasons(found, data))
    outcome = Outcome(
        title=header.title or f"How the model does on {' and '.join(path.name for path in paths)}",
        status="validated",
        samples=len(data.y),
        validation=validation_of(found, reasons),
        findings=data.findings or None,
        notes=(*data.notes, *(f"no trust: {reason}" for reason in reasons)),
        timing_s={"validation": time.perf_counter() - started},
    )
    tables, unit = {"fit": Table(columns)}, header.units.time_unit
    return Exploration(Results(outcome, header.resolved_spec, unit, tables, {"fit": curves}), reasons)


def _reasons(found: Fits, data: Record) -> Iterator[str]:
    """Yield reasons why a model is not of these data: its simulation explains nothing, or too little.

    A poor fit alone is no fault of the model, since the noise may be strong, unless past inputs explain the
    rest.
    """
    for i, fit in enumerate(found.simulation):
        output = signal_name("y", i, len(found.simulation))
        if not np.isfinite(fit):
            yield f"the model has no simulation of {output}: its plant is unstable; {_SEE}"
        elif fit < LEAST_FIT:
            what = (
                f"the simulation explains {fit:.1f} % of {output}, and less than {LEAST_FIT:g} % is nothing"
            )
            yield f"{what}: a level alone explains as much; {_SEE}"
        elif fit < HALF:
            test = cross_correlations(found.errors[:, i : i + 1], data.u, lengths=data.lengths)
            if not test.probability >= _SURELY:
                yield (
                    f"the simulation explains {fit:.1f} % of {output} only, and past inputs explain the "
                    f"rest (probability {chance(test.probability)}): the model is not of the plant of "
                    "these data, or this acts otherwise here"
                )
