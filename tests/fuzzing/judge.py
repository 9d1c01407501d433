"""What is wrong with the answer to a spec: an exception that is not ours, a warning, or nonsense."""

from __future__ import annotations

import math
import traceback
import warnings
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from inputdesign_cli import parse_spec, solve, validate
from inputdesign_cli.diagnostics import render
from inputdesign_cli.error_codes import explanations
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.runs.run_directory import finished_result

_POINTS = 2**14
_SLACK = 1e-6


def judged(text: str, folder: Path) -> tuple[str, str]:
    """How a spec of this text ends, with a status or the code of an error, and what is wrong with that."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            spec = parse_spec(text, "fuzz.yaml", folder=folder)
            validate(spec)
            result = finished_result(solve(spec))
            end, wrong = result["status"], nonsense(spec, result)
        except IdesignError as error:
            end = error.diagnostics[0].code
            wrong = "" if render(error) and end in explanations() else "no such code"
        except Exception:
            end, wrong = "exception", traceback.format_exc(limit=-4)
    if caught and not wrong:
        wrong = f"warning: {caught[0].message} ({caught[0].filename}:{caught[0].lineno})"
    return end, wrong


def nonsense(spec, result) -> str:
    """What a result says that is not so; nothing when all is well."""
    objective = result.get("objective", {})
    if result.get("status") in ("optimal", "almost_optimal") and "value" in objective:
        value, gap = objective["value"], 1e-4 * abs(objective["value"]) + 1e-4
        if (
            objective.get("lower_bound", -math.inf) > value + gap
            or objective.get("upper_bound", math.inf) < value - gap
        ):
            return f"the value {value} contradicts its bound: {objective}"
    if result.get("status") != "optimal":
        return ""
    ratio = independent_ratio(spec, result)
    return "" if ratio is None or ratio <= 1.0 + _SLACK else f"optimal with a ratio of {ratio}"


def independent_ratio(spec, result) -> float | None:
    """The worst r_u / r_adm of the written spectrum, summed over a grid; None where that does not apply.

    For one input and output in q^-1 whose error is bounded to first order, relative to G or absolutely.
    Nothing of the package takes part but what the spec and the result say.
    """
    plant, error = spec.plant, spec.accuracy.model_error
    if plant.kind != "polynomial" or (plant.inputs, plant.outputs) != (1, 1) or error is None:
        return None
    plain = error.region == "first_order" and error.weight is None and (error.relative or error.absolute)
    if (
        not plain
        or spec.goal == "best_accuracy"
        or spec.experiment.prior is not None
        or "worst_ratio" not in (result["model_error"])
    ):
        return None
    system = System(spec, result["information"]["parameters"])
    spectrum, samples = result["spectrum"], result["samples"]
    w = 2.0 * np.pi * (np.arange(_POINTS) + 0.5) / _POINTS
    of_noise = system.noise_gradient(w)
    M = (of_noise @ of_noise.conj().T).real / _POINTS
    if "powers" in spectrum:
        lines = np.asarray(spectrum["frequencies"]) * spec.sample_time
        F = system.gradient(lines) * np.sqrt(np.maximum(spectrum["powers"], 0.0))
        M = M + (F @ F.conj().T).real
    elif spectrum["type"] not in ("fir", "white"):
        return None
    else:
        c = np.atleast_1d(spectrum["coefficients"])
        phi = c[0] + 2.0 * sum((c[lag] * np.cos(lag * w) for lag in range(1, len(c))), np.zeros(w.size))
        if phi.min() < -1e-6 * phi.max():
            return math.inf
        F = system.gradient(w) * np.sqrt(np.maximum(phi, 0.0))
        M = M + (F @ F.conj().T).real / _POINTS
    scale = 1.0 / np.sqrt(np.diag(samples * M))
    scaled = scale[:, None] * (samples * M) * scale
    if system.radius > 0.995 or np.linalg.cond(scaled) > 1e9:
        return None
    low, high = spec.clip_band(error.band)
    at = np.union1d(np.linspace(low, high, 4000), result["model_error"].get("worst_frequency", low))
    G, dG = system.plant(at * spec.sample_time)
    free = sum(name[0] in "abf" for name in result["information"]["parameters"])
    alpha = error.alpha or math.sqrt(chi2.ppf(error.probability, free))
    half = np.linalg.solve(np.linalg.cholesky(scaled), scale[:, None] * dG)  # (k, n)
    real = np.stack([half.real, half.imag])
    gram = np.einsum("ikn,jkn->nij", real, real)
    r_u = alpha * np.sqrt(np.linalg.eigvalsh(gram)[:, -1])
    r_adm = error.absolute if error.absolute else error.relative * np.abs(G)
    return float(np.max(r_u / r_adm))


class System:
    """G, H and their gradients by the formulas of a textbook, in a loop u = r - C y or without one."""

    def __init__(self, spec, names):
        plant, noise, controller = spec.plant, spec.noise, spec.experiment.controller
        self.polynomials = {
            "a": plant.A, "b": plant.B, "c": noise.C, "d": noise.D, "f": plant.F or (1.0,)
        }  # fmt: skip
        self.names = names
        self.deviation = math.sqrt(noise.variance)
        self.controller = (
            None if controller is None else (controller.numerator, controller.denominator_polynomial)
        )
        rooted = [self.polynomials[letter] for letter in "acdf"]
        self.radius = max((abs(root) for p in rooted for root in np.roots(p)), default=0.0)

    def _at(self, w):
        z = np.exp(-1j * w)
        return z, {letter: np.polyval(np.asarray(p)[::-1], z) for letter, p in self.polynomials.items()}

    def _gradients(self, w):
        z, at = self._at(w)
        A, B, C, D, F = (at[letter] for letter in "abcdf")
        G, H = B / (A * F), C / (A * D)
        of_G = {"b": 1 / (A * F), "a": -G / A, "f": -G / F}
        of_H = {"c": 1 / (A * D), "a": -H / A, "d": -H / D}
        powers = [z ** int(name[1:]) for name in self.names]
        zero = np.zeros(z.size)
        dG = np.array([p * of_G.get(name[0], zero) for name, p in zip(self.names, powers, strict=True)])
        dH = np.array([p * of_H.get(name[0], zero) for name, p in zip(self.names, powers, strict=True)])
        return z, G, H, dG, dH

    def _sensitivity(self, z, G):
        if self.controller is None:
            return np.zeros(z.size), np.ones(z.size)
        above, below = (np.polyval(np.asarray(p)[::-1], z) for p in self.controller)
        C = above / below
        return C, 1.0 / (1.0 + C * G)

    def plant(self, w):
        _, G, _, dG, _ = self._gradients(w)
        return G, dG

    def gradient(self, w):
        """(k, n): of the prediction with respect to what is excited, relative to the noise."""
        z, G, H, dG, _ = self._gradients(w)
        return dG * self._sensitivity(z, G)[1] / (H * self.deviation)

    def noise_gradient(self, w):
        """(k, n): the same of the noise, in and around the loop."""
        z, G, H, dG, dH = self._gradients(w)
        C, S = self._sensitivity(z, G)
        return dH / H - dG * C * S
