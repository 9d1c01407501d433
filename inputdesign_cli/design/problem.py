"""The one sentence that every convex design here is an instance of.

minimise a linear cost of the spectrum x, subject to x in the cone of spectra and
M(x) = M0 + sum_i x_i M_i meeting every requirement.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Requirement, Violation, worst
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant import graded_grid
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spectrum import Basis, Functional

RequirementFactory = Callable[[Experiment], Requirement]


@dataclass(frozen=True)
class Problem:
    """A least-cost design.

    `cost` weighs the powers of input, output and excitation (least-costly paper, (18)).
    `requirements` are made for the coordinates of `experiment`. `finer` is the same problem for a
    larger basis, of whose integrals those of this basis are the head.
    """

    experiment: Experiment
    basis: Basis
    cost: Mapping[PowerKind, float]
    requirements: tuple[Requirement, ...]
    finer: Problem | None = None

    def coarsened(self, basis: Basis) -> Problem:
        """The same problem for a smaller basis of the same family (see `Basis.coarser`)."""
        return replace(self, basis=basis, finer=self)

    @cached_property
    def information_map(self) -> NDArray[np.float64]:
        """(size, k, k): M_i, the information of each basis function."""
        if self.finer is not None:
            return self.finer.information_map[: self.basis.size]
        return self.basis.integrals(self.experiment.information_density, self.experiment.singularities)

    @property
    def baseline_information(self) -> Array:
        """(k, k): M0, what is known without excitation."""
        return self.experiment.baseline_information

    def information(self, x: Array) -> Array:
        """(k, k): M(x)."""
        return self.baseline_information + np.tensordot(x, self.information_map, axes=1)

    @cached_property
    def price(self) -> Functional:
        """The cost as a functional of the spectrum."""
        if self.finer is not None:
            return Functional(self.finer.price.vector[: self.basis.size], self.finer.price.density)
        parts = [self.power(kind) * weight for kind, weight in self.cost.items() if weight > 0]
        total = parts[0]
        for part in parts[1:]:
            total = total + part
        return total

    def power(self, kind: PowerKind) -> Functional:
        """The power of input, output or excitation as a functional of the spectrum."""

        def density(w: Array) -> Array:
            return self.experiment.power_density(kind, w)

        return Functional(self.basis.integrals(density, self.experiment.singularities), density)

    def value(self, weight: Array) -> Functional:
        """tr(Y (M(x) - M0)) for a fixed Y = `weight` (k, k) as a functional of the spectrum."""
        experiment = self.experiment
        scale = experiment.samples / experiment.model.variance

        def density(w: Array) -> Array:
            F = experiment.excitation_gradient(w)
            return scale * np.einsum("ni,ij,nj->n", F.conj(), weight, F, optimize=True).real

        return Functional(np.tensordot(self.information_map, weight, axes=2), density)

    @cached_property
    def grid(self) -> Array:
        """Frequencies (rad/sample) that see every resonance of the excitation's densities."""
        return graded_grid(self.experiment.singularities, 0.0, np.pi)

    def violations(self, information: Array, *, above: float = -np.inf) -> list[tuple[int, Violation]]:
        """All local maxima of all requirements' ratios, each with the index of its requirement."""
        return [
            (index, violation)
            for index, requirement in enumerate(self.requirements)
            for violation in requirement.violations(information, above=above)
        ]

    def worst_ratio(self, information: Array) -> Violation:
        """The worst violation of all requirements."""
        return worst([violation for _, violation in self.violations(information)])
