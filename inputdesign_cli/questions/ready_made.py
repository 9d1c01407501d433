"""Make signals that need no spec as records with units, and measure the frequencies that they excite."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.outcome import Outcome, Signal
from inputdesign_cli.outcome.curves import Curves, SpectrumCurves
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.signal_outcome import signal_results
from inputdesign_cli.signal.harmonic_grid import TooFewHarmonicsError
from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.signal.prbs import register_length
from inputdesign_cli.signal.ready_made import equal_lines, excites, scaled
from inputdesign_cli.signal.settings import SignalSettings
from inputdesign_cli.specification.models.sizes import SIZES

_DEFAULT_SAMPLES = 1000


@dataclass(frozen=True)
class ReadyMade:
    """Describes the signal that is asked for."""

    kind: str
    bits: int | None = None  # register length of a prbs; None: enough for the samples without repetition
    number: int | None = None  # number of lines of a multisine, or of levels of steps
    band: tuple[float, float] | None = None  # in rad per time unit; None: all frequencies
    samples: int | None = None  # None: one period, or 1000
    levels: tuple[tuple[float, float], ...] = ((-1.0, 1.0),)  # least and largest value of each input
    hold: int = 1  # samples for which each value stands
    periods: int = 1  # number of equal periods
    odd: bool = False
    seed: int = 0
    sample_time: float = 1.0
    time_unit: str = "s"

    @property
    def inputs(self) -> int:
        """Return the number of inputs."""
        return len(self.levels)


def make_signal(asked: ReadyMade) -> Results:
    """Return the record as signal.csv, its figures, and the band and order of its excitation.

    Raises:
        SpecError: `too-few-lines`, `bad-period`, `not-supported`, `beyond-nyquist`.
    """
    u, period = _made(asked)
    moved = u - u.mean(axis=0)
    rank = int(np.linalg.matrix_rank(moved.T @ moved, hermitian=True))
    if rank == 0:
        message = f"over {len(u)} samples the signal keeps one value, so that it excites nothing"
        raise bad_spec("bad-period", message, hint="take more --samples, a shorter --hold, or a wider --band")
    if rank < asked.inputs:
        bits = (asked.inputs + 1).bit_length()
        longer = f"--prbs {bits} or more" if asked.kind == "prbs" else "more levels"
        raise bad_spec(
            "bad-period",
            f"of {asked.inputs} inputs over {len(u)} samples, {asked.inputs - rank} follow from the others, "
            "so that their effects could not be separated",
            hint=f"write {longer}, and --samples enough for them",
        )
    record = scaled(u, asked.levels)
    units = Units(asked.time_unit, asked.sample_time, True, False, asked.inputs, 0)
    channels = {
        f"u{i + 1}": {
            "mean": one.mean,
            "power": one.power,
            "peak": one.peak,
            "crest_factor": one.crest_factor,
            "order_of_excitation": one.order,
            "band": [edge / asked.sample_time for edge in one.band],
        }
        for i, one in enumerate(excites(record))
    }
    details = {"period": period, "time_unit": asked.time_unit, "channels": channels}
    signal = Signal(len(record), asked.kind, asked.sample_time, details=details)
    table, curves = signal_results(units, record)
    shown: dict[str, Curves] = {"signal": curves, "spectrum": _lines(asked, record)}
    return Results(Outcome(status="made", signal=signal), "", asked.time_unit, {"signal": table}, shown)


def _made(asked: ReadyMade) -> tuple[Array, int]:
    """Return the record (N, inputs) from -1 to 1, and its period."""
    r, bits, period = asked.inputs, asked.bits, asked.samples or _DEFAULT_SAMPLES
    if asked.kind == "prbs":
        bits = bits or register_length(-(-period // asked.hold))
        period = asked.hold * (2**bits - 1)
    samples = asked.samples or period
    _check_size(max(samples, asked.hold), r, whole_period=bits is not None and asked.samples is None)
    settings = SignalSettings(asked.kind, phases="even", bits=bits, number=asked.number, seed=asked.seed)
    blocks = kind_of(asked.kind).blocks(settings, r)
    _check_kind(asked, samples, asked.hold * asked.periods * blocks)
    values = -(-samples // (asked.hold * asked.periods))
    try:
        one = equal_lines(settings, values, r, _band(asked), asked.number, odd=asked.odd)
    except TooFewHarmonicsError as error:
        raise bad_spec(
            "too-few-lines",
            f"the band has {error.there} harmonics of {values // blocks} values, not {asked.number or 1}",
            hint="take more --samples, a wider --band, or fewer lines",
        ) from None
    u = np.tile(np.repeat(one, asked.hold, axis=0), (asked.periods, 1))[:samples]
    return u, min(period, samples) // asked.periods


def _check_kind(asked: ReadyMade, samples: int, whole: int) -> None:
    """Raise `SpecError` if the kind makes no signal of these samples, or none of multiples of `whole`."""
    kind = kind_of(asked.kind)
    if asked.inputs > 1 and not kind.several:
        raise bad_spec(
            "not-supported",
            f"a signal of kind {asked.kind} moves one input, and cannot separate effects of several",
            hint="use a multisine for several inputs, or one signal after the other",
        )
    turn = math.ceil(4.0 * math.pi / sum(_band(asked))) * whole
    if asked.kind == "chirp" and samples < turn:
        raise bad_spec(
            "bad-period",
            f"over {samples // asked.periods} samples the chirp makes less than one turn: it misses its band",
            hint=f"write --samples {turn} or more, a wider band or a longer --sample-time",
        )
    if asked.kind == "steps" and asked.number is not None and asked.number > samples:
        raise bad_spec(
            "too-large",
            f"{asked.number} levels are more than the {samples} samples",
            hint=f"write at most --steps {samples}, or more --samples",
        )
    if (not kind.flat or asked.periods > 1) and (samples % whole or samples // whole < 3):
        each = f" for each of {asked.inputs} inputs" if asked.inputs > 1 else ""
        raise bad_spec(
            "bad-period",
            f"{samples} samples do not make {asked.periods} equal periods{each}",
            hint=f"write --samples {max(samples // whole, 3) * whole}",
        )


def _check_size(samples: int, inputs: int, *, whole_period: bool = False) -> None:
    """Raise `SpecError` (`too-large`) for records that would take too much time or memory."""
    size = SIZES["samples of a ready-made signal"]
    fit = size.most // inputs
    if samples <= fit:
        return
    each = f" for each of {inputs} inputs" if inputs > 1 else ""
    raise bad_spec(
        "too-large",
        f"the signal has {samples} samples{each}, and {fit} fit: {size.why}",
        hint=f"write {'fewer --prbs BITS, a shorter --hold, or ' * whole_period}--samples {fit} at most",
    )


def _band(asked: ReadyMade) -> tuple[float, float]:
    """Return the band in rad per value, all frequencies where none is asked for."""
    lo, hi = asked.band or (0.0, math.inf)
    nyquist = math.pi / asked.sample_time / asked.hold
    if asked.band is not None and hi > nyquist * (1 + 1e-4):
        raise bad_spec(
            "beyond-nyquist",
            f"the band reaches {hi:g}, beyond the Nyquist frequency {nyquist:.6g} rad/{asked.time_unit}",
            hint="frequencies are in rad per time unit and end at pi / sample time / hold",
        )
    return math.pi * lo / nyquist, math.pi * min(hi / nyquist, 1.0)


def _lines(asked: ReadyMade, record: Array) -> Curves:
    """Return the powers of the lines of the record without its means."""
    columns = np.fft.rfft(record - record.mean(axis=0), axis=0)[1:] / len(record)
    powers = 2.0 * np.abs(columns) ** 2
    if len(record) % 2 == 0:
        powers[-1] *= 0.5
    kept = np.any(powers > 1e-9 * powers.max(initial=1e-300), axis=1)
    w = 2.0 * np.pi * np.arange(1, len(powers) + 1) / len(record) / asked.sample_time
    diagonal = np.einsum("lr,rs->lrs", powers[kept], np.eye(record.shape[1])).astype(complex)
    return SpectrumCurves(w[kept], diagonal, lines=True)
