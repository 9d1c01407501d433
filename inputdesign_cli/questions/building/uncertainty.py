"""Spec -> what the plant may be: known before any data, the plants to serve, the true one of `simulate`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.demands import Alternative
from inputdesign_cli.design.convex.limits import Paid
from inputdesign_cli.design.convex.scenario_theory import samples_for
from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import Loop, Model
from inputdesign_cli.questions.building import system
from inputdesign_cli.questions.building.demand import check_effects, on_finite_information
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.model_error import confidence_factor, unstated_errors
from inputdesign_cli.questions.building.requirements import build_asked
from inputdesign_cli.questions.building.system import (
    build_cost,
    build_earlier,
    build_loop,
    build_model,
    check_known,
    embedded,
    held_plant,
    inverse,
)
from inputdesign_cli.questions.common.foresight import Foreseen, Foresight, Knowledge
from inputdesign_cli.questions.common.robust import CONFIDENCE, Batch, Plants, Region
from inputdesign_cli.questions.common.simulation import Simulation
from inputdesign_cli.specification import Simulation as SimulationSection, Spec, load_estimate
from inputdesign_cli.specification.models.experiment import Noise
from inputdesign_cli.specification.models.sizes import most
from inputdesign_cli.specification.models.uncertainty import SOURCES, Uncertainty
from inputdesign_cli.spectrum import Basis

_DEFAULT_SCENARIOS, _DEFAULT_RADIUS = 100, 0.998
# The largest number of draws per plant that is asked for; at least this many are allowed in all.
_TRIES, _LEAST_TRIES = 20, 500
# Fresh plants between two checks of the time limit.
_AT_A_TIME = 50
_ON_CIRCLE = 1e-9
# Frequencies at which an entry of G is evaluated, in shares of the band.
_PROBES = np.array([0.31, 0.57, 0.83])
KEY = "uncertainty"
# Confidences of an ellipsoid: of the plants that are possible, and of the plants that a design is made for.
POSSIBLE, _DESIGNED = 0.999, 0.998
# An estimate that is farther from the plant of the spec, in standard deviations, is of another plant.
_AWAY = 3.0


class _NoPlantError(Exception):
    """Says that parameters give no stable plant: the code of the error, and the reason."""


@dataclass(frozen=True)
class UncertainPlant:
    """Holds an uncertain plant: its section `stated`, and the `experiment` on the nominal plant."""

    spec: Spec
    stated: Uncertainty
    experiment: Experiment

    @property
    def nominal(self) -> Model:
        """Return the plant of the spec."""
        return self.experiment.model

    @cached_property
    def spread(self) -> Knowledge:
        """Return the distribution of the parameters: uniform over the box of all intervals, or normal.

        Its centre is (k,), and the covariance of normal draws is columns columns^T. Raises `SpecError`:
        `unknown-parameter`, `wrong-shape`, `bad-interval`, `not-positive-definite`, `wrong-estimate`.
        Or `DataError`: a record cannot be used.
        """
        if self.stated.intervals is None:
            covariance = self._covariance()
            varied = np.flatnonzero(np.diag(covariance) > 0.0)
            columns = np.zeros((len(covariance), varied.size))
            columns[varied] = np.linalg.cholesky(covariance[np.ix_(varied, varied)])
            return Knowledge(self.nominal.theta, columns, box=False)
        centre, columns = (
            self.nominal.theta.copy(),
            np.zeros((self.experiment.size, len(self.stated.intervals))),
        )
        for column, (name, (low, high)) in enumerate(self.stated.intervals.items()):
            key = f"{KEY}.intervals.{name}"
            row = self._row(name, key)
            if not low <= centre[row] <= high:
                message = f"{name} is {centre[row]:.6g} in the plant, outside of [{low:g}, {high:g}]"
                hint = "widen the interval, or move the plant into it"
                raise self.spec.complain("bad-interval", message, hint=hint, key=key)
            centre[row], columns[row, column] = 0.5 * (low + high), 0.5 * (high - low)
        return Knowledge(centre, columns, box=True)

    def _row(self, name: str, key: str) -> int:
        """Return the index of a parameter; `SpecError` (`unknown-parameter`)."""
        check_known(self.spec, self.nominal.names, name, key)
        return self.nominal.names.index(name)

    def _covariance(self) -> Array:
        """Return the covariance (k, k) of the parameters, zero for known ones."""
        spec, names, (letter, *_) = self.spec, self.nominal.names, self.stated.stated(*SOURCES)
        key, source, listed = f"{KEY}.{letter}", self.stated.at(letter), self.stated.parameters
        if isinstance(source, str) and source.endswith((".yaml", ".yml")):
            return self._of_model_file(source, key)
        if isinstance(source, str):
            record = system.read_excitation_record(spec, source, key)
            matrix = system.information_in(spec, replace(self.experiment, prior=None), record)
            letter, listed = "information", None
        else:
            matrix = np.array(source, dtype=float)
        if letter == "information":
            try:
                matrix = inverse(matrix)
            except np.linalg.LinAlgError:
                message = "the information matrix is singular: no plants can be drawn of some parameters"
                hint = "name the parameters that it is about, or take an experiment that informs about all"
                raise spec.complain("not-positive-definite", message, hint=hint, key=key) from None
        return embedded(spec, names, matrix, listed, key)

    def _of_model_file(self, source: str, key: str) -> Array:
        """Return the covariance (k, k) of an estimate of this plant; `SpecError` (`wrong-estimate`)."""
        found = load_estimate(self.spec, source, key)
        covariance = np.array(found.covariance, dtype=float)
        full = embedded(self.spec, self.nominal.names, covariance, tuple(found.parameters), key)
        apart = zip(self.nominal.names, self.nominal.theta, _AWAY * np.sqrt(np.diag(full)), strict=True)
        both = ", ".join(
            f"{name} is {found.parameters[name]:.4g} there and {nominal:.4g} here"
            for name, nominal, most_apart in apart
            if name in found.parameters and abs(found.parameters[name] - nominal) > most_apart
        )
        if both:
            message = f"{source} is an estimate of another plant: {both}, over {_AWAY:g} deviations apart"
            hint = f"take plant and noise from the same file: include: {source}"
            raise self.spec.complain("wrong-estimate", message, hint=hint, key=key)
        return full

    def region(self, confidence: float) -> Knowledge:
        """Return the region of the draws: the ellipsoid of a confidence, or the box of all intervals."""
        known = self.spread
        if known.box:
            return replace(known, columns=known.columns[:, np.any(known.columns != 0.0, axis=0)])
        return replace(known, columns=confidence_factor(confidence, known.columns.shape[1]) * known.columns)

    def moved(self, values: Mapping[str, float], key: str) -> Array:
        """Return the nominal parameters (k,) with other values; `SpecError` (`unknown-parameter`)."""
        theta = self.nominal.theta.copy()
        for name, value in values.items():
            theta[self._row(name, key)] = value
        return theta

    @cached_property
    def _radius(self) -> float:
        return farthest_radius(self.spec, self.experiment)

    def at(self, theta: Array, radius: float, *, distinct: bool = False) -> Alternative:
        """Return the plant with these parameters, and the requirements on the design there.

        If `distinct`, some excitation has to distinguish its parameters.

        Raises `_NoPlantError`: they give no plant of this structure, or a pole of it, or of its loop, lies
        beyond the radius. Or `SpecError`: a requirement cannot be asked of this plant.
        """
        model, loop = self._sound(theta, radius)
        spec, where = self.spec, f"at the scenario {self._named(theta)}"
        longest = spec.experiment.samples * (1.0 if spec.plant.sampled else spec.sample_time)
        limited = "samples" in spec.experiment.model_fields_set
        if limited and longest <= model.memory > self.nominal.memory:
            message = f"{where} a dead time outlasts the experiment"
            hint = "take more samples, or state the uncertainty more tightly"
            raise spec.complain("delay-beyond-record", message, hint=hint, key=KEY)
        try:
            experiment = replace(self.experiment, model=model, loop=loop)
            check_effects(spec, experiment)
            experiment = on_finite_information(spec, experiment)
            if distinct:
                experiment.whitened(1.0)  # raises an error that names unidentifiable parameters
            return Alternative(experiment, *build_asked(spec, experiment, self.nominal))
        except SpecError as error:
            found = error.diagnostics[0]
            raise spec.complain(found.code, f"{where}: {found.message}", hint=found.hint, key=KEY) from error

    def _sound(self, theta: Array, radius: float) -> tuple[Model, Loop | None]:
        model, loop, controller = self.nominal.at(theta), None, self.spec.experiment.controller
        if model.flaw is not None:
            raise _NoPlantError("not-a-plant", model.flaw)
        # An entry acts if it is other than zero at some of a few frequencies.
        lo, hi = self.experiment.band
        w = lo + (hi - lo) * _PROBES
        before, after = (np.any(one.plant_at(w) != 0.0, axis=0) for one in (self.nominal, model))
        for output, input in np.argwhere(before & ~after)[:1] + 1:
            raise _NoPlantError("not-a-plant", f"output {output} does not depend on input {input}")
        if controller is not None:
            try:
                loop = system.build_loop(self.spec, model, controller)
            except SpecError as error:
                raise _NoPlantError("no-stable-plant", error.diagnostics[0].message) from error
        if not (loop or model).radius <= radius or (model.continuous and model.radius >= 1.0):
            what = f"{'the plant' if loop is None else 'the loop'} has a pole, or C a root"
            raise _NoPlantError("no-stable-plant", f"{what}, on or beyond the unit circle")
        return model, loop

    def _named(self, theta: Array) -> str:
        return ", ".join(f"{name} = {x:.4g}" for name, x in zip(self.nominal.names, theta, strict=True))

    def listed(self, scenarios: Sequence[Mapping[str, float]]) -> Batch:
        """Return the plants that the spec lists."""
        thetas, plants = [], []
        # A known integrator keeps its pole on the unit circle at every plant.
        farthest = max((self.experiment.loop or self.nominal).radius, 1.0 - _ON_CIRCLE)
        for number, values in enumerate(scenarios):
            key = f"{KEY}.scenarios[{number}]"
            thetas.append(self.moved(values, key))
            try:
                plants.append(self.at(thetas[-1], farthest, distinct=True))
            except _NoPlantError as error:
                code, what = error.args
                message = f"at the scenario {self._named(thetas[-1])} {what}"
                hint = "leave the scenario out, or mend its parameters"
                raise self.spec.complain(code, message, hint=hint, key=key) from error
        return Batch(np.array(thetas), tuple(plants), len(plants))

    def possible(self, theta: Array) -> Alternative | None:
        """Return the plant with these parameters; None if there is none, or it is unstable."""
        try:
            return self.at(theta, self._radius)
        except _NoPlantError:
            return None

    def batch(self, number: int, rng: np.random.Generator) -> Batch:
        """Draw sound plants; raises `SpecError` (`no-stable-plant`) if hardly any draw gives one."""
        radius, known, size = self._radius, self.spread, self.spread.columns.shape[1]
        thetas, plants = list[Array](), list[Alternative]()
        drawn, last = 0, ""
        while len(plants) < number:
            if drawn >= max(_TRIES * number, _LEAST_TRIES):
                few = f"only {len(plants)} of {drawn} plants drawn are sound"
                message = f"{few}, in their loop if there is one, with poles within {radius:.6g}{last}"
                hint = "the uncertainty reaches far beyond what is possible: state it more tightly"
                raise self.spec.complain("no-stable-plant", message, hint=hint, key=KEY)
            z = rng.uniform(-1.0, 1.0, size) if known.box else rng.standard_normal(size)
            theta, drawn = np.asarray(known.centre + known.columns @ z), drawn + 1
            try:
                plants.append(self.at(theta, radius))
                thetas.append(theta)
            except _NoPlantError as error:
                last = f"; at the last one, {self._named(theta)}, {error.args[1]}"
        return Batch(np.array(thetas), tuple(plants), drawn)


def build_plants(spec: Spec, experiment: Experiment, basis: Basis | None) -> Plants | None:
    """Return the scenarios of `uncertainty`; None without this section.

    The experiment is on the nominal plant; an excitation that is given has no basis. Raises `SpecError`:
    `no-stable-plant`, `not-a-plant`, `unstable-loop`, `unknown-parameter`, `wrong-shape`, `wrong-estimate`;
    a requirement cannot be asked of one of the plants. Or `DataError`: a record cannot be used.
    """
    stated = spec.uncertainty
    if stated is None:
        return None
    scenario = UncertainPlant(spec, stated, experiment)
    paid: Paid = stated.cost or ("mean" if spec.closed_loop else "nominal")
    names = experiment.model.names
    if isinstance(stated.scenarios, tuple):
        return Plants(scenario.listed(stated.scenarios), "scenarios", names, stated.r_adm, paid)
    # A given excitation has no unknowns. A risk then takes as many plants as with one unknown: all meet the
    # accuracy by chance with probability (1 - risk)^plants. A length, factor or cost counts as an unknown.
    unknowns: int | None = 1
    if basis is not None:
        others = spec.goal != "least_cost" or stated.cost == "worst"
        unknowns = None if basis.free else basis.size + int(others)
    number = stated.scenarios or _needed(spec, stated.risk, unknowns)
    batch = scenario.batch(number, np.random.default_rng([stated.seed, 0]))

    def afresh() -> Iterator[Batch]:
        rng = np.random.default_rng([stated.seed, 1])
        for begun in range(0, stated.fresh, _AT_A_TIME):
            yield scenario.batch(min(_AT_A_TIME, stated.fresh - begun), rng)

    region = None
    if stated.worst_case is not None:
        found = scenario.region(stated.worst_case)
        name = "the intervals" if found.box else f"the ellipsoid of confidence {stated.worst_case:g}"
        region = Region(found.centre, found.columns, found.box, name, scenario.possible)
    return Plants(
        batch,
        stated.stated(*SOURCES)[0],
        names,
        stated.r_adm,
        paid,
        discard=int(stated.discard * number),
        afresh=afresh if stated.fresh else None,
        fresh=stated.fresh,
        at=scenario.possible,
        unknowns=unknowns,
        region=region,
    )


def _needed(spec: Spec, risk: float | None, unknowns: int | None) -> int:
    """Return the number of scenarios for a risk; `SpecError` (`not-supported`, `too-large`)."""
    if risk is None:
        return _DEFAULT_SCENARIOS
    if unknowns is None:
        message = "how many plants a risk takes depends on the number of unknowns: a free spectrum has none"
        hint = "write scenarios: 200 in place of risk, or choose spectrum: {type: fir}"
        raise spec.complain("not-supported", message, hint=hint, key=f"{KEY}.risk")
    needed, largest = samples_for(risk, 1.0 - CONFIDENCE, unknowns), most("uncertainty.scenarios")
    if needed > largest:
        message = f"a risk of {risk:g} with {unknowns} unknowns takes {needed} plants, {largest} at most"
        hint = "allow more risk, or lower the order of the spectrum"
        raise spec.complain("too-large", message, hint=hint, key=f"{KEY}.risk")
    return needed


def farthest_radius(spec: Spec, experiment: Experiment) -> float:
    """Return the radius from which poles of plant or loop count as unstable.

    Raises `SpecError`: `unsuitable-key`, `no-stable-plant`.
    """
    nominal = experiment.model
    within = None if spec.uncertainty is None else spec.uncertainty.stable_within
    if nominal.continuous:
        if within is not None:
            message = "a radius is one of poles in z, and the plant is not sampled"
            hint = "remove stable_within: unstable plants are not drawn"
            raise spec.complain("unsuitable-key", message, hint=hint, key=f"{KEY}.stable_within")
        return 1.0
    own = (experiment.loop or nominal).radius
    if within is None:
        return max(_DEFAULT_RADIUS, 0.5 * (1.0 + own))
    if own > within:
        message = f"the nominal model itself has a pole, or a zero of its noise, at radius {own:.6g}"
        hint = f"write {0.5 * (1.0 + own):.6g}, or leave it out"
        raise spec.complain("no-stable-plant", message, hint=hint, key=f"{KEY}.stable_within")
    return within


def build_knowledge(spec: Spec, confidence: float = POSSIBLE) -> Knowledge | None:
    """Return the region of the plants that are possible; None if it is not stated, or plants are listed."""
    stated = spec.uncertainty
    if stated is None or isinstance(stated.scenarios, tuple):
        return None
    return UncertainPlant(spec, stated, system.build_experiment(spec)).region(confidence)


def build_foreseen(spec: Spec, nominal: Model) -> Foreseen | None:
    """Return the plants that the design was made for; None without a stated region."""
    region = build_knowledge(spec, _DESIGNED)
    return None if region is None else Foreseen(region, np.flatnonzero(nominal.in_plant))


def build_nominal_covariance(spec: Spec, nominal: Model) -> Array:
    """Return the covariance (k, k) by `uncertainty`, or the block `estimate`; zero if the spec has none."""
    covariance = np.zeros((nominal.theta.size, nominal.theta.size))
    if spec.uncertainty is not None:
        plant = UncertainPlant(spec, spec.uncertainty, system.build_experiment(spec))
        theta, listed = plant.nominal.theta, plant.stated.scenarios
        if isinstance(listed, tuple):
            away = np.array([plant.moved(values, f"{KEY}.scenarios") for values in listed]) - theta
            moments = away.T @ away / len(listed)
        else:
            columns, off = plant.spread.columns, plant.spread.centre - theta
            # The variance of a uniform distribution is a third of its squared half width.
            moments = columns @ columns.T / (3.0 if plant.spread.box else 1.0) + np.outer(off, off)
        covariance[: len(moments), : len(moments)] = moments
    elif spec.estimate is not None:
        names, values = list(nominal.names), spec.estimate.parameters
        rows = [row for row, name in enumerate(values) if name in names]
        own = [names.index(name) for name in values if name in names]
        stated = np.array(spec.estimate.covariance, dtype=float)[np.ix_(rows, rows)]
        away = np.array(list(values.values()))[rows] - nominal.theta[own]
        if np.all(np.abs(away) <= _AWAY * np.sqrt(np.diag(stated))):
            covariance[np.ix_(own, own)] = stated
    return covariance


def build_foresight(spec: Spec, nominal: Experiment) -> Foresight | None:
    """Return the search for rival dead times of an experiment in raw parameters; None without dead times."""
    model = nominal.model
    late = np.flatnonzero(model.dead_times)
    if late.size == 0:
        return None
    names = ", ".join(f'"{name}"' if "[" in name else name for name in (model.names[i] for i in late))
    stated = spec.spectrum
    # Filtered noise has power between the lines of a multisine, where models with other dead times differ.
    denser = "" if stated is None or stated.type == "fir" else " (spectrum: {type: fir, order: 12})"
    return Foresight(
        units=build_units(spec),
        nominal=nominal,
        entries=unstated_errors(spec, nominal),
        earlier=build_earlier(spec, model),
        advice=f"excite more frequencies{denser}, or hold what is known (plant.known: [{names}])",
        knowledge=build_knowledge(spec),
        looks=spec.solver.any_spectrum,
    )


def build_simulation(spec: Spec, nominal: Experiment) -> Simulation:
    """Return the study of `simulate` without its excitation, for the nominal experiment with its prior.

    Raises `SpecError`: a loop that is unstable with the true plant.
    """
    study = spec.simulation or SimulationSection()
    return Simulation(
        units=build_units(spec),
        nominal=nominal,
        truth=_true_system(spec, nominal),
        relative_noise=None if study.noise is None else study.noise.relative_std,
        runs=study.runs,
        seed=study.seed,
        renewed=study.excitation == "new",
        compare=study.compare,
        cost=build_cost(spec),
        entries=unstated_errors(spec, nominal),
    )


def _true_system(spec: Spec, nominal: Experiment) -> Experiment | None:
    """Return the experiment on the system of `simulation`, or None; `SpecError` if its loop is unstable."""
    study = spec.simulation
    if study is None or (study.plant is None and study.noise is None):
        return None
    plant, noise = study.plant or spec.plant, spec.noise
    if study.noise is not None:
        stated = study.noise
        noise = Noise.model_construct(
            C=stated.C, D=stated.D, drift=stated.drift, known=stated.known, variance=stated.variance or 1.0
        )
    if plant.kind == "continuous" and spec.plant.kind == "polynomial":
        plant = held_plant(plant, spec.sample_time)
    model = build_model(spec.model_copy(update={"plant": plant, "noise": noise}))
    controller = spec.experiment.controller
    try:
        loop = None if controller is None else build_loop(spec, model, controller)
    except SpecError as error:
        found = error.diagnostics[0]
        message = f"with the true plant {found.message}"
        hint = "give a true plant that the controller stabilises as well"
        raise bad_spec(found.code, message, hint=hint, key="simulation.plant") from error
    return replace(nominal, model=model, loop=loop)
