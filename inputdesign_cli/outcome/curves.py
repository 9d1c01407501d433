"""Content of figures: plain data, nothing to compute; `figures.plots` draws each kind.

Frequencies are in rad per time unit, spectra in the convention of the contract (power = integral over the
normalised circle / 2 pi).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


class Curves:
    """Holds the content of one figure; `figures.plots` draws each kind."""


# Users write frequencies with about three digits: one within this share of a line stands for the line.
_SAME_LINE = 1e-3


def _room(frequency: Array) -> Array:
    """Return the frequency of each line, or its distance to the next one where that is less, (n,)."""
    apart = np.abs(frequency[:, None] - frequency)
    np.fill_diagonal(apart, np.inf)
    return np.minimum(frequency, apart.min(axis=1))


@dataclass(frozen=True)
class SpectrumCurves(Curves):
    """Holds the spectrum of r inputs over frequency: a density, or the powers of sinusoids."""

    frequency: Array  # (n,) rad per time unit
    spectrum: NDArray[np.complex128]  # (n, r, r), Hermitian; real powers will do
    white: float | None = None  # density of the white baseline; for the sinusoids of one input, its power
    lines: bool = False
    symbol: str = "u"  # the signal: "u" in open loop, "r" in closed loop
    record: Array | None = None  # (n, r), smoothed periodograms of the record
    band: tuple[float, float] | None = None  # the band in which sinusoids may lie
    label: str = "design"  # source of the spectrum

    @property
    def phi(self) -> Array | NDArray[np.complex128]:
        """Return the spectrum at `frequency`: (n,) of one input, else (n, r, r)."""
        single = self.spectrum.shape[1:] == (1, 1)
        return np.asarray(self.spectrum[:, 0, 0].real) if single else self.spectrum

    def __call__(self, w: ArrayLike) -> NDArray[np.complex128]:
        """Return the spectrum (.., r, r) at frequencies `w`, a number or an array (..), in rad per time unit.

        A density is interpolated between the frequencies of spectrum.csv. Sinusoids have their power at their
        lines, and zero between them. A frequency stands for a line if their distance is at most a
        thousandth of that frequency, and of the distance to the next line.
        """
        stated = np.asarray(w, dtype=float)
        at, shape = stated.ravel(), (*stated.shape, *self.spectrum.shape[1:])
        if self.lines:
            nearest = np.abs(self.frequency - at[:, None]).argmin(axis=1)
            on = np.abs(self.frequency[nearest] - at) <= _SAME_LINE * _room(self.frequency)[nearest]
            powers = np.where(on[:, None, None], self.spectrum[nearest], 0.0)
            return powers.reshape(shape).astype(complex)
        flat = self.spectrum.reshape(len(self.frequency), -1)
        columns = [np.interp(at, self.frequency, column, left=0.0, right=0.0) for column in flat.T]
        return np.stack(columns, axis=1).reshape(shape).astype(complex)


@dataclass(frozen=True)
class DirectionCurves(Curves):
    """Holds the plant's gains in its principal directions, and the input's power in each of them."""

    frequency: Array  # (n,)
    gain: Array  # (n, inputs), singular values of G, largest first
    power: Array  # (n, inputs), power of the input along the right singular vectors
    white: float | None = None
    lines: bool = False


@dataclass(frozen=True)
class RunCurves(Curves):
    """Holds a number of each run, by input or strategy: a loss, or the largest r_u/r_adm of the true plant.

    `limit` is the required upper limit of the ratio, and `theory` has the mean of a loss in theory.
    """

    values: Mapping[str, Array]  # name -> (runs,)
    theory: Mapping[str, float] = field(default_factory=dict)
    limit: float | None = None


@dataclass(frozen=True)
class Panel:
    """Holds curves over frequency that belong to one entry of G, or to the norm of all."""

    frequency: Array
    entry: tuple[int, int] | None = field(default=None, kw_only=True)  # output and input, from zero
    names: str = field(default="", kw_only=True)  # names of input and output, if the user gave them


@dataclass(frozen=True)
class BoundPanel(Panel):
    """Holds model error and admissible error over frequency, of one entry of G; all arrays (n,)."""

    r_u: Array
    G_abs: Array
    r_adm: Array | None = None
    r_u_white: Array | None = None  # for white excitation at the same accuracy or the same limits
    active: Array = field(default_factory=lambda: np.zeros(0))  # frequencies where r_u touches r_adm
    r_u_record: Array | None = None  # for the samples of the record
    label: str = "design"  # source of r_u
    r_u_equal: Array | None = None  # for white excitation with the cost, or the length, of the design
    white_labels: tuple[str, str] = ("white", "white, same cost")  # names of r_u_white and r_u_equal


@dataclass(frozen=True)
class BoundCurves(Curves):
    """Holds model error and admissible error, entry by entry, of one of several plants or the only one."""

    panels: tuple[BoundPanel, ...]
    of_several: bool = False


@dataclass(frozen=True)
class NyquistCurves(Curves):
    """Holds the loop gain C G of one channel over frequency, and its error discs by r_u; arrays (n,)."""

    frequency: Array
    loop: NDArray[np.complex128]
    radius: Array  # |C| r_u
    circle: float | None = None  # required distance from -1, if it is constant
    limiting: Array = field(default_factory=lambda: np.zeros(0))  # frequencies where r_u touches r_adm


@dataclass(frozen=True)
class ResponsePanel(Panel):
    """Holds an entry of G from data alone, the radius of its confidence disc, and a model's; all (n,)."""

    G: NDArray[np.complex128]
    radius: Array
    model: NDArray[np.complex128]


