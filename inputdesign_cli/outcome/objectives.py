"""Names of the kinds of objective of a result: in a summary, on a page, on an axis."""

from __future__ import annotations

from dataclasses import dataclass

from inputdesign_cli.outcome.design import White


@dataclass(frozen=True)
class Objective:
    """Holds the words for one `objective.kind`."""

    name: str  # of the value
    asked: str  # what the summary says was asked
    answer: str  # a sentence with a place for the value
    label: str = ""  # of the value on an axis, if that is not the name
    maximised: bool = False  # its bounds are from above
    white: str = "value"  # the entry of `baseline.white` to compare with
    spent: str = ""  # what white excitation that meets the same takes more of

    @property
    def axis(self) -> str:
        """Return the name of the value on an axis."""
        return self.label or self.name


_MOST = "the most information within the limits: "
_BEST = "The most informative experiment within the limits has "

OBJECTIVES = {
    "least_cost": Objective(
        "cost",
        "the cheapest experiment that meets the accuracy",
        "The cheapest experiment that meets the accuracy costs {}",
        white="cost",
        spent="cost",
    ),
    "shortest_experiment": Objective(
        "samples",
        "the shortest experiment that meets the accuracy",
        "The shortest experiment that meets the accuracy has {} samples",
        white="samples",
        spent="length",
    ),
    "accuracy_factor": Objective(
        "factor",
        "the smallest multiple of the admissible error that the limits allow",
        "Within the limits the error of the model can be kept to {} times the admissible error",
        label="factor on the admissible error",
    ),
    "D": Objective("log det M", f"{_MOST}log det M", f"{_BEST}log det M = {{}}", maximised=True),
    "A": Objective(
        "-trace M^-1", f"{_MOST}-trace of M^-1", f"{_BEST}-trace M^-1 = {{}}", "-trace M⁻¹", maximised=True
    ),
    "E": Objective(
        "smallest eigenvalue of M",
        f"{_MOST}smallest eigenvalue of M",
        f"{_BEST}a smallest eigenvalue of M of {{}}",
        maximised=True,
    ),
    "T": Objective("trace M", f"{_MOST}trace of M", f"{_BEST}trace M = {{}}", maximised=True),
    "closed_loop_error": Objective(
        "error of the loop",
        "the least error of the loop with the controller designed on the model",
        "The loop with the controller designed on the model errs least with this experiment: by {}, "
        "the number of samples times the excess mean square",
    ),
    "mean_squared_error": Objective(
        "mean squared error",
        "the least mean squared error",
        "The least mean squared error is {}",
        white="mean_squared_error",
    ),
}
UNKNOWN = Objective("value", "", "The value is {}")


def objective(kind: str | None) -> Objective:
    """Return the words for a kind; plain ones for a result without an objective."""
    return OBJECTIVES.get(kind or "", UNKNOWN)


# Labels of white excitation by default, and of white excitation that costs as much as the design.
WHITE = ("white", "white, same cost")


def white_labels(kind: str | None, white: White, samples: int) -> tuple[str, str]:
    """Return the labels of white excitation in curves: the baseline, and that with equal means.

    Args:
        kind: of the objective; None without one.
    """
    spent = objective(kind).spent
    if not spent:
        return ("white, same limits" if kind else WHITE[1]), WHITE[1]
    ratio = 1.0 if white.ratio is None else white.ratio
    if spent == "length":
        ratio = (white.samples or 0) / max(samples, 1)
    return f"white, {ratio:.3g} × the {spent}", f"white, same {spent}"
