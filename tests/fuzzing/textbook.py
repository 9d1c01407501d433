"""Checks of a result by textbook formulas on a plain grid, from the spec and the result with numpy alone.

Plants are in q^-1, of any size, in open loop or under u = r - C y. No code of the package takes part.
"""

from __future__ import annotations

import math
import re

import numpy as np
from scipy.stats import chi2

_POINTS, _MOST_POINTS = 2**11, 2**16
_AGREES = 1e-9
_TELLS = 1e-10  # reciprocal condition below which rounding affects a ratio
_NAME = re.compile(r"([abcdf])(\d+)(?:\[(\d+)(?:,(\d+))?\])?$")
_KEYS = {"relative", "absolute", "confidence", "alpha", "band", "norm"}


class NotJudgedError(Exception):
    """The spec or its result is beyond these formulas."""


def complex_of(value):
    if isinstance(value, list):
        return np.array([complex_of(part) for part in value])
    return complex(value["re"], value["im"]) if isinstance(value, dict) else complex(value)


class Excitation:
    """A density over the circle (n equal weights), or the powers of sinusoids, as matrices (r, r)."""

    def __init__(self, inputs, *, lags=None, lines=None, powers=None):
        self.inputs, self.lags, self.lines, self.power_matrices = inputs, lags, lines, powers

    def nodes(self, grid):
        """Frequencies (rad a sample) and matrices whose sum is the covariance of the excitation."""
        if self.lines is not None:
            return self.lines, self.power_matrices
        phi = np.repeat(self.lags[:1], grid.size, axis=0)
        for lag, c in enumerate(self.lags[1:], start=1):
            turned = np.exp(-1j * lag * grid)[:, None, None] * c
            phi = phi + turned + np.conj(np.swapaxes(turned, 1, 2))
        if np.linalg.eigvalsh(phi)[:, 0].min() < -1e-6 * np.abs(phi).max():
            raise NotJudgedError("a spectrum below zero between its nodes")
        return grid, phi / grid.size


def excitation_of(spec, result, inputs):
    """The spectrum that `result.json` describes."""
    spectrum, step = result["spectrum"], float(spec.get("sample_time", 1.0))
    if "powers" in spectrum:
        lines = np.array(spectrum["frequencies"], dtype=float) * step
        powers = complex_of(list(np.array(spectrum["powers"]).tolist()))
        return Excitation(inputs, lines=lines, powers=powers.reshape(-1, inputs, inputs))
    if spectrum["type"] == "fir":
        lags = complex_of(np.array(spectrum["coefficients"]).tolist())
        return Excitation(inputs, lags=lags.reshape(-1, inputs, inputs))
    if spectrum["type"] == "white" and not spectrum.get("band"):
        return Excitation(inputs, lags=np.array([np.eye(inputs) * spectrum["power"] / inputs], complex))
    raise NotJudgedError(spectrum["type"])


@np.errstate(all="ignore")
def findings(spec: dict, result: dict, *, slack: float = 1e-6) -> list[str]:
    """The false statements of a result, one sentence each.

    Args:
        spec: its content, as YAML gives it.
        result: as `result.json` has it.

    Raises:
        NotJudgedError: nothing can be said.
    """
    if result.get("status") not in ("optimal", "almost_optimal", "gap_open", "nothing_needed"):
        raise NotJudgedError(result.get("status"))
    if "information" not in result:
        raise NotJudgedError("no system")
    system = System(spec, result["information"]["parameters"])
    excitation = excitation_of(spec, result, system.inputs)
    told, value = [], result["objective"].get("value")
    kind = result["objective"]["kind"]
    powers = system.powers(excitation)
    for name, found in powers.items():
        claimed = np.atleast_1d(result["power"][name])
        if np.any(np.abs(claimed - found) > slack * max(np.sum(found), 1e-300)):
            told.append(f"the power of the {name} is {found}, not {claimed}")
    told += list(_exceeded(spec, powers, slack))
    samples = result["samples"]
    try:
        M = samples * system.information(excitation) + _prior(spec, system.names)
        ratios = dict(system.ratios(spec, M))
    except np.linalg.LinAlgError:
        return [*told, "some parameter is not identifiable, and the accuracy counts as met"]
    limit = value if kind == "accuracy_factor" else 1.0
    for name, ratio in ratios.items():
        if not ratio <= limit * (1.0 + slack):
            told.append(
                f"{name}: {ratio} times what is admitted, and {limit} is claimed ({result['status']})"
            )
    letter = spec["accuracy"].get("criterion")
    if letter and kind == letter and spec["accuracy"].get("scale") != "relative":
        found = _criterion(letter, M)
        if not abs(found - value) <= 1e-5 * max(abs(value), len(system.names) if letter == "D" else 0.0):
            told.append(f"criterion {letter} is {found}, not {value}")
    return told


