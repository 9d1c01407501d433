"""Spec -> the question of a convex design; everything that can be wrong with the spec is reported here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.errors import refuse
from inputdesign_cli.questions.building.demand import check_design
from inputdesign_cli.questions.building.header import build_header
from inputdesign_cli.questions.building.model_error import build_confidence
from inputdesign_cli.questions.building.requirements import build_asked, stated_bounds
from inputdesign_cli.questions.building.signal_settings import build_record_request, check_signal
from inputdesign_cli.questions.building.spectra import (
    build_basis,
    build_density_limits,
    build_power_limits,
    implied_limits,
)
from inputdesign_cli.questions.building.system import (
    GOALS,
    build_cost,
    build_experiment,
    check_known,
    excitation_band,
)
from inputdesign_cli.questions.building.unbounded import check_every_direction_counts, check_reach
from inputdesign_cli.questions.building.uncertainty import build_foresight, build_plants, build_simulation
from inputdesign_cli.questions.building.unhandled import refuse_unhandled
from inputdesign_cli.questions.least_cost.exact_confidence import ExactConfidence
from inputdesign_cli.questions.least_cost.solve import ConvexTask
from inputdesign_cli.questions.least_cost.sought import FewColumns, GridMethod, Sought
from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.specification import Spec
from inputdesign_cli.spectrum import Basis, LinesBasis, PolynomialBasis


def build_convex(spec: Spec) -> ConvexTask:
    """Build the design task for requirements and criteria that are convex in the information matrix."""
    check_supported(spec)
    experiment = build_experiment(spec)
    requirements, side = build_asked(spec, experiment)
    goal, cost = GOALS[spec.goal], build_cost(spec)
    experiment.whitened(1.0)  # raises an error that names unidentifiable parameters
    check_pairs(spec, experiment.model.names)
    check_signal(spec)
    basis = build_basis(spec, experiment.inputs, excitation_band(spec))
    grid = _grid_method(spec)
    check_design(spec, experiment, basis)
    counted = experiment.with_samples(1) if goal == "samples" else experiment
    plants = build_plants(spec, counted, basis)
    question = Question(
        experiment=counted,
        basis=basis,
        goal=goal,
        requirements=requirements,
        side=side,
        cost=cost if goal == "cost" else {},
        limits=[*build_power_limits(spec), *([] if grid else implied_limits(spec))],
        densities=build_density_limits(spec, experiment),
        others=[] if plants is None else plants.batch.plants,
        paid="nominal" if plants is None else plants.paid,
    )
    check_every_direction_counts(spec, question)
    reach, solver = check_reach(spec, question), spec.solver
    if reach.band is not None:
        question = _approaching(question, reach.band)
    # An optimum that is only approached is proved to the tolerance of the bound over every spectrum.
    loose = basis.free and goal == "factor" and not reach.attained
    tolerance = max(solver.tolerance, solver.any_spectrum_tolerance) if loose else solver.tolerance
    header, stated, exact = build_header(spec), build_confidence(spec, experiment), None
    if stated.calibration is not None:
        exact = ExactConfidence(stated.calibration, stated.usual, question, stated.simulator)
    return ConvexTask(
        asked=Sought(
            header,
            question,
            cost,
            stated.usual,
            exact,
            spec.limits.samples,
            plants,
            stated_bounds(spec),
            tolerance,
            solver.any_spectrum_tolerance if solver.any_spectrum and reach.bounded else None,
            reach,
            grid,
            _few_columns(spec, basis),
            windows=solver.windows,
        ),
        header=header,
        record=build_record_request(spec, experiment.size),
        ellipses=spec.report.ellipses,
        simulation=build_simulation(spec, experiment),
        foresight=build_foresight(spec, experiment),
    )


def _approaching(question: Question, band: tuple[float, float]) -> Question:
    """Return the question with every spectrum, and a free one, on this band."""
    if not question.basis.free:
        return replace(question, anywhere=band)
    experiment = replace(question.experiment, band=band)
    return replace(question, experiment=experiment, basis=LinesBasis.anywhere(*band, experiment.inputs))


_STATED = "state the accuracy as model_error or a criterion"
_UNHANDLED = {
    "accuracy.closed_loop_error": _STATED,
    "accuracy.mean_squared_error": "remove spectrum.given: a regression is designed, by its moments",
    "limits.energy": "limit input_power, its mean a sample",
    "solver.method": "use exchange or lmi",
    "signal.order": "remove it: noise comes from a long filter",
}


def check_supported(spec: Spec, question: str = "a design of the input spectrum") -> None:
    """Raise `SpecError` (`not-supported`) for what is not designed here, rather than ignore it."""
    refuse_unhandled(spec, question, _UNHANDLED, {"solver.method": ("exchange", "lmi")})
    signal, spectrum, error, uncertainty = spec.signal, spec.spectrum, spec.accuracy.error, spec.uncertainty
    if not spec.plant.sampled:
        # In continuous time samples are interpolated within their band: between them there are no levels.
        levels = signal.type is not None and kind_of(signal.type).of_levels
        stated = {"hold": signal.hold is not None, "bits": signal.bits is not None, "type": levels}
        for key in (name for name, there in stated.items() if there):
            hint = "write plant.sample: zoh for a signal that is held between samples, or use a multisine"
            what = "hold levels: between samples a plant in s is driven by their band-limited interpolation"
            raise refuse(f"signal.{key}", what, hint)
    if uncertainty is None:
        return
    columns = spectrum is not None and spectrum.type == "polynomial" and spectrum.factor_columns is not None
    if columns:
        what, hint = "hold a robust design to few factor columns", "remove spectrum.factor_columns"
    elif spec.solver.method == "lmi":
        what, hint = "write a robust design as the papers' program", "use method: exchange"
    elif error is not None and error.region == "ellipsoid" and uncertainty.r_adm == "fixed":
        what, hint = "take a fixed r_adm over the whole ellipsoid", "use r_adm: own, or region: first_order"
    elif error is not None and error.calibrated is not None:
        what, hint = "calibrate an exact confidence at several plants", "write confidence: 0.95"
    else:
        return
    raise refuse("uncertainty", what, hint)


def check_pairs(spec: Spec, known: Sequence[str]) -> None:
    """Raise `SpecError` (`unknown-parameter`) where `report.ellipses` names what the model does not have."""
    for n, pair in enumerate(spec.report.ellipses or ()):
        for m, name in enumerate(pair):
            check_known(spec, known, name, f"report.ellipses[{n}][{m}]")


def _grid_method(spec: Spec) -> GridMethod | None:
    """Return the papers' own program; raise `not-supported` unless model_error alone is asked."""
    if spec.solver.method != "lmi":
        return None
    error, stated = spec.accuracy.error, spec.limits
    # Limits on single samples bind the signal, not the spectrum.
    limited = stated.model_dump(exclude={"amplitude", "rate"}, exclude_none=True)
    plain = (
        spec.goal == "least_cost"
        and spec.accuracy.requirements in (("model_error",), ("loop",))
        and error is not None
        and error.region == "first_order"
        and (spec.spectrum is None or spec.spectrum.type in ("fir", "white"))
        and spec.plant.inputs == spec.plant.outputs == 1
        and spec.plant.sampled
        and not limited
    )
    if not plain:
        what = (
            "design more than the least cost of a FIR spectrum of one input for model_error, without limits"
        )
        hint = "use method: exchange, which does the rest, at every frequency"
        raise refuse("solver.method", what, hint, who="the papers' program (lmi)")
    return GridMethod(int(spec.solver.grid), spec.solver.positivity)


def _few_columns(spec: Spec, basis: Basis) -> FewColumns | None:
    """Return `factor_columns`, which is for criteria under upper power limits; None if not stated."""
    spectrum = spec.spectrum
    if spectrum is None or spectrum.type != "polynomial" or spectrum.factor_columns is None:
        return None
    plain = spec.accuracy.criterion is not None and not spec.accuracy.requirements
    floors = any(not limit.upper for limit in build_power_limits(spec))
    if not isinstance(basis, PolynomialBasis) or not plain or floors or spec.limits.spectrum is not None:
        hint = "remove factor_columns: the default, a factor of full rank, is the true optimum"
        what = "take few columns but for a criterion under upper limits on powers"
        raise refuse("spectrum.factor_columns", what, hint)
    return FewColumns(spectrum.factor_columns, spec.signal.seed or 0)
