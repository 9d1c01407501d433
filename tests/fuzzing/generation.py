"""Specs made from nothing, by hypothesis: plants from their poles, loops, questions, spectra, signals."""

from __future__ import annotations

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed as seeded, settings, strategies as st

# The first examples of hypothesis are the simplest; the last one of so many is anything.
_EXAMPLES = 6


def generated(number: int) -> dict:
    """The spec of a number."""
    found: list[dict] = []

    @seeded(number)
    @settings(
        max_examples=_EXAMPLES,
        phases=[Phase.generate],
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(specs())
    def collect(spec):
        found.append(spec)

    collect()
    return found[-1]


def weighted(*choices):
    """One of the strategies, each as often as its number says."""
    return st.sampled_from([one for many, one in choices for _ in range(many)]).flatmap(lambda one: one)


def between(low, high):
    """Numbers as a person writes them: with four decimals."""
    return st.floats(low, high).map(lambda value: round(value, 4))


def logarithmic(low, high):
    return st.floats(np.log(low), np.log(high)).map(lambda value: float(f"{np.exp(value):.4g}"))


magnitudes = weighted((8, logarithmic(0.05, 20)), (2, logarithmic(1e-4, 1e4)), (1, logarithmic(1e-9, 1e9)))
# Distances to the unit circle of poles: comfortable, slow, on the edge of what digits tell, none.
real_poles = weighted(
    (20, between(-0.9, 0.95)),
    (4, logarithmic(1e-6, 0.05).map(lambda d: 1.0 - d)),
    (4, st.just(1.0)),
    (1, st.sampled_from([1.0 - 1e-9, 1.0 + 1e-9, 0.9999998])),
    (1, between(1.01, 1.5)),
)
steady_poles = weighted((12, between(-0.9, 0.95)), (1, logarithmic(1e-3, 0.05).map(lambda d: 1.0 - d)))
angles = between(0.05, 3.1)
radii = weighted(
    (6, between(0.1, 0.95)), (2, logarithmic(1e-4, 0.05).map(lambda d: 1.0 - d)), (1, st.just(1.0))
)


@st.composite
def polynomials(draw, most, poles=steady_poles):
    """1 + c1 q^-1 + .. with so many roots at the most, its coefficients as a person writes them."""
    c = np.ones(1)
    for _ in range(draw(st.integers(0, most))):
        c = np.convolve(c, [1.0, -draw(poles)])
    if draw(st.booleans()) and most > 1:
        radius, angle = draw(radii if poles is real_poles else between(0.1, 0.97)), draw(angles)
        c = np.convolve(c, [1.0, -2.0 * radius * np.cos(angle), radius**2])
    return [float(f"{value:.8g}") for value in c]


@st.composite
def numerators(draw):
    delay = draw(weighted((6, st.just(1)), (1, st.just(0)), (1, st.integers(2, 5))))
    size = draw(st.integers(1, 3))
    gains = [draw(between(-2.0, 2.0)) for _ in range(size)]
    scale = draw(magnitudes)
    first = [float(f"{scale * (gain or 1.0):.6g}") for gain in gains]
    return [0.0] * delay + first


@st.composite
def plants(draw, outputs, inputs):
    family = draw(st.sampled_from(["ARX", "OE", "ARMAX", "BJ"]))
    single = outputs * inputs == 1
    poles = draw(weighted((3, st.just(steady_poles)), (2, st.just(real_poles))))

    def matrix(entries):
        return draw(entries) if single else [[draw(entries) for _ in range(inputs)] for _ in range(outputs)]

    def rows(entries):
        return draw(entries) if single or draw(st.booleans()) else [draw(entries) for _ in range(outputs)]

    most = 3 if single else 1
    plant, noise = {"B": matrix(numerators())}, {}
    if family in ("ARX", "ARMAX"):
        plant["A"] = rows(polynomials(most, poles))
    if family in ("OE", "BJ"):
        plant["F"] = matrix(polynomials(most, poles))
    if family in ("ARMAX", "BJ"):
        noise["C"] = rows(polynomials(1))
    if family == "BJ":
        noise["D"] = rows(polynomials(1))
    noise["variance"] = draw(magnitudes)
    if not single:
        root = np.array([[draw(between(-1.0, 1.0)) for _ in range(outputs)] for _ in range(outputs)])
        noise["variance"] = (noise["variance"] * (root @ root.T + 0.1 * np.eye(outputs))).round(12).tolist()
    return {"plant": plant, "noise": noise}


_GAINS = (0.005, 0.02, 0.1, 0.3, 1.0)
_FORMS = (([1.0], [1.0]), ([1.0], [1.0, -0.2]), ([1.0, -0.9], [1.0, -1.0]))  # the last one integrates


def controllers(plant, outputs, inputs):
    """Feedback with or without an integrator; that of one input and output is stable where possible."""
    if outputs * inputs > 1:
        return st.builds(_decentralised, st.just((inputs, outputs)), *map(st.sampled_from, (_GAINS, _FORMS)))
    B = np.array(plant["plant"]["B"])
    below = np.convolve(plant["plant"].get("A", [1.0]), plant["plant"].get("F", [1.0]))
    size = np.abs(B).sum() or 1.0
    tried = [
        {"numerator": [float(f"{gain * c / size:.6g}") for c in form[0]], "denominator": form[1]}
        for gain in (*_GAINS, *(-gain for gain in _GAINS))
        for form in _FORMS
    ]
    return st.sampled_from([one for one in tried if _stable(B, below, one)] or tried)


def _decentralised(shape, gain, form):
    own = [gain * c for c in form[0]]
    rows = [[own if i == j else [0.0] for j in range(shape[1])] for i in range(shape[0])]
    return {"numerator": rows, "denominator": form[1]}


def _stable(above, below, controller):
    opened, fed_back = (
        np.convolve(below, controller["denominator"]),
        np.convolve(above, controller["numerator"]),
    )
    closed = np.polynomial.polynomial.polyadd(opened, fed_back)
    return bool(np.all(np.abs(np.roots(closed)) < 0.9999))


@st.composite
def bands(draw):
    low = draw(weighted((1, st.just(0.0)), (2, logarithmic(1e-3, 0.5))))
    return [low, draw(weighted((2, between(0.6, 3.0)), (1, st.just(3.14159))))]


@st.composite
def model_errors(draw):
    error = {draw(st.sampled_from(["relative", "absolute"])): draw(logarithmic(0.005, 1.0))}
    error |= draw(
        st.sampled_from([{"confidence": 0.95}, {"alpha": 2.45}, {"confidence": 0.99}, {"alpha": 1.0}])
    )
    if draw(weighted((2, st.just(False)), (1, st.just(True)))):
        error["band"] = draw(bands())
    return error


@st.composite
def questions(draw, outputs, inputs):
    """What is asked, within which limits."""
    power = {"input_power": draw(magnitudes)}
    asked = draw(
        st.sampled_from(["cost", "cost", "cost", "limited", "best", "shortest", "criterion", "variance"])
    )
    spec: dict = {"accuracy": {"model_error": draw(model_errors())}}
    if asked == "limited":
        spec["limits"] = draw(st.sampled_from([power, {"output_power": power["input_power"]}]))
        spec["cost"] = draw(
            st.sampled_from(
                [{"input_power": 1}, {"output_power": 1}, {"input_power": 1, "output_power": 0.1}]
            )
        )
    elif asked in ("best", "shortest"):
        spec["objective"] = {"best": "best_accuracy", "shortest": "shortest_experiment"}[asked]
        spec["limits"] = power
    elif asked == "criterion":
        spec = {"accuracy": {"criterion": draw(st.sampled_from("DAET"))}, "limits": power}
    elif asked == "variance":
        relative = draw(st.booleans())
        spec["accuracy"] = {"weighted_variance": {"max": draw(logarithmic(1e-4, 1.0)), "relative": relative}}
    if draw(weighted((5, st.just(False)), (1, st.just(True)))):
        spec.setdefault("limits", {})["amplitude"] = draw(logarithmic(0.3, 30))
    return spec


spectra = st.sampled_from(
    [
        {"type": "white"},
        *({"type": "fir", "order": order} for order in (1, 4, 4, 12)),
        {"type": "free"},
        {"type": "multisine", "lines": 20},
        {"type": "polynomial", "order": 3, "band": [0.0, 1.0]},
    ]
)


def _unstable(spec):
    """Whether a plant with one input and output has a pole on or outside the unit circle."""
    plant = spec["plant"]
    if isinstance(plant["B"][0], list):
        return False
    poles = np.concatenate([np.roots(plant.get(letter, [1.0])) for letter in "AF"])
    return bool(np.any(np.abs(poles) > 1.0 - 1e-9))


@st.composite
def specs(draw):
    """A spec with all its sections, well posed or not."""
    size = draw(weighted((6, st.just((1, 1))), (2, st.just((2, 2))), (1, st.sampled_from([(1, 2), (2, 1)]))))
    spec = draw(plants(*size))
    spec["experiment"] = {"samples": draw(st.sampled_from([100, 500, 2000, 10_000]))}
    if draw(weighted((3, st.just(False)), (2, st.just(True)))) or _unstable(spec):
        spec["experiment"]["controller"] = draw(controllers(spec, *size))
    spec |= draw(questions(*size))
    spec["spectrum"] = draw(spectra)
    spec["signal"] = draw(
        weighted(
            (3, st.just({"samples": 64})),
            (1, st.just({"type": "multisine", "samples": 128})),
            (1, st.just({"type": "binary", "samples": 128})),
        )
    )
    if draw(weighted((3, st.just(False)), (1, st.just(True)))):
        spec["sample_time"] = draw(logarithmic(1e-3, 1e3))
    spec["solver"] = {"time_limit": 20}
    return spec
