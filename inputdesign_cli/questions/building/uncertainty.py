"""Spec -> the plants that the true one might be, each with the requirements on the design there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cost import Paid
from inputdesign_cli.design.convex.question import Alternative
from inputdesign_cli.design.convex.scenario_theory import samples_for
from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import Loop, Model
from inputdesign_cli.questions.building.demand import check_effects
from inputdesign_cli.questions.building.integrators import on_finite_information
from inputdesign_cli.questions.building.knowledge import KEY, UncertainPlant
from inputdesign_cli.questions.building.requirements import build_asked
from inputdesign_cli.questions.building.system import build_loop
from inputdesign_cli.questions.common.robust import CONFIDENCE, Batch, Plants, Region
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.sizes import most
from inputdesign_cli.specification.models.uncertainty import SOURCES
from inputdesign_cli.spectrum import Basis

_DEFAULT_SCENARIOS, _DEFAULT_RADIUS = 100, 0.998
# The most draws for each plant that is asked for, and the most at least.
_TRIES, _LEAST_TRIES = 20, 500
# Fresh plants between two checks of the time limit.
_AT_A_TIME = 50
_ON_CIRCLE = 1e-9
# Frequencies at which an entry of G is evaluated, in shares of the band.
_PROBES = np.array([0.31, 0.57, 0.83])


def build_plants(spec: Spec, experiment: Experiment, basis: Basis | None) -> Plants | None:
    """Return the scenarios of `uncertainty`; None without this section.

    Args:
        experiment: on the nominal plant, of the length that the question is about.
        basis: of the design; None of an excitation that is given.

    Raises:
        SpecError: `no-stable-plant`, `not-a-plant`, `unstable-loop`, `unknown-parameter`, `wrong-shape`,
            `wrong-estimate`; a requirement cannot be asked of one of the plants.
        DataError: a record cannot be used.
    """
    stated = spec.uncertainty
    if stated is None:
        return None
    scenario = _Scenarios(spec, stated, experiment)
    paid: Paid = stated.cost or ("mean" if spec.closed_loop else "nominal")
    names = experiment.model.names
    if isinstance(stated.scenarios, tuple):
        return Plants(scenario.listed(stated.scenarios), "scenarios", names, stated.r_adm, paid)
    number = stated.scenarios or _needed(spec, basis) or _DEFAULT_SCENARIOS
    batch = scenario.batch(number, np.random.default_rng([stated.seed, 0]))

    def afresh() -> Iterator[Batch]:
        rng = np.random.default_rng([stated.seed, 1])
        for begun in range(0, stated.fresh, _AT_A_TIME):
            yield scenario.batch(min(_AT_A_TIME, stated.fresh - begun), rng)

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
        unknowns=None if basis is not None and basis.free else _unknowns(spec, basis),
        region=None if stated.worst_case is None else scenario.worst_region(stated.worst_case),
    )


def _needed(spec: Spec, basis: Basis | None) -> int | None:
    """Return the number of scenarios for the stated risk; None if no risk is stated."""
    stated = spec.uncertainty
    if stated is None or stated.risk is None:
        return None
    if basis is not None and basis.free:
        message = "how many plants a risk takes depends on the number of unknowns: a free spectrum has none"
        hint = "write scenarios: 200 in place of risk, or choose spectrum: {type: fir}"
        raise spec.complain("not-supported", message, hint=hint, key=f"{KEY}.risk")
    needed = samples_for(stated.risk, 1.0 - CONFIDENCE, _unknowns(spec, basis))
    if needed > most("uncertainty.scenarios"):
        takes = f"a risk of {stated.risk:g} with {_unknowns(spec, basis)} unknowns takes {needed} plants"
        message = f"{takes}, and at most {most('uncertainty.scenarios')} are taken"
        hint = "allow more risk, or lower the order of the spectrum"
        raise spec.complain("too-large", message, hint=hint, key=f"{KEY}.risk")
    return needed


def _unknowns(spec: Spec, basis: Basis | None) -> int:
    """Count the unknowns of the program: of the spectrum, and the factor, length or cost.

    A given excitation has no unknowns. The number of plants that prove a risk is then the number for one:
    (1 - risk)^plants is the probability that all of them meet the accuracy by chance.
    """
    if basis is None:
        return 1
    stated = spec.uncertainty
    return basis.size + int(spec.goal != "least_cost" or (stated is not None and stated.cost == "worst"))


def farthest_radius(spec: Spec, experiment: Experiment) -> float:
    """Return the radius beyond which poles of the plant, or of its loop, count as unstable.

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


class _NoPlantError(Exception):
    """Parameters give no stable plant; with the code of the error, and what is wrong."""

    def __init__(self, code: str, what: str) -> None:
        super().__init__(what)
        self.code, self.what = code, what


