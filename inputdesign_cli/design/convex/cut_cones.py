"""The cone constraints of cuts, whose unknowns are a = (entries of svec M, s) alone."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.accuracy import ConcaveFunction, Inequality
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.cones import Entries, Orthant, Semidefinite, Stack, furthest, reach


class Concave(Orthant):
    """The constraints g_j(M) >= h_j for concave g_j of degree one, h_j one or s; a = (entries of svec M, s).

    The Hessian of g is curvature (a a^T / g - M^-1 . a), a its gradient (see `ConcaveFunction`): the
    Lagrangian adds it to the usual Z / S a a^T. M itself is kept positive definite.
    """

    curved = True

    def __init__(
        self,
        functions: list[ConcaveFunction],
        sides: list[bool],
        entries: Entries,
        slack: float,
        weight: float,
    ) -> None:
        self.functions, self.sides, self.entries = functions, np.array(sides, dtype=float), entries
        self.curvature = np.array([f.curvature for f in functions])
        none = np.zeros((len(functions), entries.size))
        start = np.full(len(functions), 1.0)
        super().__init__(none, np.zeros(len(functions)), slack * start, weight * start)

    def look(self, at: Array) -> float:
        """See `Cone`."""
        M = self.entries.matrix(at)
        self.root = np.linalg.inv(np.linalg.cholesky(M))
        self.inverse = self.root.T @ self.root
        found = [f.at(M, self.inverse) for f in self.functions]
        self.value = np.array([value for value, _ in found])
        self.gradients = np.array([gradient for _, gradient in found])
        self.plain = self.entries.vector(self.gradients)
        self.rows, level = self.plain.copy(), np.ones(self.degree)
        if self.entries.with_s:
            self.rows[:, -1] = -self.sides
            level = np.where(self.sides > 0, at[-1], 1.0)
        self.miss = self.value - level - self.S
        return float(np.abs(self.miss).max(initial=0.0))

    def add_to(self, matrix: Array) -> None:
        """See `Cone`."""
        super().add_to(matrix)
        bent = self.Z * self.curvature
        matrix -= (self.plain.T * (bent / self.value)) @ self.plain
        size = self.entries.kept.size
        turned = np.tensordot(bent, self.gradients, axes=1)
        matrix[:size, :size] += self.entries.products(self.inverse[None], turned[None])

    def turn(self, step: Array) -> None:
        """See `Cone`."""
        super().turn(step)
        self.change = self.root @ self.entries.matrix(step) @ self.root.T

    def lengths(self) -> tuple[float, float]:
        """See `Cone`."""
        up, down = super().lengths()
        return min(up, furthest(self.change[None])), down

    def multipliers(self) -> list[Array]:
        """Return Z times the gradients (k, k)."""
        return [z * gradient for z, gradient in zip(self.Z, self.gradients, strict=True)]


class Inequalities(Semidefinite):
    """The constraints h_b constant_b + scale M + nu_b form_b >= 0, h_b one or s; a = (entries of svec M, s).

    M fills the leading (k, k) of matrices of order d. Where there are forms, each has an unknown nu_b >= 0 of
    its own, which is eliminated from the linear system.
    """

    def __init__(
        self, parts: list[Inequality], sides: list[bool], entries: Entries, slack: float, weight: float
    ) -> None:
        self.constant = np.array([part.constant for part in parts])
        super().__init__(len(parts), self.constant.shape[1], slack, weight)
        self.scale, self.entries = parts[0].scale, entries
        self.side = np.array(sides)
        forms = [part.form for part in parts if part.form is not None]
        self.form = np.array(forms) if forms else None
        if self.form is not None:
            self.nu, self.price = np.full(len(parts), slack), np.full(len(parts), weight)
            self.dnu, self.dprice = np.zeros(len(parts)), np.zeros(len(parts))
            self.degree += len(parts)

    @property
    def gap(self) -> float:
        """See `Cone`."""
        own = 0.0 if self.form is None else float(self.nu @ self.price)
        return super().gap + own

    def look(self, at: Array) -> float:
        """See `Cone`."""
        self.miss = self._image(at, 1.0, None if self.form is None else self.nu) - self.S
        self.factor()
        missed = float(np.abs(self.miss).max())
        if self.form is None:
            return missed
        self.H_form = self.scaled(self.form)
        # The dual condition of nu_b: its multiplier and tr(form_b Z_b) add up to zero.
        unbalanced = np.abs(np.einsum("nab,nab->n", self.form, self.Z) + self.price)
        return max(missed, float(unbalanced.max()))

    def _image(self, at: Array, one: float, nu: Array | None) -> Stack:
        k = self.entries.order
        total = one * np.where(self.side[:, None, None], 0.0, self.constant)
        if self.side.any():
            total = total + at[-1] * np.where(self.side[:, None, None], self.constant, 0.0)
        total[:, :k, :k] += self.scale * self.entries.matrix(at)
        if nu is not None and self.form is not None:
            total = total + nu[:, None, None] * self.form
        return total

    def _back(self, X: Stack) -> Array:
        """Return A^T X, summed over the inequalities."""
        k = self.entries.order
        found = self.scale * self.entries.vector(X[:, :k, :k].sum(axis=0))
        if self.side.any():
            found[-1] = np.sum(self.constant[self.side] * X[self.side])
        return found

    def pull(self) -> Array:
        """See `Cone`."""
        return self._back(self.Z)

    def add_to(self, matrix: Array) -> None:
        """See `Cone`."""
        k, size = self.entries.order, self.entries.kept.size
        matrix[:size, :size] += self.scale**2 * self.entries.products(
            self.Z[:, :k, :k], self.inverse[:, :k, :k]
        )
        if self.side.any():
            H = self.scaled(self.constant)
            column = self.scale * self.entries.vector(H[self.side][:, :k, :k].sum(axis=0))[:-1]
            matrix[:-1, -1] += column
            matrix[-1, :-1] += column
            matrix[-1, -1] += np.sum((H * self.constant)[self.side])
        if self.form is not None:
            self.across = self.scale * self.entries.vector(self.H_form[:, :k, :k])
            if self.side.any():
                self.across[:, -1] = np.where(
                    self.side, np.einsum("nab,nab->n", self.H_form, self.constant), 0.0
                )
            self.own = np.einsum("nab,nab->n", self.H_form, self.form) + self.price / self.nu
            matrix -= (self.across.T / self.own) @ self.across

    def push(self, target: float, *, corrected: bool) -> Array:
        """See `Cone`."""
        U = self.aimed(target, corrected=corrected) - self.scaled(self.miss)
        found = self._back(U)
        if self.form is None:
            return found
        self.price_aim = target / self.nu - (self.dprice * self.dnu / self.nu if corrected else 0.0)
        self.own_push = np.einsum("nab,nab->n", self.form, U) + self.price_aim
        return found - self.across.T @ (self.own_push / self.own)

    def turn(self, step: Array) -> None:
        """See `Cone`."""
        if self.form is None:
            self.answer(self.miss + self._image(step, 0.0, None))
            return
        self.dnu = (self.own_push - self.across @ step) / self.own
        self.dprice = self.price_aim - self.price - self.price / self.nu * self.dnu
        self.answer(self.miss + self._image(step, 0.0, self.dnu))

    def lengths(self) -> tuple[float, float]:
        """See `Cone`."""
        up, down = super().lengths()
        if self.form is None:
            return up, down
        return min(up, reach(self.nu, self.dnu)), min(down, reach(self.price, self.dprice))

    def gap_after(self, up: float, down: float) -> float:
        """See `Cone`."""
        total = super().gap_after(up, down)
        if self.form is not None:
            total += float((self.nu + up * self.dnu) @ (self.price + down * self.dprice))
        return total

    def move(self, up: float, down: float) -> None:
        """See `Cone`."""
        super().move(up, down)
        if self.form is not None:
            self.nu = self.nu + up * self.dnu
            self.price = self.price + down * self.dprice