@np.errstate(all="ignore")
def worst_ratio(spec: dict, result: dict) -> float:
    """The largest ratio of an error to the admitted one.

    Raises:
        NotJudgedError: nothing can be said.
    """
    system = System(spec, result["information"]["parameters"])
    told = system.information(excitation_of(spec, result, system.inputs))
    M = result["samples"] * told + _prior(spec, system.names)
    return max((ratio for _, ratio in system.ratios(spec, M)), default=0.0)


def _exceeded(spec, powers, slack):
    for kind in ("input", "output", "excitation"):
        bound = (spec.get("limits") or {}).get(f"{kind}_power")
        if isinstance(bound, int | float) and powers[kind].sum() > bound * (1.0 + slack):
            yield f"limits.{kind}_power is {bound}, and the spectrum has {powers[kind].sum()}"
        elif isinstance(bound, list) and np.any(powers[kind] > np.array(bound) * (1.0 + slack)):
            yield f"limits.{kind}_power is {bound}, and the spectrum has {powers[kind]}"


def _criterion(letter, M):
    """The criterion of M, by way of the well-scaled matrix in units of its own diagonal."""
    if letter == "T":
        return float(np.trace(M))
    root = np.sqrt(np.diag(M))
    scaled = M / root / root[:, None]
    if letter == "D":
        return float(np.linalg.slogdet(scaled)[1] + 2.0 * np.sum(np.log(root)))
    inverse = np.linalg.inv(scaled) / root / root[:, None]
    return -float(np.trace(inverse)) if letter == "A" else 1.0 / float(np.linalg.eigvalsh(inverse)[-1])


def _prior(spec, names):
    prior = (spec.get("experiment") or {}).get("prior")
    if prior is None:
        return np.zeros((len(names), len(names)))
    if not isinstance(prior, dict) or set(prior) != {"information"} or isinstance(prior["information"], str):
        raise NotJudgedError("prior")
    return np.array(prior["information"], dtype=float)


