"""Pick the samples of data that are whole periods of a design, with gaps or without."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.frequency_responses import periods_between_gaps, samples_before_periods
from inputdesign_cli.identification.periodic_response import PeriodicResponse, Periods, periodic_response
from inputdesign_cli.records import Record


@dataclass(frozen=True)
class Counted:
    """Data that count, how they repeat, the number of records of equal length, and what is left out."""

    data: Record
    periods: Periods
    repeats: int
    findings: tuple[Finding, ...] = ()

    @property
    def kept(self) -> int:
        """Periods of one phase that count, in all records."""
        return self.repeats * self.periods.kept(self.data.lengths[0])

    def response(self, harmonics: NDArray[np.int_]) -> PeriodicResponse | None:
        """Return the response at harmonics (L,); None if the inputs are alike there."""
        data = self.data
        return periodic_response(data.u, data.y, self.periods, harmonics, repeats=self.repeats)


def whole_periods(stated: Periods, data: Record, name: str, step: float) -> Counted:
    """Return the data that count.

    Records of equal length are not changed. Of pieces between gaps, and of records of several lengths, the
    periods that lie in one piece are taken. All have the same phase, counted from the begin of each file:
    the one with the most periods.

    Args:
        name: of the file that messages name.
        step: the sample time, in the unit of the times of the data.

    Raises:
        DataError: `bad-period`, `too-few-samples`.
    """
    lengths, length = set(data.lengths), data.lengths[0]
    whole = stated.blocks * stated.period
    if len(lengths) == 1 and len(data.files) == len(data.lengths):
        if stated.blocks == 1 or length % whole == 0:
            _check(stated.kept(length), stated.kept(length) * len(data.lengths), stated, name)
            return Counted(data, stated, len(data.lengths), tuple(samples_before_periods(length, stated)))
    elif stated.blocks == 1:
        return _from_pieces(stated, data, name, step)
    what = " and ".join(str(one) for one in sorted(lengths))
    raise DataError.because(
        "bad-period",
        f"{name} has stretches of {what} samples, and the design has {stated.blocks} blocks of "
        f"whole periods of {stated.period}",
        hint="cut every record to the length of signal.csv (--skip, --range), and close gaps",
    )


def _from_pieces(stated: Periods, data: Record, name: str, step: float) -> Counted:
    """Return one record of the periods without a gap."""
    period, places = stated.period, _places(data, step)
    transient = stated.skip * period
    follow = np.ones(len(places), dtype=bool)
    follow[np.cumsum(data.lengths)[:-1]] = False
    gaps = np.cumsum(~follow)
    last = np.arange(len(places)) + period - 1
    begins = np.flatnonzero((last < len(places)) & (places >= transient))
    begins = begins[gaps[last[begins]] == gaps[begins]]
    taken: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
    if begins.size:
        phase = int(np.argmax(np.bincount(places[begins] % period)))
        taken = begins[places[begins] % period == phase]
    _check(taken.size, taken.size, stated, name)
    samples = (taken[:, None] + np.arange(period)).ravel()
    kept = data.at(samples, (len(samples),))
    left_out = periods_between_gaps(len(data.lengths), taken.size, period)
    return Counted(kept, replace(stated, skip=0), 1, (left_out,))


def _places(data: Record, step: float) -> NDArray[np.int64]:
    """Return the number (N,) of samples between the begin of a file and each of its samples."""
    files = np.split(data.time, np.cumsum([count for _, count in data.files])[:-1])
    return np.concatenate([np.round((part - part[0]) / step) for part in files]).astype(np.int64)


def _check(each: int, together: int, stated: Periods, name: str) -> None:
    """Check that enough periods count, in a block and in all records.

    Raises:
        DataError: `too-few-samples`.
    """
    if each < 1 or together < 2:
        raise DataError.because(
            "too-few-samples",
            f"{name} has {max(each, 0)} whole periods of {stated.period} samples after {stated.skip} that "
            "are transient: the noise is estimated from the scatter of two or more",
            hint="record more periods, or give several records",
        )
