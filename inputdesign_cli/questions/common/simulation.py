"""A designed or given experiment, tried many times on the true system: does it keep what is predicted?

Every run draws a new realisation of the spectrum (scaled to its power exactly) and new noise. With
`simulation.excitation: record` all runs apply the one record that the design delivers.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf

import numpy as np

from inputdesign_cli.accuracy import ModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.compute.time_limit import time_limit
from inputdesign_cli.design.convex.limits import Weight, weighted_sum
from inputdesign_cli.errors import bad_spec, refuse
from inputdesign_cli.findings import simulated_runs
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.monte_carlo.excitations import Excitation, Recorded, Redrawn
from inputdesign_cli.monte_carlo.statistics import binomial_limits, whitened_eigenvalues, wishart_range
from inputdesign_cli.monte_carlo.study import PredictedError, Trials, tried_on
from inputdesign_cli.outcome import Powers, Simulation as Studied, curves as plots
from inputdesign_cli.outcome.estimate import variance_of
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import OnDesignModel, RatioAt, TriedInput, Violations
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Loop, close_loop
from inputdesign_cli.questions.common.bound_curves import Informed
from inputdesign_cli.questions.common.delivery import Delivered, with_study
from inputdesign_cli.signal.kinds import kind_of

_OF_RUNS = 0x0B5  # spawn key of the random streams of runs
# Number of records that are searched from several starts, if the design has rival minima.
_SEARCHED = 10
QUANTILES = (0.05, 0.5, 0.95)
_PAIRS = 4
_CLOUD = 2000
# Time constants of the loop that a figure shows after the end of the excitation.
_FADED = 3.0


def error_bands(units: Units, predicted: PredictedError, errors: Array, name: str) -> plots.ErrorBandCurves:
    """Return quantiles of the errors (runs, n) over frequency, of every entry with a prediction."""
    frequency = predicted.w / units.frequency
    r_u = predicted.r_u if name == "design" else None

    def panel(own: Array, entry: tuple[int, int] | None) -> plots.ErrorBandPanel:
        return plots.ErrorBandPanel(
            frequency=frequency[own],
            quantiles={q: np.quantile(errors[:, own], q, axis=0) for q in QUANTILES},
            r_u=None if r_u is None else r_u[own],
            r_adm=None if predicted.r_adm is None else predicted.r_adm[own],
            entry=entry,
            names=units.passage(entry),
        )

    entries, every = predicted.entries, np.ones(frequency.size, dtype=bool)
    places = [None] if entries is None else [(i, j) for i, j in np.unique(entries, axis=0).tolist()]
    panels = [panel(every if at is None else np.all(entries == at, axis=1), at) for at in places]
    return plots.ErrorBandCurves(tuple(panels), name.replace("_", " "), len(errors))


def cloud(trials: Trials, covariance: Array | None) -> plots.EllipseCurves | None:
    """Return the estimates in some planes; None without a covariance (k, k), or for a single parameter."""
    size = len(trials.names)
    if covariance is None or size < 2:
        return None
    pairs = []
    for i in sorted({round(i) for i in np.linspace(0, size - 2, _PAIRS)}):
        of = slice(i, i + 2)
        names, estimates = (trials.names[i], trials.names[i + 1]), trials.theta[:_CLOUD, of]
        pairs.append(plots.Ellipse(names, trials.truth[of], covariance[of, of], estimates=estimates))
    return plots.EllipseCurves(tuple(pairs))


def disturbance(units: Units, loop: Loop, excitation: Array) -> tuple[Table, plots.SignalCurves]:
    """Return the signals r, u_r and y_r of an excitation (n, r) of the true loop, until they have faded."""
    slowest = float(np.abs(loop.closed_poles).max(initial=0.0))
    tail = min(int(np.ceil(_FADED / (1.0 - slowest))), len(excitation))
    r = np.concatenate([excitation, np.zeros((tail, units.inputs))])
    y, u = loop.signals(r, np.zeros((len(r), units.outputs)))
    instants = units.sample_time * np.arange(len(r), dtype=np.float64)
    columns, shown = {units.time_header: instants}, {}
    for letter, cause, signals in (("r", "", r), ("u", "r", u), ("y", "r", y)):
        for number, samples in enumerate(signals.T, start=1):
            columns[f"{letter}{number}" + (f"_{cause}" if cause else "")] = samples
            shown[f"{letter}{'' if units.single else number}{cause}"] = samples
    first = "ruy" if units.single else "yur"
    return Table(columns), plots.SignalCurves(
        instants,
        {name: shown[name] for name in sorted(shown, key=lambda name: first.index(name[0]))},
        held=False,
    )


def tried_input(
    units: Units,
    trials: Trials,
    predicted: PredictedError,
    errors: Array,
    cost: Mapping[PowerKind, Weight],
    modelled: Trials | None,
) -> TriedInput:
    """Return the errors with one excitation against those `predicted`, on the design model too."""
    information, r_adm = trials.information, predicted.r_adm
    frequency = predicted.w / units.frequency
    entry = TriedInput(
        **vars(_fractions(trials, predicted, errors)),
        mean_estimate=_named(trials, trials.theta.mean(axis=0)),
        cost=weighted_sum(cost, trials.power),
        power=Powers.of(trials.power),
        total_power=Powers.of(trials.total_power),
        not_converged=int(np.sum(~trials.converged)),
    )
    if modelled is not None:
        on_model = _fractions(modelled, predicted, modelled.errors(predicted))
        entry = replace(entry, on_design_model=on_model)
    if information is not None:
        deviations = np.sqrt(np.diag(covariance_in_theory(information)))
        rms = np.sqrt(np.mean((trials.theta - trials.truth) ** 2, axis=0))
        eigenvalues = whitened_eigenvalues(trials.theta, information)
        of_theory = _named(trials, rms / deviations)
        entry = replace(entry, covariance_eigenvalues=eigenvalues, rms_over_theory=of_theory)
    if information is not None and r_adm is not None:
        ratio = trials.bound(predicted, information) / r_adm
        worst = int(np.argmax(ratio))
        entry = replace(entry, theory_on_truth=RatioAt(float(ratio[worst]), float(frequency[worst])))
    if r_adm is not None:
        beyond = errors / r_adm
        failed = beyond.max(axis=1) > 1.0
        if np.any(failed):
            quantiles = np.quantile(frequency[np.argmax(beyond[failed], axis=1)], QUANTILES)
            entry = replace(entry, violations=Violations(int(failed.sum()), quantiles, float(beyond.max())))
    return entry


def _named(trials: Trials, values: Array) -> dict[str, float]:
    return dict(zip(trials.names, values.tolist(), strict=True))


def _fractions(tried: Trials, predicted: PredictedError, errors: Array) -> OnDesignModel:
    """Return fractions of the runs whose error stays within bounds at all frequencies, with 95 % limits."""

    def within(bound: Array | None) -> tuple[float | None, tuple[float, float] | None]:
        if bound is None:
            return None, None
        inside = int(np.sum(np.all(errors <= bound, axis=1)))
        return inside / len(errors), binomial_limits(inside, len(errors))

    own = None if tried.information is None else tried.bound(predicted, tried.information)
    promised = predicted.r_u if tried.name == "design" else None
    return OnDesignModel(*within(predicted.r_adm), *within(own), *within(promised))


def covariance_in_theory(information: Array) -> Array:
    """Return the covariance M^-1 (k, k), inverted after scaling to unit diagonal."""
    scale = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale))


@dataclass(frozen=True)
class Simulation:
    """Describes the trial of an experiment: on the nominal one in raw parameters, or on the `truth`.

    With `relative_noise` the standard deviation of the noise there is that share of the weakest output's.
    With `renewed` each run realises the spectrum anew. At equal power flat signals of the kinds in `compare`
    are tried, too. For `entries` see `ModelQuestion`.
    """

    units: Units
    nominal: Experiment
    truth: Experiment | None
    relative_noise: float | None
    runs: int
    seed: int
    renewed: bool
    compare: Sequence[str]
    cost: Mapping[PowerKind, Weight]
    entries: Sequence[ModelError]

    def on_truth(self, nominal: Experiment, output_power: Sequence[float]) -> Experiment:
        """Return a nominal experiment on the true system; `output_power` (p,) is that of the design."""
        if self.truth is None:
            return nominal
        model, loop = self.truth.model, self.truth.loop
        if self.relative_noise is not None:
            variance = self.relative_noise**2 * min(output_power)
            model = model.at(model.theta, variance * np.eye(model.outputs))
        loop = None if loop is None else close_loop(model, loop.controller)
        return replace(nominal, model=model, loop=loop, factor=None)


@time_limit(inf)  # the limit of the solver is for the design
def simulate(plan: Simulation, delivered: Delivered, executor: Executor | None = None) -> Results:
    """Return the results with the study of their excitation, or raise `SpecError` (`nothing-to-simulate`)."""
    started = time.perf_counter()
    units, results = plan.units, delivered.results
    if delivered.record is None:
        message = "there is no record of the excitation, so that there is no experiment to simulate"
        hint = "ask for more accuracy or a longer signal, or give an excitation under spectrum.given"
        raise bad_spec("nothing-to-simulate", message, hint=hint, key="accuracy")
    outcome = results.outcome
    assert outcome.power is not None
    assert outcome.samples is not None
    excitations = _excitations(plan, delivered, delivered.record)
    nominal = plan.nominal.with_samples(len(delivered.record))
    true = plan.on_truth(nominal, outcome.power.output or ())
    # Children of this seed have drawn the record: they must not be used again for its noise.
    seed = plan.seed if plan.renewed else np.random.SeedSequence(plan.seed, spawn_key=(_OF_RUNS,))
    trying = partial(tried_on, runs=plan.runs, seed=seed, step=units.step, executor=executor)
    counted, simulated = outcome.samples, len(delivered.record)
    foretold = results.curves if counted == simulated else delivered.of_length(simulated)
    predicted = _predicted(plan, foretold, delivered.alpha, excitations[0].information(nominal))
    inputs, tables = dict[str, TriedInput](), dict[str, Table]()
    curves: dict[str, plots.Curves] = {name: foretold[name] for name in ("ellipses",) if name in foretold}
    for excitation in excitations:
        name = excitation.name
        tried = trying(true, nominal.model, excitation)
        errors = tried.errors(predicted)
        modelled = None if true is nominal else trying(nominal, nominal.model, excitation)
        inputs[name] = tried_input(units, tried, predicted, errors, plan.cost, modelled)
        curves[f"errors_{name}"] = error_bands(units, predicted, errors, name)
        theory = None if tried.information is None else covariance_in_theory(tried.information)
        drawn = cloud(tried, theory)
        if drawn is not None:
            curves[f"cloud_{name}"] = drawn
        if true.loop is not None:
            shown = disturbance(units, true.loop, tried.first)
            tables[f"disturbance_{name}"], curves[f"disturbance_{name}"] = shown
    searched = None
    if outcome.foreseen is not None and outcome.foreseen.rivals and delivered.rivals is not None:
        searched = delivered.rivals(_SEARCHED)
        inputs["design"] = replace(inputs["design"], searched=searched)
    asked = None if outcome.model_error is None else outcome.model_error.confidence
    findings = [
        *simulated_runs.other_length(counted, simulated),
        *simulated_runs.initial_estimate_off(units, inputs),
        *(simulated_runs.runs_miss_confidence(asked, inputs["design"]) if "design" in inputs else []),
        *simulated_runs.one_minimum(searched),
    ]
    model, rng = true.model, np.random.default_rng(plan.seed)
    entry = Studied(
        runs=plan.runs,
        seed=plan.seed,
        inputs=inputs,
        samples=true.samples,
        excitation="new" if plan.renewed else "record",
        true_parameters=dict(zip(model.names, model.theta.tolist(), strict=True)),
        true_variance=variance_of(model.covariance),
        wishart_range=tuple(wishart_range(nominal.size, plan.runs, rng)) if plan.runs > 1 else (),
    )
    return with_study(results, entry, started, findings, tables, curves)


def _excitations(plan: Simulation, delivered: Delivered, record: Array) -> list[Excitation]:
    """Return the design, signals of equal power, and white noise of the power that it would need."""
    outcome, step, samples = delivered.results.outcome, plan.units.step, len(record)
    assert outcome.power is not None
    power = float(np.sum(outcome.power.excitation or 0.0))
    renewed = delivered.renewed if plan.renewed else None
    listed: list[Excitation] = [renewed or Recorded("design", record, step)]
    listed += [_flat(plan, kind, kind, power, samples) for kind in plan.compare]
    white = None if outcome.baseline is None else outcome.baseline.white
    cheapest = outcome.objective is not None and outcome.objective.kind == "least_cost"
    if white is not None and white.power is not None and cheapest and "white" in plan.compare:
        needed = float(np.sum(white.power.excitation or 0.0))
        listed.append(_flat(plan, "white", "white_that_suffices", needed, samples))
    return listed


def _flat(plan: Simulation, kind: str, name: str, power: float, samples: int) -> Excitation:
    """Return an excitation of a flat spectrum over the band, or raise `SpecError` (`not-supported`)."""
    nominal, band = plan.nominal, plan.nominal.band
    everywhere = plan.units.sampled and band == (0.0, np.pi)
    if kind_of(kind).few_levels and not everywhere:
        what = f"compare a {kind} signal, which has power at all frequencies, with an excitation on a band"
        raise refuse("simulation.compare", what, "compare with multisine or white")
    powers = np.full(nominal.inputs, power / nominal.inputs)
    return Redrawn.flat(name, kind, powers, band, samples, plan.units.step)


def _predicted(
    plan: Simulation, foretold: Mapping[str, plots.Curves], alpha: float, information: Array
) -> PredictedError:
    """Return the prediction of the curve `bound`; without one, r_u from the `information`."""
    bound = foretold.get("bound")
    if not isinstance(bound, plots.BoundCurves):
        _, bound = Informed(plan.units, plan.entries, information, stated=False).bound()
    panels = bound.panels
    admissible = [panel.r_adm for panel in panels if panel.r_adm is not None]
    places = [panel.entry for panel in panels if panel.entry is not None]
    sizes = [panel.frequency.size for panel in panels]
    return PredictedError(
        w=np.concatenate([panel.frequency for panel in panels]) * plan.units.frequency,
        r_u=np.concatenate([panel.r_u for panel in panels]),
        r_adm=np.concatenate(admissible) if admissible else None,
        alpha=alpha,
        entries=np.repeat(np.array(places), sizes, axis=0) if places else None,
    )
