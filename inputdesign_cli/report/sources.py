"""What the numbers of a run rest on, and whose methods gave them."""

from __future__ import annotations

from inputdesign_cli.outcome import Outcome
from inputdesign_cli.report.question import Question

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
_SCENARIOS = (
    "M. C. Campi and S. Garatti, The exact feasibility of randomized solutions of uncertain convex programs, "
    "SIAM Journal on Optimization 19 (2008) 1211-1230.",
    "M. C. Campi and S. Garatti, Wait-and-judge scenario optimization, Mathematical Programming 167 (2018) "
    "155-189.",
)
_FREQUENCY_RESPONSE = (
    "R. Pintelon and J. Schoukens, System Identification: A Frequency Domain Approach, second edition, "
    "Wiley, 2012: frequency responses from periodic excitation."
)
_PREDICTION_ERROR = (
    "L. Ljung, System Identification: Theory for the User, second edition, Prentice Hall, 1999: prediction "
    "errors and their asymptotic covariance."
)


def assumptions(question: Question, outcome: Outcome) -> list[str]:
    """What the numbers rest on, beyond the arithmetic."""
    rests = "The design is best" if outcome.objective is not None else "The figures hold"
    if outcome.frequency_response is not None and outcome.frequency_response.method:
        said = [
            "The plant is linear and in steady state; the noise is that which the scatter of the data tells."
        ]
    elif outcome.identification is not None:
        from_spec = "Orders and delay are those of the spec; the numbers were estimated from the data."
        chosen = "Orders and delays were chosen by what estimates from one part simulate of the other."
        said = [chosen if outcome.exploration is not None else from_spec]
    elif outcome.robust is not None:
        said = [
            f"The plant is as the uncertainty of the spec describes it. {rests} for the plants that were "
            "drawn from it or listed; shares of other plants are those of plants drawn in the same way. If "
            "the description is wrong nothing is said: none of this is a statement about the true plant."
        ]
    else:
        said = [
            f"The plant and the noise are as the spec has them. {rests} for this nominal system; the "
            "accuracy of a model of another system may differ."
        ]
    if outcome.model_error is not None and outcome.model_error.worst_ratio is not None:
        first = " and of first order in the parameters" if question.linearised else ""
        said.append(
            "The covariance of the estimate is the asymptotic one of a consistent and efficient estimate; "
            f"r_u is therefore asymptotic in the number of samples{first}."
        )
    found = outcome.objective
    if found is not None and (found.lower_bound is not None or found.upper_bound is not None):
        said.append(
            "The proved bounds are values of dual points, computed in double precision; they hold to the "
            "rounding of integrals and eigenvalues, and of maxima over frequency sought on a refined grid."
        )
    if question.closed_loop:
        said.append(
            "Powers are those that the excitation r adds to the normal operation of the loop; what the noise "
            "causes anyway is not counted."
        )
    if outcome.signal is not None and outcome.signal.worst_ratio is not None:
        said.append(
            "The worst ratio of the signal is computed from the very samples of signal.csv, which start "
            "from rest; the spectrum's own figures hold for a stationary signal of that spectrum."
        )
    if outcome.solver is not None and outcome.solver.method == "lmi":
        said.append("The accuracy was imposed on a grid of frequencies: between them it may be violated.")
    return said


def citations(question: Question, outcome: Outcome) -> list[str]:
    """The sources of the methods that were used."""
    kind = None if outcome.objective is None else outcome.objective.kind
    cited = []
    lines = "frequency_response" in question.asked
    if lines:
        cited.append(_FREQUENCY_RESPONSE)
    if kind in ("least_cost", "shortest_experiment") and not question.regression and not lines:
        cited.append(_LEAST_COSTLY)
    if "closed_loop_error" in question.asked:
        cited.append(_ASYMPTOTIC)
    if "mean_squared_error" in question.asked:
        cited.append(_MEAN_SQUARED)
    if question.family == "polynomial":
        cited.append(_SPECTRAL)
    if outcome.robust is not None and outcome.robust.risk is not None:
        cited += _SCENARIOS
    if outcome.objective is not None and outcome.objective.any_spectrum_bound is not None:
        cited.append(_EQUIVALENCE)
    if not question.regression and not lines:
        cited.append(_PREDICTION_ERROR)
    return cited
