"""Random specs: plants from their poles, loops, questions, spectra, signals."""

from __future__ import annotations

import random

import numpy as np

_GAINS = (0.005, 0.02, 0.1, 0.3, 1.0)
_FORMS = (([1.0], [1.0]), ([1.0], [1.0, -0.2]), ([1.0, -0.9], [1.0, -1.0]))  # the last one integrates


class Draw(random.Random):
    """Numbers as a person writes them."""

    def weighted(self, *choices):
        """One of the choices (weight, value), by their weights; a function is called."""
        (found,) = self.choices([one for _, one in choices], [many for many, _ in choices])
        return found() if callable(found) else found

    def flag(self, share):
        return self.random() < share

    def between(self, low, high):
        return round(self.uniform(low, high), 4)

    def logarithmic(self, low, high):
        return float(f"{np.exp(self.uniform(np.log(low), np.log(high))):.4g}")

    def magnitude(self):
        return self.logarithmic(*self.weighted((8, (0.05, 20)), (2, (1e-4, 1e4)), (1, (1e-9, 1e9))))

    def steady_pole(self):
        return self.weighted(
            (12, lambda: self.between(-0.9, 0.95)), (1, lambda: 1.0 - self.logarithmic(1e-3, 0.05))
        )

    def real_pole(self):
        """Poles well inside the unit circle, slow ones, on it, within rounding errors of it, and outside."""
        return self.weighted(
            (20, lambda: self.between(-0.9, 0.95)),
            (4, lambda: 1.0 - self.logarithmic(1e-6, 0.05)),
            (4, 1.0),
            (1, lambda: self.choice([1.0 - 1e-9, 1.0 + 1e-9, 0.9999998])),
            (1, lambda: self.between(1.01, 1.5)),
        )

    def radius(self):
        return self.weighted(
            (6, lambda: self.between(0.1, 0.95)), (2, lambda: 1.0 - self.logarithmic(1e-4, 0.05)), (1, 1.0)
        )


def generated(number: int) -> dict:
    """The spec of this seed, with all its sections; it may be ill posed."""
    draw = Draw(number)
    size = draw.weighted((6, (1, 1)), (2, (2, 2)), (0.5, (1, 2)), (0.5, (2, 1)))
    spec = _system(draw, *size)
    spec["experiment"] = {"samples": draw.choice([100, 500, 2000, 10_000])}
    if draw.flag(0.4) or _unstable(spec):
        spec["experiment"]["controller"] = _controller(draw, spec, *size)
    spec |= _question(draw)
    spec["spectrum"] = draw.choice(
        [
            {"type": "white"},
            *({"type": "fir", "order": order} for order in (1, 4, 4, 12)),
            {"type": "free"},
            {"type": "multisine", "lines": 20},
            {"type": "polynomial", "order": 3, "band": [0.0, 1.0]},
        ]
    )
    spec["signal"] = draw.weighted(
        (3, {"samples": 64}),
        (1, {"type": "multisine", "samples": 128}),
        (1, {"type": "binary", "samples": 128}),
    )
    if draw.flag(0.25):
        spec["sample_time"] = draw.logarithmic(1e-3, 1e3)
    spec["solver"] = {"time_limit": 20}
    return spec


def _polynomial(draw, most, pole, radius):
    """1 + c1 q^-1 + .. with `most` real roots or fewer, and perhaps a complex pair."""
    c = np.ones(1)
    for _ in range(draw.randint(0, most)):
        c = np.convolve(c, [1.0, -pole()])
    if draw.flag(0.5) and most > 1:
        modulus = radius()
        c = np.convolve(c, [1.0, -2.0 * modulus * np.cos(draw.between(0.05, 3.1)), modulus**2])
    return [float(f"{value:.8g}") for value in c]


def _numerator(draw):
    delay = draw.weighted((6, 1), (1, 0), (1, lambda: draw.randint(2, 5)))
    scale = draw.magnitude()
    gains = [draw.between(-2.0, 2.0) or 1.0 for _ in range(draw.randint(1, 3))]
    return [0.0] * delay + [float(f"{scale * gain:.6g}") for gain in gains]


