"""Spec -> the plants that the true one might be, each with what is required of the design there."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.design.convex.question import Alternative
from inputdesign_cli.design.convex.scenario_theory import samples_for
from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.specification import Spec, load_estimate
from inputdesign_cli.specification.models.sizes import most
from inputdesign_cli.specification.models.uncertainty import SOURCES, Uncertainty
from inputdesign_cli.spectrum import Basis
from inputdesign_cli.tasks.build.parameters import check_known, embedded
from inputdesign_cli.tasks.build.prior import inverse
from inputdesign_cli.tasks.build.requirements import build_asked
from inputdesign_cli.tasks.build.system import build_loop, read_excitation_record, record_step
from inputdesign_cli.tasks.robust import CONFIDENCE, Batch, Plants

_KEY = "uncertainty"
_DEFAULT_SCENARIOS, _DEFAULT_RADIUS = 100, 0.998
# So many draws for each plant that is asked for, and no fewer than so many.
_TRIES, _LEAST_TRIES = 20, 500
_AWAY = 3.0  # standard deviations

Draw = Callable[[np.random.Generator], Array]


def build_plants(spec: Spec, experiment: Experiment, basis: Basis) -> Plants | None:
    """The scenarios of `uncertainty`; None without one.

    Args:
        experiment: on the nominal plant, of the length that the question is about.

    Raises:
        SpecError: `no-stable-plant`, `unstable-loop`, `unknown-parameter`, `wrong-shape`, `wrong-estimate`;
            what is wrong with a requirement at one of the plants.
        DataError: a record cannot be used.
    """
    stated = spec.uncertainty
    if stated is None:
        return None
    scenario = _Scenarios(spec, stated, experiment)
    mean_cost = spec.closed_loop if stated.cost is None else stated.cost == "mean"
    names = experiment.model.names
    if isinstance(stated.scenarios, tuple):
        return Plants(scenario.listed(stated.scenarios), "scenarios", names, stated.r_adm, mean_cost)
    number = stated.scenarios or _needed(spec, basis) or _DEFAULT_SCENARIOS
    draw = scenario.drawing()
    batch = scenario.batch(draw, number, np.random.default_rng([stated.seed, 0]))

    def afresh() -> Batch:
        return scenario.batch(draw, stated.fresh, np.random.default_rng([stated.seed, 1]))

    return Plants(
        batch,
        stated.stated(*SOURCES)[0],
        names,
        stated.r_adm,
        mean_cost,
        discard=int(stated.discard * number),
        afresh=afresh if stated.fresh else None,
        unknowns=None if basis.free else _unknowns(spec, basis),
    )


def _needed(spec: Spec, basis: Basis) -> int | None:
    """How many scenarios the stated risk takes; None where no risk is stated."""
    stated = spec.uncertainty
    if stated is None or stated.risk is None:
        return None
    if basis.free:
        raise spec.complain(
            "not-supported",
            "how many plants a risk takes depends on the number of unknowns, and a free spectrum has none",
            hint="write scenarios: 200 in place of risk, or choose spectrum: {type: fir}",
            key=f"{_KEY}.risk",
        )
    needed = samples_for(stated.risk, 1.0 - CONFIDENCE, _unknowns(spec, basis))
    if needed > most("uncertainty.scenarios"):
        raise spec.complain(
            "too-large",
            f"a risk of {stated.risk:g} with {_unknowns(spec, basis)} unknowns takes {needed} plants, and at "
            f"most {most('uncertainty.scenarios')} are taken",
            hint="allow more risk, or lower the order of the spectrum",
            key=f"{_KEY}.risk",
        )
    return needed


def _unknowns(spec: Spec, basis: Basis) -> int:
    """Of the program: those of the spectrum, and the factor or the length where that is sought."""
    return basis.size + int(spec.goal != "least_cost")


@dataclass(frozen=True)
class _Scenarios:
    """What makes plants out of parameters."""

    spec: Spec
    stated: Uncertainty
    experiment: Experiment

    @property
    def _nominal(self) -> Model:
        return self.experiment.model

    @property
    def _radius(self) -> float:
        """Beyond this radius poles are too near to the unit circle, or outside."""
        if self._nominal.continuous:
            if self.stated.stable_within is not None:
                raise self.spec.complain(
                    "unsuitable-key",
                    "a radius is one of poles in z, and the plant is not sampled",
                    hint="remove stable_within: unstable plants are not drawn",
                    key=f"{_KEY}.stable_within",
                )
            return 1.0
        own = (self.experiment.loop or self._nominal).radius
        if self.stated.stable_within is None:
            return max(_DEFAULT_RADIUS, 0.5 * (1.0 + own))
        if own > self.stated.stable_within:
            raise self.spec.complain(
                "no-stable-plant",
                f"the nominal plant itself has a pole at radius {own:.6g}",
                hint=f"write {0.5 * (1.0 + own):.6g}, or leave it out",
                key=f"{_KEY}.stable_within",
            )
        return self.stated.stable_within

    def at(self, theta: Array, radius: float) -> Alternative | None:
        """The plant with these parameters; None where it, or its loop, has poles beyond the radius."""
        model, controller, loop = self._nominal.at(theta), self.spec.experiment.controller, None
        if controller is not None:
            try:
                loop = build_loop(self.spec, model, controller)
            except SpecError:
                return None
        if not (loop or model).radius <= radius or (model.continuous and model.radius >= 1.0):
            return None
        self._check_seen(theta, model)
        experiment = replace(self.experiment, model=model, loop=loop)
        try:
            return Alternative(experiment, *build_asked(self.spec, experiment, self._nominal))
        except SpecError as error:
            found = error.diagnostics[0]
            raise self.spec.complain(
                found.code,
                f"at the scenario {self._named(theta)}: {found.message}",
                hint=found.hint,
                key=_KEY,
            ) from error

    def _check_seen(self, theta: Array, model: Model) -> None:
        """Raise `delay-beyond-record` where a dead time outlasts the experiment, as at the nominal plant."""
        spec = self.spec
        if "samples" not in spec.experiment.model_fields_set:
            return
        longest = spec.experiment.samples * (1.0 if spec.plant.sampled else spec.sample_time)
        if longest <= model.memory > self._nominal.memory:
            raise spec.complain(
                "delay-beyond-record",
                f"at the scenario {self._named(theta)} a dead time outlasts the experiment",
                hint="take more samples, or state the uncertainty more tightly",
                key=_KEY,
            )

    def _named(self, theta: Array) -> str:
        return ", ".join(f"{name} = {x:.4g}" for name, x in zip(self._nominal.names, theta, strict=True))

    def listed(self, scenarios: Sequence[Mapping[str, float]]) -> Batch:
        """The plants that the spec states one by one."""
        names, thetas, plants = list(self._nominal.names), [], []
        for number, values in enumerate(scenarios):
            key = f"{_KEY}.scenarios[{number}]"
            theta = self._nominal.theta.copy()
            for name, value in values.items():
                check_known(self.spec, names, name, key)
                theta[names.index(name)] = value
            plant = self.at(theta, 1.0)
            if plant is None:
                what = "the loop" if self.spec.closed_loop else "the plant"
                raise self.spec.complain(
                    "no-stable-plant",
                    f"{what} is unstable at the scenario {self._named(theta)}",
                    hint="leave the scenario out, or mend its parameters",
                    key=key,
                )
            thetas.append(theta)
            plants.append(plant)
        return Batch(np.array(thetas), tuple(plants), len(plants))

    def batch(self, draw: Draw, number: int, rng: np.random.Generator) -> Batch:
        """So many plants, drawn again where they are unstable.

        Raises:
            SpecError: `no-stable-plant` where next to none is stable.
        """
        radius, thetas, plants = self._radius, list[Array](), list[Alternative]()
        most_draws, drawn = max(_TRIES * number, _LEAST_TRIES), 0
        while len(plants) < number:
            if drawn >= most_draws:
                what = "loops" if self.spec.closed_loop else "plants"
                raise self.spec.complain(
                    "no-stable-plant",
                    f"only {len(plants)} of {drawn} {what} drawn have all their poles within {radius:.6g}",
                    hint="the uncertainty reaches far beyond what is stable: state it more tightly",
                    key=_KEY,
                )
            theta, drawn = draw(rng), drawn + 1
            plant = self.at(theta, radius)
            if plant is not None:
                thetas.append(theta)
                plants.append(plant)
        return Batch(np.array(thetas), tuple(plants), drawn)

    def drawing(self) -> Draw:
        """How parameters (k,) are drawn."""
        if self.stated.intervals is not None:
            return self._even(self.stated.intervals)
        covariance = self._covariance()
        varied = np.diag(covariance) > 0.0
        root = np.linalg.cholesky(covariance[np.ix_(varied, varied)])
        nominal = self._nominal.theta

        def draw(rng: np.random.Generator) -> Array:
            theta = nominal.copy()
            theta[varied] += root @ rng.standard_normal(len(root))
            return theta

        return draw

    def _even(self, intervals: Mapping[str, tuple[float, float]]) -> Draw:
        names, nominal = list(self._nominal.names), self._nominal.theta
        for name, (low, high) in intervals.items():
            key = f"{_KEY}.intervals.{name}"
            check_known(self.spec, names, name, key)
            value = nominal[names.index(name)]
            if not low <= value <= high:
                raise self.spec.complain(
                    "bad-interval",
                    f"{name} is {value:.6g} in the plant, outside of [{low:g}, {high:g}]",
                    hint="widen the interval, or move the plant into it",
                    key=key,
                )
        index = [names.index(name) for name in intervals]
        low, high = np.array(list(intervals.values())).T

        def draw(rng: np.random.Generator) -> Array:
            theta = nominal.copy()
            theta[index] = rng.uniform(low, high)
            return theta

        return draw

    def _covariance(self) -> Array:
        """(k, k), zero for parameters that are known."""
        stated, names = self.stated, self._nominal.names
        key = f"{_KEY}.{stated.stated(*SOURCES)[0]}"
        source = stated.covariance if stated.covariance is not None else stated.information
        if isinstance(source, str):
            if not source.endswith((".yaml", ".yml")):
                return self._inverted(self._of_record(source, key), key)
            found = load_estimate(self.spec, source, key)
            covariance, listed = np.array(found.covariance, dtype=float), tuple(found.parameters)
            full = embedded(self.spec, names, covariance, listed, key)
            self._check_same_plant(source, found.parameters, full, key)
            return full
        matrix = np.array(source, dtype=float)
        if stated.covariance is None:
            matrix = self._inverted(matrix, key)
        return embedded(self.spec, names, matrix, stated.parameters, key)

    def _of_record(self, name: str, key: str) -> Array:
        """(k, k): what the samples of an earlier excitation tell of the nominal plant."""
        record = read_excitation_record(self.spec, name, key)
        earlier = replace(self.experiment, samples=len(record), prior=None)
        return FiniteRecord(earlier, len(record), record_step(self.spec)).information(record)

    def _inverted(self, information: Array, key: str) -> Array:
        try:
            return inverse(information)
        except np.linalg.LinAlgError:
            raise self.spec.complain(
                "not-positive-definite",
                "the information matrix is singular: it says nothing about some of the parameters, so that "
                "no plants can be drawn",
                hint="name the parameters that it is about, or take an experiment that tells all apart",
                key=key,
            ) from None

    def _check_same_plant(self, name: str, values: Mapping[str, float], covariance: Array, key: str) -> None:
        """Raise `SpecError` (`wrong-estimate`) where the file is about another plant than the spec."""
        nominal = dict(zip(self._nominal.names, self._nominal.theta.tolist(), strict=True))
        deviation = dict(zip(self._nominal.names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        far = [p for p, x in values.items() if abs(x - nominal[p]) > _AWAY * deviation[p]]
        if far:
            told = ", ".join(f"{p} is {values[p]:.4g} there and {nominal[p]:.4g} here" for p in far)
            raise self.spec.complain(
                "wrong-estimate",
                f"{name} is an estimate of another plant: {told}, more than {_AWAY:g} standard deviations "
                "apart",
                hint="take plant and noise from the same file: include: " + name,
                key=key,
            )
