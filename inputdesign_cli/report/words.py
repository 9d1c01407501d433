"""A spec and a result in words: what was asked, what was assumed, and whose methods answered."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from inputdesign_cli.specification import PolynomialPlant, RegressionPlant, Spec

Result = Mapping[str, Any]

# What the answer is called, and the sentence that gives it.
ANSWERS = {
    "least_cost": ("cost", "The cheapest experiment that meets the accuracy costs {}"),
    "shortest_experiment": ("samples", "The shortest experiment that meets the accuracy has {} samples"),
    "accuracy_factor": (
        "factor",
        "Within the limits the error of the model can be kept to {} times the admissible error",
    ),
    "D": ("log det M", "The most informative experiment within the limits has log det M = {}"),
    "A": ("-trace M^-1", "The most informative experiment within the limits has -trace M^-1 = {}"),
    "E": (
        "smallest eigenvalue of M",
        "The most informative experiment within the limits has a smallest eigenvalue of M of {}",
    ),
    "T": ("trace M", "The most informative experiment within the limits has trace M = {}"),
    "closed_loop_error": (
        "error of the loop",
        "The loop with the controller designed on the model errs least with this experiment: by {}, "
        "the number of samples times the excess mean square",
    ),
    "mean_squared_error": ("mean squared error", "The least mean squared error is {}"),
}
MAXIMISED = frozenset({"D", "A", "E", "T"})

_POWERS = {"input_power": "input", "output_power": "output", "excitation_power": "excitation"}
_SPECTRA = {
    "white": "white excitation",
    "fir": "spectra of finite impulse response type",
    "multisine": "sums of sinusoids on given frequencies",
    "free": "every spectrum",
    "polynomial": "spectra that are polynomials in frequency",
    "pointwise": "spectra given point by point on a grid",
    "moments": "second moments of the regressors",
}

_LEAST_COSTLY = (
    "X. Bombois and G. Scorletti, Design of least costly identification experiments, Journal Européen des "
    "Systèmes Automatisés 46 (2012) 587-610."
)
_ASYMPTOTIC = (
    "C. R. Rojas, H. Hjalmarsson and R. Hildebrand, MIMO experiment design based on asymptotic model order "
    "theory."
)
_MEAN_SQUARED = (
    "D. Eckhard, H. Hjalmarsson, C. R. Rojas and M. Gevers, Mean-squared error experiment design for linear "
    "regression models."
)
_SPECTRAL = (
    "M. Mohan, Mithun and B. Bhikkaji, Optimal input design for system identification using spectral "
    "decomposition."
)
_EQUIVALENCE = (
    "J. Kiefer and J. Wolfowitz, The equivalence of two extremum problems, Canadian Journal of Mathematics "
    "12 (1960) 363-366: the idea behind the bound over every spectrum."
)
_PREDICTION_ERROR = (
    "L. Ljung, System Identification: Theory for the User, second edition, Prentice Hall, 1999: prediction "
    "errors and their asymptotic covariance."
)


def question(spec: Spec, verb: str = "solve") -> list[str]:
    """The spec as sentences: the system, the experiment, what is asked."""
    return [_system(spec), _experiment(spec), *_accuracy(spec), *_limits(spec), _goal(spec, verb)]


def assumptions(spec: Spec, result: Result) -> list[str]:
    """What the numbers rest on, beyond the arithmetic."""
    rests = "The design is best" if "objective" in result else "The figures hold"
    said = [
        f"The plant and the noise are as the spec has them. {rests} for this nominal system; the accuracy "
        "of a model of another system may differ.",
    ]
    if "worst_ratio" in result.get("model_error", {}):
        region = spec.accuracy.model_error.region if spec.accuracy.model_error else "first_order"
        first = "" if region == "ellipsoid" else " and of first order in the parameters"
        said.append(
            "The covariance of the estimate is the asymptotic one of a consistent and efficient estimate; "
            f"r_u is therefore asymptotic in the number of samples{first}."
        )
    objective = result.get("objective", {})
    if "lower_bound" in objective or "upper_bound" in objective:
        said.append(
            "The proved bounds are values of dual points, computed in double precision; they hold to the "
            "rounding of integrals and eigenvalues, and of maxima over frequency sought on a refined grid."
        )
    if spec.closed_loop:
        said.append(
            "Powers are those that the excitation r adds to the normal operation of the loop; what the noise "
            "causes anyway is not counted."
        )
    if "worst_ratio" in result.get("signal", {}):
        said.append(
            "The worst ratio of the signal is computed from the very samples of signal.csv, which start "
            "from rest; the spectrum's own figures hold for a stationary signal of that spectrum."
        )
    if result.get("solver", {}).get("method") == "lmi":
        said.append("The accuracy was imposed on a grid of frequencies: between them it may be violated.")
    return said


def citations(spec: Spec, result: Result) -> list[str]:
    """The sources of the methods that were used."""
    kind = result.get("objective", {}).get("kind")
    cited = []
    if kind in ("least_cost", "shortest_experiment") and not isinstance(spec.plant, RegressionPlant):
        cited.append(_LEAST_COSTLY)
    if spec.accuracy.closed_loop_error is not None:
        cited.append(_ASYMPTOTIC)
    if spec.accuracy.mean_squared_error is not None:
        cited.append(_MEAN_SQUARED)
    if getattr(spec.spectrum, "type", "") == "polynomial":
        cited.append(_SPECTRAL)
    if "any_spectrum_bound" in result.get("objective", {}):
        cited.append(_EQUIVALENCE)
    if not isinstance(spec.plant, RegressionPlant):
        cited.append(_PREDICTION_ERROR)
    return cited


def _system(spec: Spec) -> str:
    plant = spec.plant
    if isinstance(plant, RegressionPlant):
        return "The system is a linear regression with neglected regressors."
    size = f"{_count(plant.inputs, 'input')} and {_count(plant.outputs, 'output')}"
    kind = _structure(spec) if isinstance(plant, PolynomialPlant) else "continuous-time"
    clock = f", sampled every {spec.sample_time:g} {spec.time_unit}" if plant.sampled else ""
    article = "an" if kind[0] in "AEFIO" else "a"
    return f"The system is {article} {kind} system with {size}{clock}."


def _structure(spec: Spec) -> str:
    plant = spec.plant
    assert isinstance(plant, PolynomialPlant)
    dynamic = {
        "A": plant.A != (1.0,),
        "C": spec.noise.C != (1.0,),
        "D": spec.noise.D != (1.0,),
        "F": plant.F is not None,
    }
    present = "".join(name for name, there in dynamic.items() if there)
    names = {
        "": "finite impulse response", "A": "ARX", "AC": "ARMAX", "F": "output-error",
        "CF": "Box-Jenkins", "DF": "Box-Jenkins", "CDF": "Box-Jenkins",
    }  # fmt: skip
    return names.get(present, "general polynomial")


def _experiment(spec: Spec) -> str:
    samples = spec.experiment.samples
    length = f"{samples} samples" if samples > 1 else "one sample, so that figures are per sample"
    if isinstance(spec.plant, RegressionPlant):
        return f"The experiment has {length}; the moments of its regressors are summed over all samples."
    loop = "in closed loop, with the controller in operation" if spec.closed_loop else "in open loop"
    if spec.designs and spec.goal == "shortest_experiment":
        return f"The length of the experiment is sought; it runs {loop}."
    return f"The experiment has {length}, {loop}."


def _accuracy(spec: Spec) -> list[str]:
    accuracy = spec.accuracy
    sentences = []
    error = accuracy.model_error
    if error is not None:
        size = (
            f"alpha = {error.alpha:g}" if error.alpha else f"{100 * (error.probability or 0):g} % confidence"
        )
        if error.relative is not None:
            bound = f"{100 * error.relative:g} % of |G|"
        elif error.absolute is not None:
            bound = f"{error.absolute:g}"
        elif error.table is not None:
            bound = f"the table {error.table}"
        else:
            bound = "what keeps the sensitivity of the loop within its bound"
        band = "every frequency"
        if error.band is not None:
            low, high = error.band
            band += f" from {low:g} to {high:.6g} rad/{spec.time_unit}"
        sentences.append(
            f"At {band}, the error r_u of the model ({size}) must not exceed the admissible error r_adm: "
            f"{bound}."
        )
    others = {
        "information": "The information matrix must exceed a given matrix.",
        "application": "The confidence region of the model must lie where the application tolerates it.",
        "weighted_variance": "The weighted variance of the frequency response is bounded.",
        "standard_deviation": "Standard deviations of parameters are bounded.",
        "closed_loop_error": "A controller is designed on the model; what counts is the error of its loop.",
    }
    sentences += [text for name, text in others.items() if getattr(accuracy, name, None) is not None]
    if accuracy.mean_squared_error is not None:
        target = accuracy.mean_squared_error.target
        most = "is to be small" if target is None else f"must not exceed {target:g}"
        sentences.append(
            f"The mean squared error of the estimate, bias and variance together, {most}, whatever the "
            f"neglected parameters up to a norm of {accuracy.mean_squared_error.neglected_norm:g}."
        )
    if getattr(accuracy, "criterion", None):
        sentences.append(f"What counts is criterion {accuracy.criterion} of the information matrix.")
    return sentences


def _limits(spec: Spec) -> list[str]:
    names = [
        name.replace("_", " ")
        for name in type(spec.limits).model_fields
        if getattr(spec.limits, name) is not None
    ]
    return [f"Limits hold for: {', '.join(names)}."] if names else []


def _goal(spec: Spec, verb: str) -> str:
    if verb == "identify":
        return "Asked: the model that explains the recorded data, and how sure it is."
    if verb == "assess":
        return "Asked: do the recorded data meet this accuracy; if not, which experiment makes up for it?"
    if not spec.designs or verb == "analyse":
        return "Asked: what accuracy the given excitation buys."
    family = _SPECTRA.get(getattr(spec.spectrum, "type", ""), "")
    order = getattr(spec.spectrum, "order", None)
    among = f" among {family}" if family else ""
    among += f" of order {order}" if family and order else ""
    if spec.goal == "best_accuracy":
        return f"Asked: {_best(spec)}{among}."
    if spec.goal == "shortest_experiment":
        return f"Asked: the shortest experiment that does it{among}."
    if isinstance(spec.plant, RegressionPlant):
        return f"Asked: the least energy that does it{among}; the energy is their trace."
    cost = " + ".join(
        f"{'' if weight == 1 else f'{weight:g} × '}{name} power"
        for key, name in _POWERS.items()
        if isinstance(weight := getattr(spec.cost, key), int | float) and weight
    )
    return f"Asked: the cheapest experiment that does it{among}; its cost is the {cost or 'weighted power'}."


def _best(spec: Spec) -> str:
    accuracy = spec.accuracy
    if accuracy.closed_loop_error is not None:
        return "the experiment after which the loop errs least"
    if accuracy.mean_squared_error is not None:
        return "the least error"
    if accuracy.criterion is not None:
        return "the experiment that teaches most"
    return "the smallest multiple of what is admitted that the limits allow"


def _count(n: int, what: str) -> str:
    return f"{'one' if n == 1 else n} {what}{'' if n == 1 else 's'}"