class System:
    """A_i y_i = sum_j (B_ij / F_ij) u_j + (C_i / D_i) e_i, perhaps under u = r - C y."""

    def __init__(self, spec, names):
        plant, noise = spec["plant"], spec.get("noise") or {}
        if set(plant) - {"A", "B", "F"} or set(noise) - {"C", "D", "variance"}:
            raise NotJudgedError("plant")
        single = not isinstance(plant["B"][0], list)
        self.step = float(spec.get("sample_time", 1.0))
        self.names = [_NAME.match(name) for name in names]
        if None in self.names:
            raise NotJudgedError("names")
        self.B = [[plant["B"]]] if single else plant["B"]
        self.outputs, self.inputs = len(self.B), len(self.B[0])
        ones = [[[1.0]] * self.inputs] * self.outputs
        self.F = plant.get("F") or ones
        self.F = [[self.F]] if single and "F" in plant and plant["F"] else self.F
        self.A, self.C, self.D = (
            self._rows(part) for part in (plant.get("A"), noise.get("C"), noise.get("D"))
        )
        self.common = {letter: rows[1] for letter, rows in zip("acd", (self.A, self.C, self.D), strict=True)}
        self.A, self.C, self.D = self.A[0], self.C[0], self.D[0]
        covariance = np.atleast_2d(noise.get("variance", 1.0)).astype(float)
        if covariance.shape != (self.outputs, self.outputs):
            raise NotJudgedError("variance")
        self.root = np.linalg.cholesky(covariance)
        self.loop = self._controller((spec.get("experiment") or {}).get("controller"))

    def _rows(self, stated):
        """One polynomial an output, and whether it is common to all."""
        if not stated:
            return [[1.0]] * self.outputs, True
        if isinstance(stated[0], list):
            return stated, False
        return [stated] * self.outputs, True

    def _controller(self, stated):
        if stated is None:
            return None
        if set(stated) != {"numerator", "denominator"}:
            raise NotJudgedError("controller")
        above, below = stated["numerator"], stated["denominator"]
        if self.inputs * self.outputs == 1 and not isinstance(above[0], list):
            above = [[above]]
        if isinstance(below[0], list):
            if self.inputs * self.outputs > 1:
                raise NotJudgedError("controller")
            product = [1.0]
            for factor in below:
                product = np.convolve(product, factor)
            below = product
        return above, below

    def _at(self, polynomial, z):
        return np.polyval(np.asarray(polynomial, dtype=float)[::-1], z)

    def responses(self, w):
        """G (n, p, r), H (n, p), and their gradients dG (k, n, p, r), dH (k, n, p)."""
        z = np.exp(-1j * w)
        n, p, r = z.size, self.outputs, self.inputs
        A, C, D = (np.array([self._at(one, z) for one in part]).T for part in (self.A, self.C, self.D))
        B, F = (
            np.array([[self._at(one, z) for one in row] for row in part]).transpose(2, 0, 1)
            for part in (self.B, self.F)
        )
        G, H = B / (A[:, :, None] * F), C / (A * D)
        dG, dH = np.zeros((len(self.names), n, p, r), complex), np.zeros((len(self.names), n, p), complex)
        for k, name in enumerate(self.names):
            letter, at, i, j = name[1], z ** int(name[2]), int(name[3] or 1) - 1, int(name[4] or 1) - 1
            rows = range(p) if letter in "acd" and self.common[letter] else [i]
            for row in rows:
                if letter == "b":
                    dG[k, :, row, j] = at / (A[:, row] * F[:, row, j])
                elif letter == "f":
                    dG[k, :, row, j] = -G[:, row, j] * at / F[:, row, j]
                elif letter == "a":
                    dG[k, :, row] = -G[:, row] * (at / A[:, row])[:, None]
                    dH[k, :, row] = -H[:, row] * at / A[:, row]
                elif letter == "c":
                    dH[k, :, row] = at / (A[:, row] * D[:, row])
                else:
                    dH[k, :, row] = -H[:, row] * at / D[:, row]
        return G, H, dG, dH

    def loop_at(self, w, G):
        """C (n, r, p) and S = (I + C G)^-1 (n, r, r)."""
        n, identity = w.size, np.eye(self.inputs)
        if self.loop is None:
            return np.zeros((n, self.inputs, self.outputs)), np.broadcast_to(identity, (n, *identity.shape))
        above, below = self.loop
        z = np.exp(-1j * w)
        C = np.array([[self._at(one, z) / self._at(below, z) for one in row] for row in above])
        C = C.transpose(2, 0, 1)
        return C, np.linalg.inv(identity + C @ G)

    def information(self, excitation):
        """Information (k, k) per sample of excitation and noise, on a grid doubled until it suffices."""
        before, points = None, _POINTS
        while points <= _MOST_POINTS:
            M = self._information(excitation, 2.0 * np.pi * (np.arange(points) + 0.5) / points)
            unit = np.sqrt(np.maximum(np.diag(M), 1e-300))
            if before is not None and np.max(np.abs(M - before) / unit / unit[:, None]) < _AGREES:
                return M
            before, points = M, 2 * points
        raise NotJudgedError("the integrals do not settle")

    def _information(self, excitation, grid):
        w, powers = excitation.nodes(grid)
        G, H, dG, _ = self.responses(w)
        _, S = self.loop_at(w, G)
        F = np.linalg.solve(self.root[None, None], (dG / H[None, :, :, None]) @ S)
        M = np.einsum("knpr,nrs,lnps->kl", F, powers, np.conj(F), optimize=True).real
        G, H, dG, dH = self.responses(grid)
        C, S = self.loop_at(grid, G)
        fed_back = dG @ S @ C * H[:, None, :]  # dG C (I + G C)^-1 H
        of_noise = dH[:, :, :, None] * np.eye(self.outputs) - fed_back
        E = np.linalg.solve(self.root[None, None], of_noise / H[None, :, :, None]) @ self.root
        M = M + np.einsum("knpq,lnpq->kl", E, np.conj(E), optimize=True).real / grid.size
        if not np.all(np.isfinite(M)):
            raise NotJudgedError("not finite")
        return M

    def powers(self, excitation):
        """Powers of input, output and excitation, one array (channels,) each."""
        grid = 2.0 * np.pi * (np.arange(2**14) + 0.5) / 2**14
        w, powers = excitation.nodes(grid)
        G = self.responses(w)[0]
        S = self.loop_at(w, G)[1]
        found = {"excitation": powers, "input": S @ powers @ np.conj(np.swapaxes(S, 1, 2))}
        GS = G @ S
        found["output"] = GS @ powers @ np.conj(np.swapaxes(GS, 1, 2))
        if not all(np.all(np.isfinite(P)) for P in found.values()):
            raise NotJudgedError("a pole on the grid")
        return {name: np.einsum("naa->a", P).real for name, P in found.items()}

    def ratios(self, spec, M):
        """Each requirement with the largest ratio of its error to the admitted one."""
        accuracy = spec["accuracy"]
        unit = np.sqrt(np.diag(M))
        if np.any(unit <= 0.0):
            raise np.linalg.LinAlgError
        scaled = M / unit / unit[:, None]
        if np.linalg.eigvalsh(scaled)[0] < _TELLS:
            raise NotJudgedError("rounding would decide")
        half = np.linalg.inv(np.linalg.cholesky(scaled)) / unit  # half^T half = M^-1
        error, variance = accuracy.get("model_error"), accuracy.get("weighted_variance")
        if error is not None:
            yield from self._model_error(error, half)
        if variance is not None and set(variance) <= {"max", "band", "relative"}:
            w = self._band(variance.get("band"))
            G, _, dG, _ = self.responses(w)
            spread = np.einsum("lk,knpr->lnpr", half, dG)
            told = np.sum(np.abs(spread) ** 2, axis=0)
            admitted = variance["max"] * (np.abs(G) ** 2 if variance.get("relative") else np.ones_like(told))
            yield "weighted_variance", math.sqrt(np.nanmax(_shares(told, admitted, G)))
        deviations = accuracy.get("standard_deviation") or {}
        names = [name[0] for name in self.names]
        for name, admitted in deviations.items():
            if isinstance(admitted, int | float) and name in names:
                found = float(np.linalg.norm(half[:, names.index(name)]))
                yield f"standard_deviation.{name}", found / admitted

    def _model_error(self, error, half):
        if set(error) - _KEYS or error.get("norm", "entry") != "entry":
            raise NotJudgedError("model_error")
        free = sum(name[1] in "abf" for name in self.names)
        probability = error.get("confidence", 0.95)
        if isinstance(probability, dict):
            raise NotJudgedError("confidence")
        alpha = error.get("alpha") or math.sqrt(chi2.ppf(probability, free))
        w = self._band(error.get("band"))
        G, _, dG, _ = self.responses(w)
        spread = np.moveaxis(np.einsum("lk,knpr->lnpr", half, dG), 0, -1)  # (n, p, r, k)
        real = np.stack([spread.real, spread.imag], axis=-2)
        gram = real @ np.swapaxes(real, -1, -2)
        finite = np.all(np.isfinite(gram), axis=(-1, -2))
        squared = np.linalg.eigvalsh(np.where(finite[..., None, None], gram, 0.0))[..., -1]
        relative, absolute = error.get("relative"), error.get("absolute")
        admitted = relative * np.abs(G) if relative else np.full(G.shape, absolute)
        ratios = np.where(finite, alpha * np.sqrt(np.maximum(squared, 0.0)), np.nan)
        yield "model_error", float(np.nanmax(_shares(ratios, admitted, G)))

    def _band(self, band):
        low, high = (edge * self.step for edge in band) if band else (0.0, np.pi)
        high = min(high, np.pi)
        near_zero = np.geomspace(max(low, 1e-4 * high), high, 1500)
        w = np.union1d(np.linspace(low, high, 3000), near_zero)
        for polynomial in [*self.A, *(one for row in self.F for one in row)]:
            for root in np.roots(np.trim_zeros(np.asarray(polynomial, float)[::-1], "f")):
                # Roots in q^-1: lightly damped poles have their peaks here.
                at, width = abs(np.angle(root)), abs(abs(root) - 1.0)
                if low < at < high and width < 0.1:
                    w = np.union1d(w, np.clip(at + width * np.linspace(-8, 8, 161), low, high))
        return w


def _shares(found, admitted, G):
    """The ratios; NaN for entries of G that are zero, and on a pole, where both are infinite."""
    identically_zero = np.all(np.nan_to_num(G) == 0.0, axis=0)
    with np.errstate(all="ignore"):
        ratios = found / admitted
    return np.where(identically_zero | ~np.isfinite(admitted), np.nan, ratios)
