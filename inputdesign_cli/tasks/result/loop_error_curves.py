"""Tables and curves of a design for the closed-loop error, in the units of the spec."""

from __future__ import annotations

from typing import Any

import numpy as np

from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.runs.results import DirectionCurves, MatrixSpectrumCurves, Table
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.loop_error_design import ClosedLoopDesign
from inputdesign_cli.tasks.result.channel_curves import hermitian_columns

_POINTS = 800
_DECADES = 1e-3
_GRID = 512


def spectrum_tables(spec: Spec, design: ClosedLoopDesign) -> tuple[dict[str, Table], dict[str, Any]]:
    """spectrum.csv on the grid that the spec asks for, and the figures."""
    lo, hi = design.problem.band
    if design.lines is not None:
        w, Phi = design.lines.frequencies, design.lines.spectrum
        shown, drawn = w, Phi
    else:
        w = np.linspace(lo, hi, getattr(spec.spectrum, "grid", _GRID))
        Phi = design.density(w)
        shown = np.geomspace(max(lo, _DECADES * hi), hi, _POINTS)
        drawn = design.density(shown)
    header = f"frequency_rad_per_{spec.time_unit}"
    table = Table({header: w / spec.sample_time, **hermitian_columns(Phi, "phi")})
    lined = design.lines is not None
    white = None if lined else design.white_level
    curves: dict[str, Any] = {
        "spectrum": MatrixSpectrumCurves(
            shown / spec.sample_time, drawn, white=white, lines=lined, logarithmic=True
        ),
        "directions": _directions(spec, design, shown, drawn, white),
    }
    return {"spectrum": table}, curves


def _directions(
    spec: Spec, design: ClosedLoopDesign, w: Array, Phi: ComplexArray, white: float | None
) -> DirectionCurves:
    _, gains, right = np.linalg.svd(design.problem.plant.plant_at(w))
    directions = np.conj(np.swapaxes(right, 1, 2))
    power = np.einsum("kai,kab,kbi->ki", np.conj(directions), Phi, directions).real
    lined = design.lines is not None
    return DirectionCurves(w / spec.sample_time, gains, power, white=white, lines=lined)