@dataclass(frozen=True)
class ResponseCurves(Curves):
    """Holds the frequency response without a model beside that of a model, entry by entry."""

    panels: tuple[ResponsePanel, ...]


@dataclass(frozen=True)
class DeviationPanel(Panel):
    """Holds standard deviations of an entry of G at lines, and the admitted ones; all (n,)."""

    G_abs: Array
    r_adm: Array
    deviation: Array
    found: Array | None = None  # deviations of data or of simulated experiments
    label: str = ""  # source of `found`


@dataclass(frozen=True)
class DeviationCurves(Curves):
    """Holds standard deviations of a frequency response, entry by entry."""

    panels: tuple[DeviationPanel, ...]


@dataclass(frozen=True)
class OptimalityCurves(Curves):
    """Holds the equivalence-theorem ratio over frequency: at most one, and one on the support.

    `within` is the ratio for the bound over all records within an amplitude, and `record_bound` its value.
    """

    frequency: Array
    ratio: Array
    support: Array
    within: Array | None = None
    record_bound: float | None = None


@dataclass(frozen=True)
class FanCurves(Curves):
    """Holds r_u / r_adm over frequency at many plants; for several entries of G, the largest."""

    frequency: Array  # (n,)
    ratios: Array  # (plants, n)
    nominal: Array  # (n,)
    active: Mapping[str, Array]  # the plants that bind, by name -> (n,)


@dataclass(frozen=True)
class CampaignCurves(Curves):
    """Holds the worst ratio at the estimate and the energy applied, after each of `samples`; all (n,)."""

    samples: Array
    ratio: Array
    energy: Array
    end: int  # samples after which the campaign is over


@dataclass(frozen=True)
class EstimateCurves(Curves):
    """Holds estimates and standard deviations by name, after each of `samples`; all arrays (n,)."""

    samples: Array
    estimates: Mapping[str, Array]
    deviations: Mapping[str, Array]


@dataclass(frozen=True)
class TradeCurves(Curves):
    """Holds the cost relative to the design that knows the plant, and the share of runs within r_adm.

    A point has, for one strategy, mean, 5 % and 95 % quantiles of the cost, and the share with its 95 %
    limits. `record` is the cost of the record of the design that knows the plant.
    """

    points: Mapping[str, tuple[float, float, float, float, float, float]]
    record: float | None = None


@dataclass(frozen=True)
class Ellipse:
    """Holds the predicted confidence region of a pair of parameters: values and (2, 2) covariances.

    `estimates` (runs, 2) come from simulated experiments, with the truth at the center.
    """

    names: tuple[str, str]
    center: Array  # (2,)
    covariance: Array
    white: Array | None = None  # covariance with white excitation within the same limits
    estimates: Array | None = None


