"""Entries for a designed or given excitation: objective, accuracy, information, and its record."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.codec import others

if TYPE_CHECKING:
    from inputdesign_cli.information import PowerKind

Deviations = Mapping[str, float]
"""Standard deviations by the names of the parameters."""


@dataclass(frozen=True)
class Objective:
    """Holds the value that the delivered design attains, with proved bounds on all others.

    `value` is recomputed from the spectrum. `lower_bound` (`upper_bound` of a maximum) holds for this
    type of spectrum, `any_spectrum_bound` for every spectrum, `any_structure_bound` for all moments.
    """

    kind: str
    value: float
    lower_bound: float | None = None
    upper_bound: float | None = None
    relative_gap: float | None = None
    any_spectrum_bound: float | None = None
    any_structure_bound: float | None = None
    any_record_bound: float | None = None


@dataclass(frozen=True)
class Powers:
    """Holds mean squares of input, output and excitation, one for each channel."""

    input: tuple[float, ...] | None = None
    output: tuple[float, ...] | None = None
    excitation: tuple[float, ...] | None = None

    @classmethod
    def of(cls, powers: Mapping[PowerKind, Iterable[float]]) -> Powers:
        """Return powers from their values by kind; a kind that is none of these is left out."""
        kinds: tuple[PowerKind, ...] = ("input", "output", "excitation")
        return cls(*(tuple(powers[kind]) if kind in powers else None for kind in kinds))


@dataclass(frozen=True)
class Coverage:
    """Holds shares of estimates within r_adm with their 95 % limits, where alpha was calibrated.

    `exact` and `linear` are shares of `draws` from asymptotic theory, `kept` that of simulated `runs`.
    `asked` is the stated probability, and `chi_squared_alpha` the alpha that is replaced.
    """

    draws: int
    exact: float
    exact_limits: tuple[float, float]
    linear: float
    runs: int | None = None
    kept: float | None = None
    kept_limits: tuple[float, float] | None = None
    asked: float | None = None
    chi_squared_alpha: float | None = None
    excess: float | None = None


@dataclass(frozen=True)
class ModelError:
    """Holds the largest r_u/r_adm over frequency, its frequency (rad per time unit), and alpha of r_u."""

    alpha: float
    worst_ratio: float | None = None
    worst_frequency: float | None = None
    active_frequencies: Array | None = None
    confidence: Coverage | None = None


@dataclass(frozen=True)
class Loop:
    """Holds the controller of a loop and the margins kept; times in the user's unit, phase in degrees.

    `input_deviation` is the standard deviation of the input of this loop due to noise.
    """

    nominal_peak: float | None = None
    max_sensitivity: float | None = None
    gain_margin: float | None = None
    phase_margin: float | None = None
    input_deviation: float | None = None
    Kp: float | None = None
    Ti: float | None = None
    Td: float | None = None
    others: Mapping[str, object] = others()


@dataclass(frozen=True)
class RequirementMet:
    """Holds a requirement with its largest ratio to the admitted error (1: just met), and its frequency."""

    name: str
    worst_ratio: float
    frequency: float | None = None
    entry: str | None = None
    norm: str | None = None
    loop: Loop | None = None


@dataclass(frozen=True)
class Information:
    """Holds the information matrix (k, k) of the experiment in raw parameters, and its inverse."""

    parameters: tuple[str, ...]
    matrix: Array
    covariance: Array | None = None
    standard_deviation: Deviations | None = None


@dataclass(frozen=True)
class Spectrum:
    """Holds the type of a spectrum, and the numbers that describe a spectrum of that type."""

    type: str
    details: Mapping[str, object] = others()


@dataclass(frozen=True)
class White:
    """Holds white excitation that meets the same accuracy, or that exhausts the same limits."""

    cost: float | None = None
    power: Powers | None = None
    ratio: float | None = None
    samples: float | None = None
    value: float | None = None
    within_limits: bool | None = None
    excitation_power: float | None = None
    mean_squared_error: float | None = None


@dataclass(frozen=True)
class Baseline:
    """Holds the excitation that the design is compared with."""

    white: White | None = None


@dataclass(frozen=True)
class LimitUse:
    """Holds a limit with the part that the design uses.

    Limits on the density of a spectrum have a `kind`, a `worst_ratio` and its `frequency`.
    """

    name: str
    binding: bool
    channel: int | None = None
    max: float | None = None
    min: float | None = None
    value: float | None = None
    kind: str | None = None
    worst_ratio: float | None = None
    frequency: float | None = None


@dataclass(frozen=True)
class Solver:
    """Describes how the design was found."""

    method: str
    tolerance: float | None = None
    rounds: int | None = None
    cuts: int | None = None
    any_spectrum_gap: float | None = None
    ended_by: str | None = None
    details: Mapping[str, object] = others()


@dataclass(frozen=True)
class Rival:
    """Holds other parameters that explain data nearly as well: -2 log likelihood is `excess` higher.

    Their G differs by up to `ratio` times the `measure`, at `frequency` (rad per time unit).
    """

    theta: Mapping[str, float]
    excess: float
    ratio: float | None = None
    measure: str | None = None
    frequency: float | None = None


@dataclass(frozen=True)
class Foreseen:
    """Holds other minima of the likelihood of a simulated record of the design."""

    rivals: tuple[Rival, ...] = ()


Channels = tuple[float, ...]


@dataclass(frozen=True)
class Moves:
    """Holds the changes of a record of held values: their number, the largest, the shortest dwell (time)."""

    count: int
    largest: Channels
    shortest_dwell: float


@dataclass(frozen=True)
class Signal:
    """Holds sizes of the samples, an entry for each channel, and the accuracy of the samples themselves.

    `worst_ratio` is the largest ratio of the requirements. `of_limits` are the shares of limits on single
    samples that it uses. In `details`, `begun_anywhere` is the growth of its errors if the start is unknown
    (None without bound); it is absent if the start does not matter.
    """

    samples: int
    type: str | None = None
    sample_time: float | None = None
    power: Channels | None = None
    peak: Channels | None = None
    crest_factor: Channels | None = None
    input_power: Channels | None = None
    output_power: Channels | None = None
    input_peak: Channels | None = None
    input_move: Channels | None = None
    output_peak: Channels | None = None
    criterion: float | None = None
    efficiency: float | None = None
    worst_ratio: float | None = None
    extra_power: float | None = None
    spectrum_error: float | None = None
    limits: Mapping[str, tuple[float, float]] | None = None
    of_limits: Mapping[str, float] | None = None
    spectral_factor_residual: float | None = None
    operating_point: Channels | None = None
    wav_full_scale: float | None = None
    confidence: Coverage | None = None
    spectrum_of: Mapping[str, float] | None = None
    start_shift: float | None = None
    distance_to_best: float | None = None
    moves: Moves | None = None
    mean_squared_error: float | None = None
    details: Mapping[str, object] = others()


@dataclass(frozen=True)
class LossMoments:
    """Holds mean, standard deviation and (of runs) standard error of a loss."""

    mean: float
    sd: float
    standard_error: float | None = None


@dataclass(frozen=True)
class TheoreticalLoss:
    """Holds the error N E||y - y0||^2 of the model structure, and the moments of its root."""

    value: float
    loss: LossMoments


@dataclass(frozen=True)
class ActivePower:
    """Holds a power limit of the design, the attained power, and its multiplier."""

    power: str
    max: float
    attained: float
    channel: int | None = None
    multiplier: float | None = None


@dataclass(frozen=True)
class ClosedLoopError:
    """Holds the control law, the covariance used, and the theoretical loss; `band` in rad per time unit."""

    law: str
    covariance: str
    expected: float
    band: tuple[float, float]
    noise_model_part: float
    parametric: Mapping[str, TheoreticalLoss]
    limits: tuple[ActivePower, ...] = ()


@dataclass(frozen=True)
class MeanSquaredError:
    """Holds the error with its parts, squared bias and variance."""

    value: float
    bias_squared: float
    variance: float
    target: float | None = None
    others: Mapping[str, object] = others()


@dataclass(frozen=True)
class Moments:
    """Holds the matrix R (n, n) of the regressors: summed over the samples."""

    structure: str
    estimated: int
    trace: float
    R: Array
    entries: Mapping[str, float]
    autocorrelations: Array | None = None


@dataclass(frozen=True)
class Sensitivity:
    """Holds the derivatives of the value `of` with respect to the assumptions of the design."""

    of: str
    neglected_norm: float
    noise_deviation: float
    target: float | None = None
    energy: float | None = None


@dataclass(frozen=True)
class ObjectiveWords:
    """Holds the words for one `objective.kind`."""

    name: str  # name of the value
    asked: str  # the question in the summary
    label: str = ""  # name of the value on an axis, if another
    maximised: bool = False  # its bounds are upper bounds
    white: str = "value"  # the entry of `baseline.white` to compare with
    spent: str = ""  # the quantity that white excitation needs more of for the same accuracy

    @property
    def axis(self) -> str:
        """Return the name of the value on an axis."""
        return self.label or self.name


_MOST = "the most information within the limits: "

OBJECTIVES = {
    "least_cost": ObjectiveWords(
        "cost", "the cheapest experiment that meets the accuracy", white="cost", spent="cost"
    ),
    "shortest_experiment": ObjectiveWords(
        "samples", "the shortest experiment that meets the accuracy", white="samples", spent="length"
    ),
    "accuracy_factor": ObjectiveWords(
        "r_u / r_adm",
        "the least model error within the limits, as a multiple of the admissible error (below 1: enough)",
        label="factor on the admissible error",
    ),
    "D": ObjectiveWords("log det M", f"{_MOST}log det M", maximised=True),
    "A": ObjectiveWords("-trace M^-1", f"{_MOST}-trace M^-1", "-trace M⁻¹", maximised=True),
    "E": ObjectiveWords("smallest eigenvalue of M", f"{_MOST}smallest eigenvalue of M", maximised=True),
    "T": ObjectiveWords("trace M", f"{_MOST}trace M", maximised=True),
    "closed_loop_error": ObjectiveWords(
        "error of the loop", "the least error of the loop with the controller designed on the model"
    ),
    "mean_squared_error": ObjectiveWords(
        "mean squared error", "the least mean squared error", white="mean_squared_error"
    ),
}
UNKNOWN = ObjectiveWords("value", "")


def objective(kind: str | None) -> ObjectiveWords:
    """Return the words for a kind; plain ones for a result without an objective."""
    return OBJECTIVES.get(kind or "", UNKNOWN)


# Labels of white excitation by default, and of white excitation that costs as much as the design.
WHITE = ("white", "white, same cost")


def white_labels(kind: str | None, white: White, samples: int) -> tuple[str, str]:
    """Return the labels of white excitation in curves: the baseline, and the one at equal cost or length.

    Args:
        kind: the kind of the objective; None without one.
    """
    spent = objective(kind).spent
    if not spent:
        return ("white, same limits" if kind else WHITE[1]), WHITE[1]
    ratio = 1.0 if white.ratio is None else white.ratio
    if spent == "length":
        ratio = (white.samples or 0) / max(samples, 1)
    return f"white, {ratio:.3g} × the {spent}", f"white, same {spent}"