def _system(draw, outputs, inputs):
    family, single = draw.choice(["ARX", "OE", "ARMAX", "BJ"]), outputs * inputs == 1
    real = draw.flag(0.4)
    pole = draw.real_pole if real else draw.steady_pole
    radius = draw.radius if real else lambda: draw.between(0.1, 0.97)

    def matrix(entry):
        return entry() if single else [[entry() for _ in range(inputs)] for _ in range(outputs)]

    def rows(entry):
        return entry() if single or draw.flag(0.5) else [entry() for _ in range(outputs)]

    def of_plant():
        return _polynomial(draw, 3 if single else 1, pole, radius)

    def of_noise():
        return _polynomial(draw, 1, draw.steady_pole, draw.radius)

    plant, noise = {"B": matrix(lambda: _numerator(draw))}, {}
    if family in ("ARX", "ARMAX"):
        plant["A"] = rows(of_plant)
    else:
        plant["F"] = matrix(of_plant)
    if family in ("ARMAX", "BJ"):
        noise["C"] = rows(of_noise)
    if family == "BJ":
        noise["D"] = rows(of_noise)
    noise["variance"] = draw.magnitude()
    if not single:
        root = np.array([[draw.between(-1.0, 1.0) for _ in range(outputs)] for _ in range(outputs)])
        noise["variance"] = (noise["variance"] * (root @ root.T + 0.1 * np.eye(outputs))).round(12).tolist()
    return {"plant": plant, "noise": noise}


def _controller(draw, spec, outputs, inputs):
    """Feedback with or without an integrator; with one input and output the loop is stable if possible."""
    if outputs * inputs > 1:
        gain, (above, below) = draw.choice(_GAINS), draw.choice(_FORMS)
        own = [gain * c for c in above]
        rows = [[own if i == j else [0.0] for j in range(outputs)] for i in range(inputs)]
        return {"numerator": rows, "denominator": below}
    B = np.array(spec["plant"]["B"])
    below = np.convolve(spec["plant"].get("A", [1.0]), spec["plant"].get("F", [1.0]))
    tried = [
        {"numerator": [float(f"{gain * c / (np.abs(B).sum() or 1.0):.6g}") for c in form[0]]}
        | {"denominator": form[1]}
        for gain in (*_GAINS, *(-gain for gain in _GAINS))
        for form in _FORMS
    ]
    return draw.choice([one for one in tried if _stable(B, below, one)] or tried)


def _stable(above, below, controller):
    opened = np.convolve(below, controller["denominator"])
    fed_back = np.convolve(above, controller["numerator"])
    closed = np.polynomial.polynomial.polyadd(opened, fed_back)
    return bool(np.all(np.abs(np.roots(closed)) < 0.9999))


def _unstable(spec):
    """Whether a plant with one input and output has a pole on or outside the unit circle."""
    plant = spec["plant"]
    if isinstance(plant["B"][0], list):
        return False
    poles = np.concatenate([np.roots(plant.get(letter, [1.0])) for letter in "AF"])
    return bool(np.any(np.abs(poles) > 1.0 - 1e-9))


def _model_error(draw):
    error = {draw.choice(["relative", "absolute"]): draw.logarithmic(0.005, 1.0)}
    error |= draw.choice([{"confidence": 0.95}, {"alpha": 2.45}, {"confidence": 0.99}, {"alpha": 1.0}])
    if draw.flag(1 / 3):
        low = draw.weighted((1, 0.0), (2, lambda: draw.logarithmic(1e-3, 0.5)))
        error["band"] = [low, draw.weighted((2, lambda: draw.between(0.6, 3.0)), (1, 3.14159))]
    return error


def _question(draw):
    """The accuracy or objective that is asked for, and the limits."""
    power = {"input_power": draw.magnitude()}
    asked = draw.choice(["cost"] * 3 + ["limited", "best", "shortest", "criterion", "variance"])
    spec: dict = {"accuracy": {"model_error": _model_error(draw)}}
    if asked == "limited":
        spec["limits"] = draw.choice([power, {"output_power": power["input_power"]}])
        spec["cost"] = draw.choice(
            [{"input_power": 1}, {"output_power": 1}, {"input_power": 1, "output_power": 0.1}]
        )
    elif asked in ("best", "shortest"):
        spec["objective"] = {"best": "best_accuracy", "shortest": "shortest_experiment"}[asked]
        spec["limits"] = power
    elif asked == "criterion":
        spec = {"accuracy": {"criterion": draw.choice("DAET")}, "limits": power}
    elif asked == "variance":
        spec["accuracy"] = {
            "weighted_variance": {"max": draw.logarithmic(1e-4, 1.0), "relative": draw.flag(0.5)}
        }
    if draw.flag(1 / 6):
        spec.setdefault("limits", {})["amplitude"] = draw.logarithmic(0.3, 30)
    return spec