@dataclass(frozen=True)
class EllipseCurves(Curves):
    """Holds confidence ellipses of some pairs, all at one `probability`."""

    pairs: tuple[Ellipse, ...]
    probability: float = 0.95


@dataclass(frozen=True)
class ErrorBandPanel(Panel):
    """Holds quantiles over many runs of |G_hat - G_0| over frequency, and the prediction; arrays (n,)."""

    quantiles: Mapping[float, Array]  # probability -> (n,)
    r_u: Array | None = None
    r_adm: Array | None = None


@dataclass(frozen=True)
class ErrorBandCurves(Curves):
    """Holds the errors of the models of `runs` experiments with the input `name`, entry by entry."""

    panels: tuple[ErrorBandPanel, ...]
    name: str = "design"
    runs: int = 0


@dataclass(frozen=True)
class FitPanel:
    """Holds a recorded output, its one-step prediction and its simulation from the input; arrays (n,).

    `left_out` are the samples (m,) of the output that the estimate does not use.
    """

    y: Array
    predicted: Array
    simulated: Array | None = None
    fit: float | None = None  # per cent
    output: int = 0  # from zero
    label: str = ""  # its name and unit, where there are any
    left_out: Array | None = None


@dataclass(frozen=True)
class FitCurves(Curves):
    """Holds the fit of a model to the data of its estimate, output by output, over `time` (n,).

    `left_out` are the times (m,) of samples that the estimate does not use.
    """

    time: Array
    panels: tuple[FitPanel, ...]
    lengths: tuple[int, ...] = ()  # samples of each record, one after the other; empty for one
    left_out: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class ResidualCurves(Curves):
    """Holds normalised correlations of p residuals with each other and with r past inputs, over lags.

    `whiteness` and `independence` are the probabilities of the two tests.
    """

    lags: Array  # (n,)
    autocorrelation: Array  # (n, p, p)
    input_lags: Array  # (m,)
    cross_correlation: Array  # (m, p, r)
    limit: float
    whiteness: float
    independence: float


@dataclass(frozen=True)
class OrderCurves(Curves):
    """Holds the fit of structures to data, `unseen` or their own, over the number of parameters."""

    fits: Mapping[str, tuple[Array, Array]]  # family -> numbers of parameters, per cent
    chosen: tuple[float, float]
    output: int | None = None  # from zero; None: the only one
    unseen: bool = True


@dataclass(frozen=True)
class PredictedPanel:
    """Holds the response from rest to the record at an output, or in a loop at an input; arrays (n,)."""

    name: str  # "y1"
    values: Array
    deviation: Array  # standard deviation of the noise there
    limits: tuple[float, float] | None = None
    label: str = ""  # its name and unit, where there are any
    applied: bool = False  # an input, at its operating point; outputs are counted from rest


@dataclass(frozen=True)
class SignalCurves(Curves):
    """Holds the record to be applied: `time` (n,), an array (n,) for each channel, and the predictions."""

    time: Array
    channels: Mapping[str, Array]  # "u1" -> samples (closed loop: "r1")
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # "u1" -> least, largest value
    labels: Mapping[str, str] = field(default_factory=dict)  # "u1" -> its name and unit, where there are any
    predicted: tuple[PredictedPanel, ...] = ()
    held: bool = True  # each value is held until the next
    levels: bool = False  # channels include an operating point; their effects are counted from rest
    moves: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # "u1" -> largest move, its limit


@dataclass(frozen=True)
class ErrorCurves(Curves):
    """Holds the mean squared error of moments of one shape over the energy; all arrays (n,)."""

    energy: Array
    bias_squared: Array
    variance: Array
    white: Array  # error with white regressors of that energy
    design: tuple[float, float]  # energy and error of the design
    target: float | None = None


@dataclass(frozen=True)
class MomentsCurves(Curves):
    """Holds the moments of regressors, and the lines of the periodic input that has them (for one input)."""

    R: Array  # (n, n)
    estimated: int  # number of them that are estimated
    line_frequency: Array | None = None  # (L,) rad per time unit, from 0 on
    line_power: Array | None = None  # (L,) mean squares
    nyquist: float = np.pi
