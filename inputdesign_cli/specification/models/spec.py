"""The spec as a whole: the frozen object that questions are built from."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import ClassVar, Literal, TypeVar

from pydantic import Field, PrivateAttr

from inputdesign_cli.errors import IdesignError, Location, SpecError, bad_spec
from inputdesign_cli.specification.models.accuracy import Accuracy
from inputdesign_cli.specification.models.experiment import (
    Campaign,
    Channels,
    Cost,
    Estimated,
    Experiment,
    Noise,
)
from inputdesign_cli.specification.models.fields import Positive, Text
from inputdesign_cli.specification.models.limits import Limits
from inputdesign_cli.specification.models.plant import Plant
from inputdesign_cli.specification.models.realisation import Figures, Report, Signal, Simulation, Solver
from inputdesign_cli.specification.models.section import Section, optional
from inputdesign_cli.specification.models.spectrum import Given, Spectrum
from inputdesign_cli.specification.models.sweep import Sweep
from inputdesign_cli.specification.models.uncertainty import Uncertainty
from inputdesign_cli.specification.yaml.overrides import replace_values
from inputdesign_cli.specification.yaml.places import parse_key
from inputdesign_cli.specification.yaml.plain import fingerprint, plain, to_yaml
from inputdesign_cli.specification.yaml.reader import Tree

Objective = Literal["least_cost", "best_accuracy", "shortest_experiment"]

_Error = TypeVar("_Error", bound=IdesignError)


OF_DESIGNS = (
    *("accuracy", "campaign", "cost", "limits", "objective"),
    *("simulation", "spectrum", "sweep", "uncertainty"),
)
"""Keys of a design: a spec for an estimate alone has none of them."""


class Spec(Section):
    """An experiment to be designed: the checked contents of a spec file, with defaults filled in.

    Frequencies are in rad per `time_unit`, times in `time_unit`. `load_spec` and `parse_spec` make one;
    it remembers where each key was written, so that later diagnostics can point at the line.
    """

    title: Text = Field(default="", description="What this experiment is about.")
    sample_time: Positive = Field(default=1.0, description="Sampling interval in time_unit (default 1).")
    time_unit: Literal["s", "ms", "us", "min", "h", "d"] = Field(
        default="s", description="Unit of time; frequencies are in rad per this unit (default s)."
    )
    plant: Plant = Field(
        description="Nominal plant: polynomials A, B, F; continuous; or regression.",
        examples=[{"B": [0, 3.6], "F": [1, -0.7]}],
    )
    noise: Noise = Field(
        description="Noise on the output: variance, and polynomials C and D.", examples=[{"variance": 1.0}]
    )
    channels: Channels | None = Field(
        default=None,
        min_length=1,
        description="What inputs u1, u2, .. and outputs y1, y2, .. are called, and their units.",
        examples=[{"u1": {"name": "valve", "unit": "%"}, "y1": {"name": "temperature", "unit": "degC"}}],
    )
    experiment: Experiment = Field(default=Experiment(), description="Samples, controller, prior.")
    estimate: Estimated | None = optional(
        "The estimate of plant and noise by identify, with its covariance: for experiment.prior."
    )
    cost: Cost = Field(
        default=Cost(input_power=1.0),
        description="Weights of the powers (default: input_power; in a loop output_power as well).",
    )
    accuracy: Accuracy = Field(default_factory=Accuracy, description="What the model must reach.")
    objective: Objective | None = optional("least_cost, best_accuracy or shortest_experiment.")
    limits: Limits = Field(default=Limits(), description="What the experiment may not exceed.")
    spectrum: Spectrum | None = optional("Family of the input spectrum, or a given excitation.")
    uncertainty: Uncertainty | None = optional("How well the plant is known, for a robust design.")
    campaign: Campaign | None = optional("The experiment goes in parts, each planned with the data so far.")
    signal: Signal = Field(default=Signal(), description="The time series that realises the spectrum.")
    solver: Solver = Field(default=Solver(), description="How the optimum is found.")
    simulation: Simulation | None = optional("Monte Carlo study on the true system.")
    report: Report = Field(default=Report(), description="What the figures show.")
    figures: Figures = Field(default=Figures(), description="Width and format of the figures of a run.")
    sweep: Sweep | None = optional("What `idesign sweep` varies.")

    phrase: ClassVar[str] = "a spec"

    _source: Tree = PrivateAttr(default_factory=Tree)
    _design: bool = PrivateAttr(default=True)

    # Checks the tree of a whole spec; `specification.loading`, which needs this class, sets it.
    build: ClassVar[Callable[[Tree, bool | None], Spec]]

    @classmethod
    def from_dict(
        cls, data: Mapping[str, object], *, folder: Path | None = None, design: bool | None = True
    ) -> Spec:
        """Return the spec of plain data: mappings, lists, arrays, numbers and texts, as a file holds them.

        Paths in it are relative to `folder`, by default the current one. With `design` it must ask for a
        design, or for an analysis, that can be answered. Raises `SpecError`: everything that is wrong with
        it.
        """
        if folder is not None and not isinstance(folder, Path):
            raise bad_spec("bad-argument", "folder must be a pathlib.Path", hint="Path(..)", key="folder")
        return cls.build(Tree(plain(data), folder=folder or Path()), design)

    def with_(self, **changes: object) -> Spec:
        """Return the spec with other values: `spec.with_(**{"experiment.samples": 600})`; None removes a key.

        Raises `SpecError`: everything that is wrong with the new one.
        """
        return self.revised(changes)

    def revised(
        self, changes: Mapping[str, object], *, file: str = "<spec>", design: bool | None = None
    ) -> Spec:
        """Return the spec with other values at dotted keys, as `with_`; diagnostics about them name a `file`.

        `design` is as for `from_dict`, by default that of this spec.
        """
        for key in changes:
            if "=" in key:
                raise bad_spec("bad-argument", f"{key!r} is no key", hint="no key has =", key=key)
        tree = Tree(copy.deepcopy(self.content), self._source.places.copy(), self._source.folder)
        replace_values(tree, {key: plain(value, key) for key, value in changes.items()}, file)
        return type(self).build(tree, self._design if design is None else design)

    @property
    def goal(self) -> Objective:
        """Return the objective, or the one that follows from the rest when it is not given."""
        if self.objective is not None:
            return self.objective
        return "best_accuracy" if self.accuracy.goals else "least_cost"

    @property
    def closed_loop(self) -> bool:
        """Return whether the experiment runs under a controller."""
        return self.experiment.controller is not None

    @property
    def asks_for_design(self) -> bool:
        """Return whether the spec was read for a design or an analysis; otherwise it is for `identify`."""
        return self._design

    @property
    def given(self) -> Given | None:
        """Return the excitation that is given, if none is to be designed."""
        spectrum = self.spectrum
        return spectrum.given if spectrum is not None and spectrum.type == "given" else None

    @property
    def designs(self) -> bool:
        """Return whether an excitation is to be designed (not given)."""
        return self.given is None

    @property
    def signal_samples(self) -> int:
        """Return the length of the signal: signal.samples, or else experiment.samples."""
        return self.signal.samples or self.experiment.samples

    @property
    def nyquist(self) -> float:
        """Return the largest frequency: pi/sample_time in rad per time unit; infinite in continuous time."""
        return math.pi / self.sample_time if self.plant.sampled else math.inf

    def clip_band(self, band: tuple[float, float] | None) -> tuple[float, float]:
        """Return the band, or all frequencies, within [0, nyquist] per time unit: 3.1416 stands for pi."""
        low, high = band or (0.0, math.inf)
        return low, min(high, self.nyquist)

    @property
    def sha256(self) -> str:
        """Return the hash of the contents, overrides applied; comments, layout and order do not count."""
        return fingerprint(self.content)

    def to_yaml(self) -> str:
        """Return the keys that the user gave, overrides applied, as YAML that `parse_spec` reads back."""
        return to_yaml(self.content)

    def locate(self, key: str) -> Location | None:
        """Return where a key (`plant.F`, `plant.B[1]`) is written, or its deepest ancestor that is."""
        return self._source.places.at(parse_key(key))

    def resolve_path(self, name: str) -> Path:
        """Return the path of a file that the spec names: relative names start in the folder of the spec."""
        return self._source.folder / name

    def complain(self, code: str, message: str, *, hint: str = "", key: str = "") -> SpecError:
        """Return an error with a single diagnostic that points at the line of `key`."""
        return SpecError.because(code, message, hint, key, self.locate(key))

    def place(self, error: _Error) -> _Error:
        """Return an error of the same type whose diagnostics point at the lines of their keys."""
        found = [
            one if one.location or not one.key else replace(one, location=self.locate(one.key))
            for one in error.diagnostics
        ]
        placed = type(error)(found)
        placed.__cause__ = error.__cause__
        return placed

    @property
    def content(self) -> dict[str, object]:
        """Return the contents as the user wrote them, overrides applied, as plain data."""
        return self._source.data or self.model_dump(mode="json", exclude_none=True, exclude_unset=True)
