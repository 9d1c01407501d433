"""The effect of an excitation on a plant: prediction gradients, information per frequency, and powers.

The measure is (1 / 2 pi) dw over the circle (w in rad/sample) or the line (rad per time unit): the
power of a signal is the integral of its spectrum, its mean square. In continuous time the N samples of
the outputs are taken fast enough to see the whole band; each carries noise of the model's covariance.
Criteria do not depend on the measure, as long as powers and information share it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.errors import InaccurateError, bad_spec
from inputdesign_cli.information.quadrature import Quadrature, Values, band_quadrature, integrate
from inputdesign_cli.plant import Loop, Model
from inputdesign_cli.plant.frequencies import logarithmic_distance

_AT_ONCE = 2**13  # entries of gradients computed together, so that they stay in the cache of the processor
_INTEGRATES = 1e-9  # a pole with no more damping is an integrator
_ROUNDING = 1e-15  # gradients below this share of the largest of their output count as zero
_RANK_TOLERANCE = 1e-11
# A parameter takes part in a null space if its component reaches this share of the largest component.
_TAKES_PART = 0.05


@dataclass(frozen=True)
class WeightedProducts:
    """Holds the parameters (c,) that matter and F^T (n, r, c), by part of the frequencies and by output."""

    parts: list[list[tuple[NDArray[np.intp], ComplexArray]]]

    @classmethod
    def of(cls, gradient: Callable[[Array], ComplexArray], w: Array, size: int) -> WeightedProducts:
        """Build the products of F = `gradient` (n, k, p, r) at frequencies `w`; `size` is k p r."""
        step = max(_AT_ONCE // size, 1)
        parts = (w[start : start + step] for start in range(0, max(w.size, 1), step))
        return cls([_by_output(gradient(part)) for part in parts])

    def at(self, weight: Array) -> ComplexArray:
        """Return sum over outputs of F^* Y F, Y = `weight` (k, k) symmetric, (n, r, r)."""
        return np.concatenate([_summed(part, weight) for part in self.parts])


def _by_output(F: ComplexArray) -> list[tuple[NDArray[np.intp], ComplexArray]]:
    found: list[tuple[NDArray[np.intp], ComplexArray]] = []
    if F.shape[2] == 1:  # all parameters matter to the only output
        return [(np.arange(F.shape[1]), np.ascontiguousarray(F[:, :, 0].swapaxes(1, 2)))]
    for output in range(F.shape[2]):
        rows = F[:, :, output]
        size = np.abs(rows).max(axis=(0, 2), initial=0.0)
        used = np.flatnonzero(size > _ROUNDING * size.max(initial=0.0))
        found.append((used, np.ascontiguousarray(rows[:, used].swapaxes(1, 2))))
    return found


def _summed(outputs: list[tuple[NDArray[np.intp], ComplexArray]], weight: Array) -> ComplexArray:
    n, r, _ = outputs[0][1].shape
    total = np.zeros((n, r, r), dtype=complex)
    for used, rows in outputs:
        turned = rows @ (weight if used.size == len(weight) else weight[np.ix_(used, used)])
        if r == 1:
            total[:, 0, 0] += np.einsum("nk,nk->n", rows[:, 0].conj(), turned[:, 0])
        else:
            total += rows.conj() @ turned.swapaxes(1, 2)
    return total


PowerKind = Literal["input", "output", "excitation", "moves"]
POWER_KINDS: tuple[PowerKind, ...] = ("input", "output", "excitation")
"""The powers that results state; the power of the moves of u between samples is limited, but not stated."""
# An entry of a response up to this share of the largest entry is a zero with rounding.
_NEGLIGIBLE = 1e-13


@dataclass(frozen=True)
class Experiment:
    """N samples of a model with r inputs and p outputs, excited within `band`.

    The excitation x is u in open loop (`loop` None) and r in closed loop, u = r - C y.

    A density D over frequency stands for the functional (1 / 2 pi) integral of tr(D(w) Phi(w)) dw of
    the spectrum Phi of x. Its values are (n,) for one input, and Hermitian (n, r, r) for several.

    `prior` (k, k) is information already at hand, in raw parameters. `factor` L (k, k), lower triangular,
    sets the coordinates of every gradient and information matrix: gradients are L^-1 F and M = L M~ L^T. Raw
    parameters correspond to L = None; there the information matrix easily has a condition number of 1e12,
    which no solver survives.
    """

    model: Model
    samples: int
    band: tuple[float, float] = (0.0, np.pi)
    prior: Array | None = None
    factor: Array | None = None
    loop: Loop | None = None

    @cached_property
    def inputs(self) -> int:
        """Return the number of inputs r."""
        return self.model.inputs

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return poles of all densities below, as points frequency + j damping of the frequency plane."""
        return self._source.singularities

    @cached_property
    def evaluated(self) -> dict[tuple[object, ...], Array]:
        """Return a cache, empty at first, of the information of records, by their digests."""
        return {}

    @property
    def slowest(self) -> float:
        """Return the slowest time constant of plant or loop, in samples or time units; 0 without one.

        Integrators, and poles of the noise alone, do not count.
        """
        points = self.model.plant_points
        if self.loop is not None:
            points = logarithmic_distance(self.loop.closed_poles)
        damping = np.abs(points.imag)
        return float(np.max(1.0 / damping[damping > _INTEGRATES], initial=0.0))

    @property
    def memory(self) -> float:
        """Return how long signals act beyond the memory of the poles, in samples or time units."""
        return self._source.memory

    @property
    def _source(self) -> Model | Loop:
        return self.model if self.loop is None else self.loop

    @cached_property
    def noise_whitener(self) -> Array:
        """Return K (p, p) with K^T K the inverse of the noise covariance."""
        return np.asarray(np.linalg.inv(np.linalg.cholesky(self.model.covariance)), dtype=float)

    @cached_property
    def noise_colouring(self) -> Array:
        """Return the inverse (p, p) of `noise_whitener`."""
        return np.asarray(np.linalg.inv(self.noise_whitener), dtype=float)

    def excitation_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return F_x (n, k, p, r): the gradient of the prediction with respect to x, noise whitened to I.

        F_u = H^-1 dG in open loop. In closed loop the responses of y and u to x enter the prediction as well
        ([bombois-least-costly], below (4) and (15), for one channel).
        """
        if self.loop is not None:
            return self._whitened(self.loop.excitation_gradient(w), self.noise_whitener)
        u = np.eye(self.inputs, dtype=complex)[None]
        return self._whitened(self.model.prediction_gradient(w, None, u, None), self.noise_whitener)

    def disturbance_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the prediction gradient due to e, also around the loop, for raw parameters, (n, k, p, p)."""
        if self.loop is not None:
            return self.loop.noise_gradient(w)
        e = np.eye(self.model.outputs, dtype=complex)[None]
        return self.model.prediction_gradient(w, None, None, e)

    def noise_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the gradient for white e of covariance I, noise whitened to I, (n, k, p, p)."""
        gradient = self.disturbance_gradient(w)
        if self.model.outputs == 1:
            return self._whitened(gradient)
        return self._whitened(gradient, self.noise_whitener, self.noise_colouring)

    def _whitened(
        self, gradient: ComplexArray, left: Array | None = None, right: Array | None = None
    ) -> ComplexArray:
        """Return left G right of gradients G (n, k, p, r) for raw parameters, in these coordinates."""
        if left is not None:
            single = len(left) == 1
            gradient = left[0, 0] * gradient if single else np.einsum("pq,nkqr->nkpr", left, gradient)
        if right is not None:
            gradient = np.einsum("nkpq,qr->nkpr", gradient, right)
        if self.factor is None:
            return gradient
        if gradient.shape[2:] == (1, 1):
            return (self._inverse_factor @ gradient[:, :, 0, 0].T).T[:, :, None, None]
        return np.tensordot(gradient, self._inverse_factor, axes=(1, 1)).transpose(0, 3, 1, 2)

    def information_density(self, w: ArrayLike) -> NDArray:
        """Return D (n, k, k) or (n, k, k, r, r): M = M0 + (1/2 pi) integral tr(D Phi) dw, all N samples.

        [mohan-spectral], (3), made Hermitian in the channels and symmetric in the parameters.
        """
        F = self.excitation_gradient(w)
        if F.shape[2:] == (1, 1):
            columns = F[:, :, 0, 0].T
            real, imaginary = np.ascontiguousarray(columns.real), np.ascontiguousarray(columns.imag)
            products = real[:, None] * real
            products += imaginary[:, None] * imaginary
            return self.samples * products.transpose(2, 0, 1)
        if self.inputs == 1:
            rows = np.concatenate([F[..., 0].real, F[..., 0].imag], axis=2)
            return self.samples * (rows @ rows.swapaxes(1, 2))
        half = np.einsum("nmpa,nlpb->nlmab", F.conj(), F, optimize=True)
        return (0.5 * self.samples) * (half + half.swapaxes(1, 2))

    def information_factor(self, w: ArrayLike) -> ComplexArray:
        """Return F (n, k, p, r) whose products F_l^* F_m are `information_density`."""
        return np.sqrt(self.samples) * self.excitation_gradient(w)

    def value_density(self, weight: Array, w: ArrayLike) -> NDArray:
        """Return the density of tr(Y (M - M0)), Y = `weight` (k, k) symmetric: (n,) or (n, r, r)."""
        return self.valued(self.products(np.atleast_1d(np.asarray(w, dtype=float))), weight)

    def products(self, w: Array) -> WeightedProducts:
        """Return the part of `value_density` that depends on the frequencies, not on the weight."""
        return WeightedProducts.of(self.excitation_gradient, w, self.size * self.model.outputs * self.inputs)

    def valued(self, products: WeightedProducts, weight: Array) -> NDArray:
        """Return `value_density` from products that were computed before."""
        return self.squeezed(self.samples * products.at(weight))

    def power_density(self, kind: PowerKind, w: ArrayLike, channel: int | None = None) -> NDArray:
        """Return D (n,) or (n, r, r): tr(D Phi) is the power of u_x, y_x, x or moves (one channel or all)."""
        if kind == "moves":
            moving = np.abs(self._moving(w)) ** 2
            density = self.power_density("input", w, channel)
            return density * moving.reshape(-1, *(1,) * (density.ndim - 1))
        if self.depends_on_plant(kind):
            rows = of_channel(self.response(kind, w), channel)
            return self.squeezed(np.einsum("npa,npb->nab", rows.conj(), rows))
        unit = np.eye(self.inputs) if channel is None else np.diag(np.eye(self.inputs)[channel])
        return self.squeezed(np.broadcast_to(unit, (np.size(w), *unit.shape)))

    def depends_on_plant(self, kind: PowerKind) -> bool:
        """Return whether a power depends on the plant, and so differs from the power of x."""
        return kind == "output" or (kind in ("input", "moves") and self.loop is not None)

    def response(self, kind: PowerKind, w: ArrayLike) -> ComplexArray:
        """Return the response to x of the outputs, inputs, their moves or x itself, (n, p or r, r)."""
        if kind == "moves":
            return self._moving(w)[:, None, None] * self.response("input", w)
        if not self.depends_on_plant(kind):
            return np.broadcast_to(np.eye(self.inputs, dtype=complex), (np.size(w), self.inputs, self.inputs))
        if self.loop is None:
            return self.model.plant_at(w)
        y, u = self.loop.excited(w)
        return y if kind == "output" else u

    def _moving(self, w: ArrayLike) -> ComplexArray:
        """Return 1 - q^-1 at the frequencies, for held samples, (n,)."""
        return np.asarray(1.0 - np.exp(-1j * np.atleast_1d(np.asarray(w, dtype=float))))

    def squeezed(self, density: NDArray) -> NDArray:
        """Return a density (n, r, r); for one input its values (n,)."""
        return density[:, 0, 0].real if self.inputs == 1 else density

    @cached_property
    def noise_information(self) -> Array:
        """Return the information (k, k) in N samples of noise alone, without excitation."""
        if not self.noise_informs:
            return np.zeros((self.size, self.size))
        found = information_of_noise(lambda w: self.noise_gradient(w)[:, None], self.singularities)
        return self.samples * found[0]

    @property
    def baseline_information(self) -> Array:
        """Return the information (k, k) without any excitation, by the noise and by `prior`."""
        return self.noise_information + self.prior_information

    def with_samples(self, samples: int) -> Experiment:
        """Return the experiment with this number of samples: itself, with its caches, if it has as many."""
        return self if samples == self.samples else replace(self, samples=samples)

    def of_length(self, information: Array, samples: int) -> Array:
        """Return M (k, k) of this many samples of the same excitation, from M of `self.samples`."""
        known = self.prior_information
        return known + samples / self.samples * (information - known)

    @cached_property
    def noise_informs(self) -> bool:
        """Return whether the noise alone has information on any parameter."""
        if self.model.continuous:
            return False
        return bool(np.any(self.disturbance_gradient(np.array([0.3, 1.1, 2.3]))))

    def whitened(self, power: float | Array) -> Experiment:
        """Return the experiment in coordinates where M = I by this power, flat over the band.

        Args:
            power: the total, shared evenly by the channels, or the powers (r,) of the channels.

        Raises:
            SpecError: `not-identifiable` when even that excitation does not identify all parameters.
        """
        return self.whitened_by(power, *self._at_flat_nodes)

    @cached_property
    def _at_flat_nodes(
        self,
    ) -> tuple[tuple[Quadrature, ComplexArray], tuple[Quadrature, ComplexArray | None]]:
        """Return the nodes of flat excitation and of the noise, with gradients of raw parameters."""
        raw, excited, around = replace(self, factor=None), *self.flat_rules(self.singularities)
        noise = raw.noise_gradient(around.nodes) if self.noise_informs else None
        return (excited, raw.excitation_gradient(excited.nodes)), (around, noise)

    def flat_rules(self, near: ComplexArray) -> tuple[Quadrature, Quadrature]:
        """Return nodes for flat excitation over the band, and for the noise, with these singularities."""
        return band_quadrature(near, self.band), band_quadrature(near, (0.0, np.pi))

    def whitened_by(
        self,
        power: float | Array,
        excited: tuple[Quadrature, ComplexArray],
        noise: tuple[Quadrature, ComplexArray | None],
    ) -> Experiment:
        """Return `whitened`, given the gradients of raw parameters at the nodes of the `flat_rules`.

        Args:
            excited: with `excitation_gradient`.
            noise: with `noise_gradient`, None if the noise alone has no information.
        """
        width = (self.band[1] - self.band[0]) / np.pi
        total = float(np.sum(power))
        shares = np.sqrt(np.asarray(power) * self.inputs / total) if np.ndim(power) else 1.0
        level = total * self.samples / (self.inputs * width)
        rule, gradient = excited
        rows = [_rows(gradient * shares, rule.weights * level)]
        around, disturbed = noise
        if disturbed is not None:
            rows.append(_rows(disturbed, around.weights * self.samples))
        if self.prior is not None:
            eigenvalues, vectors = np.linalg.eigh(self.prior)
            rows.append(np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * vectors.T)
        whole = not self.model.continuous and self.band == (0.0, np.pi)
        excitation = "excitation" if whole else "excitation within the band"
        return replace(self, factor=factor_of(np.concatenate(rows), self.model.names, excitation=excitation))

    @cached_property
    def size(self) -> int:
        """Return the number of parameters k."""
        return len(self.model.names)

    @cached_property
    def prior_information(self) -> Array:
        """Return `prior` in these coordinates, zero when there is none, (k, k)."""
        if self.prior is None:
            return np.zeros((self.size, self.size))
        return self.whiten_matrix(self.prior)

    def whiten_matrix(self, information: Array) -> Array:
        """Return an information matrix (k, k) of raw parameters in these coordinates."""
        return self.whiten_rows(self.whiten_rows(information).T)

    @property
    def from_raw(self) -> Array:
        """Return the matrix (k, k) from the gradient for raw parameters to these coordinates."""
        return np.eye(self.size) if self.factor is None else self._inverse_factor

    @cached_property
    def _inverse_factor(self) -> Array:
        inverse, _ = scipy.linalg.lapack.dtrtri(self.factor, lower=1)
        return np.asarray(inverse)

    def to_raw(self, information: Array) -> Array:
        """Return an information matrix of these coordinates in raw parameters."""
        if self.factor is None:
            return information
        return self.factor @ information @ self.factor.T

    def raw_covariance(self, information: Array) -> Array:
        """Return P = M^-1 in raw parameters, from an information matrix of these coordinates."""
        half = scipy.linalg.solve_triangular(np.linalg.cholesky(information), np.eye(self.size), lower=True)
        if self.factor is not None:
            half = scipy.linalg.solve_triangular(self.factor, half.T, lower=True, trans="T").T
        return half.T @ half

    def raw_steps(self, steps: Array) -> Array:
        """Return differences (n, k) of parameters in these coordinates as differences of raw parameters."""
        return steps if self.factor is None else steps @ self._inverse_factor

    def whiten_rows(self, rows: NDArray) -> NDArray:
        """Return gradients (n, k) of raw parameters in these coordinates."""
        if self.factor is None:
            return rows
        return rows @ self._inverse_factor.T

    def unexcited(self, directions: Array) -> str:
        """Return the names of the parameters in some `directions` (k, m) of these coordinates."""
        raw = directions if self.factor is None else self._inverse_factor.T @ directions
        size = np.abs(self.model.theta)
        return taking_part(self.model.names, raw / np.maximum(size, 1e-3 * size.max())[:, None])


def _rows(F: ComplexArray, weights: Array) -> NDArray[np.float64]:
    """Return sqrt(weight) F as real rows (2 n p r, k), for F (n, k, p, r)."""
    flat = F.transpose(0, 2, 3, 1) * np.sqrt(weights)[:, None, None, None]
    flat = flat.reshape(-1, F.shape[1])
    return np.concatenate([flat.real, flat.imag])


def of_channel(response: ComplexArray, channel: int | None) -> ComplexArray:
    """Return the response at one channel, (.., n, 1, r), without rounding errors; all for None.

    Entries that are negligible beside the largest of their matrix are set to zero.
    """
    if channel is None:
        return response
    row = response[..., channel : channel + 1, :]
    largest = np.abs(response).max(axis=(-3, -2, -1), keepdims=True, initial=0.0)
    return np.where(np.abs(row) > _NEGLIGIBLE * largest, row, 0.0)


def information_of_noise(gradients: Values, singularities: ComplexArray) -> NDArray[np.float64]:
    """Return the information (S, k, k) of a sample of each of S plants without any excitation.

    Args:
        gradients: (n, S, k, p, p) at frequencies (n,): the gradient for white e of covariance I.
        singularities: poles of all S plants, as points of the frequency plane.
    """

    def products(weights: NDArray, values: NDArray) -> NDArray:
        weighted = np.moveaxis(values, 0, -1) * np.sqrt(weights[:, 0])
        flat = weighted.reshape(*weighted.shape[:2], -1)
        rows = np.concatenate([flat.real, flat.imag], axis=2)
        return np.asarray(rows @ rows.swapaxes(1, 2))

    # Partial sums over a few hundred nodes lose less to rounding than one sum over all nodes.
    return integrate(gradients, None, singularities, sums=products, several=True)


def taking_part(names: Sequence[str], directions: Array) -> str:
    """Return the names of the parameters that take part in a space, for any vectors that span it.

    Args:
        names: names of the k parameters.
        directions: (k, m), independent columns.
    """
    share = np.linalg.norm(np.linalg.qr(directions)[0], axis=1)
    return ", ".join(name for name, own in zip(names, share, strict=True) if own > _TAKES_PART * share.max())


def factor_of(rows: NDArray[np.float64], names: Sequence[str], *, excitation: str) -> Array:
    """Return L (k, k), lower triangular, with rows^T rows = L L^T, by a QR factorisation.

    The matrix itself is never formed: that halves the digits lost to an ill-conditioned parametrisation.

    Args:
        rows: (number, k).
        excitation: its name in the diagnostic ("excitation", "excitation within [0, 2]").

    Raises:
        SpecError: `not-identifiable`, with the names of parameters that are not identifiable.
        InaccurateError: `numerically-singular`: other excitations could identify them, but next to resonances
            all else is lost to rounding.
    """
    factor, untold = triangular_factor(rows)
    if untold.size:
        size = np.linalg.norm(rows, axis=1)
        even = rows[size > 0.0] / size[size > 0.0, None]
        if len(even) and not triangular_factor(even)[1].size:
            raise InaccurateError.because(
                "numerically-singular",
                f"flat {excitation} does not distinguish these parameters in double precision: "
                f"{taking_part(names, untold)}",
                hint="nearly all its information stands next to a pole at the unit circle: leave those "
                "frequencies out, with limits.band and spectrum: {type: multisine, ..}",
                key="plant",
            )
        raise bad_spec(
            "not-identifiable",
            f"no {excitation} can distinguish these parameters: {taking_part(names, untold)}",
            hint="look for a factor that B and A (or B and F, C and D, A and C) have in common, or for an "
            "order too high, and take it out; or list in plant.known what is known of them",
            key="plant",
        )
    return factor


def triangular_factor(rows: NDArray[np.float64]) -> tuple[Array, Array]:
    """Return L (k, k), lower triangular, with rows^T rows = L L^T, and its null directions (k, m).

    Rank is judged with every column of the rows (number, k) at norm one, in any units.
    """
    scale = np.linalg.norm(rows, axis=0)
    scale[scale == 0.0] = 1.0
    triangle = np.asarray(np.linalg.qr(rows / scale, mode="r"))
    _, singular, vectors = np.linalg.svd(triangle)
    return (triangle * scale).T, vectors[singular <= _RANK_TOLERANCE * singular[0]].T