class _Scenarios(UncertainPlant):
    """Makes plants of parameters."""

    @cached_property
    def _radius(self) -> float:
        """The radius beyond which poles are too near to the unit circle, or outside."""
        return farthest_radius(self.spec, self.experiment)

    def at(self, theta: Array, radius: float) -> Alternative:
        """Return the plant with these parameters, and the requirements on the design there.

        Raises `_NoPlantError`: they give no plant of this structure, or a pole of it, or of its loop, lies
        beyond the radius. Or `SpecError`: a requirement cannot be asked of this plant.
        """
        model, loop = self._sound(theta, radius)
        self._check_seen(theta, model)
        try:
            experiment = replace(self.experiment, model=model, loop=loop)
            check_effects(self.spec, experiment)
            experiment = on_finite_information(self.spec, experiment)
            return Alternative(experiment, *build_asked(self.spec, experiment, self.nominal))
        except SpecError as error:
            found = error.diagnostics[0]
            raise self.spec.complain(
                found.code, f"at the scenario {self._named(theta)}: {found.message}", hint=found.hint, key=KEY
            ) from error

    def _sound(self, theta: Array, radius: float) -> tuple[Model, Loop | None]:
        model, controller = self.nominal.at(theta), self.spec.experiment.controller
        flaw = model.flaw
        if flaw is not None:
            raise _NoPlantError("not-a-plant", flaw)
        lost = self._act & ~self._acting(model)
        if np.any(lost):
            output, input = np.argwhere(lost)[0] + 1
            raise _NoPlantError("not-a-plant", f"output {output} does not depend on input {input}")
        loop = None
        if controller is not None:
            try:
                loop = build_loop(self.spec, model, controller)
            except SpecError as error:
                raise _NoPlantError("no-stable-plant", error.diagnostics[0].message) from error
        if not (loop or model).radius <= radius or (model.continuous and model.radius >= 1.0):
            what = "the plant" if loop is None else "the loop"
            raise _NoPlantError(
                "no-stable-plant", f"{what} has a pole, or C a root, on or beyond the unit circle"
            )
        return model, loop

    @cached_property
    def _act(self) -> NDArray[np.bool_]:
        """Which entries (p, r) of the nominal G are not zero."""
        return self._acting(self.nominal)

    def _acting(self, model: Model) -> NDArray[np.bool_]:
        """Which entries (p, r) of G are not zero at some of a few frequencies."""
        lo, hi = self.experiment.band
        return np.any(model.plant_at(lo + (hi - lo) * _PROBES) != 0.0, axis=0)

    def _check_seen(self, theta: Array, model: Model) -> None:
        """Raise `delay-beyond-record` if a dead time outlasts the experiment."""
        spec = self.spec
        if "samples" not in spec.experiment.model_fields_set:
            return
        longest = spec.experiment.samples * (1.0 if spec.plant.sampled else spec.sample_time)
        if longest <= model.memory > self.nominal.memory:
            message = f"at the scenario {self._named(theta)} a dead time outlasts the experiment"
            hint = "take more samples, or state the uncertainty more tightly"
            raise spec.complain("delay-beyond-record", message, hint=hint, key=KEY)

    def _named(self, theta: Array) -> str:
        return ", ".join(f"{name} = {x:.4g}" for name, x in zip(self.nominal.names, theta, strict=True))

    def listed(self, scenarios: Sequence[Mapping[str, float]]) -> Batch:
        """Return the plants that the spec lists."""
        thetas, plants = [], []
        # A known integrator is one at every plant.
        farthest = max((self.experiment.loop or self.nominal).radius, 1.0 - _ON_CIRCLE)
        for number, values in enumerate(scenarios):
            key = f"{KEY}.scenarios[{number}]"
            theta = self.moved(values, key)
            try:
                plants.append(self.at(theta, farthest))
            except _NoPlantError as error:
                message = f"at the scenario {self._named(theta)} {error.what}"
                hint = "leave the scenario out, or mend its parameters"
                raise self.spec.complain(error.code, message, hint=hint, key=key) from error
            thetas.append(theta)
        return Batch(np.array(thetas), tuple(plants), len(plants))

    def worst_region(self, confidence: float) -> Region:
        """Return the region of this confidence in which the worst plant is searched."""
        found = self.region(confidence)
        name = "the intervals" if found.box else f"the ellipsoid of confidence {confidence:g}"
        return Region(found.centre, found.columns, found.box, name, self.possible)

    def possible(self, theta: Array) -> Alternative | None:
        """Return the plant with these parameters; None if there is none, or it is unstable."""
        try:
            return self.at(theta, self._radius)
        except _NoPlantError:
            return None

    def batch(self, number: int, rng: np.random.Generator) -> Batch:
        """Draw a number of plants; draws that give no stable plant are repeated.

        Raises `SpecError`: `no-stable-plant` if hardly any draw gives one.
        """
        radius, thetas, plants = self._radius, list[Array](), list[Alternative]()
        most_draws, drawn, last = max(_TRIES * number, _LEAST_TRIES), 0, ""
        while len(plants) < number:
            if drawn >= most_draws:
                what = "loops" if self.spec.closed_loop else "plants"
                raise self.spec.complain(
                    "no-stable-plant",
                    f"only {len(plants)} of {drawn} {what} drawn have all their poles within {radius:.6g}, "
                    f"and dead times, gains and expressions that a plant can have{last}",
                    hint="the uncertainty reaches far beyond what is possible: state it more tightly",
                    key=KEY,
                )
            theta, drawn = self.draw(rng), drawn + 1
            try:
                plants.append(self.at(theta, radius))
            except _NoPlantError as error:
                last = f"; at the last one, {self._named(theta)}, {error.what}"
                continue
            thetas.append(theta)
        return Batch(np.array(thetas), tuple(plants), drawn)
