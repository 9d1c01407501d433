"""When the limits on single samples leave too little power: the shortest record that can be found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import scipy

from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.questions.common.record import Made
from inputdesign_cli.signal.selection import LONG, Record

# Lengths that are looked into: times the one that was asked for, or that many samples.
_LONGEST, _AT_LEAST = 64, 20_000
_LEAP, _DOUBLE = 8.0, 2.0
# The ratio of so few samples predicts nothing for more of them: they may be less than a dead time.
_FEW = 100
_GROWTH, _MOST_GROWTHS = 1.03, 100.0
_FAR = 1.5
_FINE, _STEP = 0.01, 0.009
_LENGTHS = 24
_FALLS = 0.9  # of the length that seemed to be needed before
_BEYOND = 1.25  # times the longest that is looked for: not to be made up for by chance
# A way that missed nearby, and by so much, is not tried: other phases change a ratio by less as a rule.
_NEARBY, _HOPELESS, _HOPELESS_LONG = 1.2, 1.15, 1.01
# A long record takes seconds to make. Its ratio follows from that of a pilot, a record of a share of its
# samples with at least the fewest: information grows with the length, and luck averages out.
_PILOT, _FEWEST = 16, 1000
_MARGIN = 1.005
# Whether a record meets is a matter of luck near the shortest: so far below one that does all are tried.
_BELOW = (0.96, 0.9)


class Way(Protocol):
    """A kind of signal with a rule for its spectrum."""

    def __call__(self, samples: int, spectrum_of: int | None = None) -> Made | None:
        """The first record of a length that is found to meet the accuracy, else the best of some, if any.

        Args:
            spectrum_of: the length for which the spectrum is designed, if that differs.
        """


def reach(record: Record, before: float = np.inf) -> float:
    """Return the length that a record needs if its information grows in proportion to its length.

    Args:
        before: the worst ratio without it.
    """
    if not np.isfinite(record.worst_ratio):
        return _DOUBLE * len(record.samples)
    known = before**-2.0
    gain = record.worst_ratio**-2.0 - known
    return len(record.samples) * (1.0 - known) / gain if gain > 0.0 else np.inf


def pilot_length(samples: int, block: int) -> int:
    """Return the length of the short record that predicts the ratio of one of `samples` samples."""
    return -(-max(samples // _PILOT, _FEWEST) // block) * block


def longest_search(asked: int, most: int | None, longest: int) -> int:
    """Return the longest length that is tried if records of `asked` samples miss."""
    return min(max(_LONGEST * asked, _AT_LEAST, most or 0), longest)


@dataclass
class ShortestRecord:
    """The search for the shortest record, by trying lengths in several ways.

    Of a long record only the most promising way is tried at a length, by what all tries so far showed.

    Args:
        ways: what is tried at a length, until a record meets the accuracy.
        block: lengths are multiples of this.
        longest: samples of the longest that is looked for.
        before: the worst ratio without any record.
    """

    ways: Sequence[Way]
    block: int
    longest: int
    before: float = np.inf
    inputs: int = 1  # each has as long a part of a period
    needed: float = 0.0  # samples that would do, by the records that missed
    _missed: dict[int, Record] = field(default_factory=dict)  # by way, its latest
    _tried: set[tuple[int, int]] = field(default_factory=set)  # ways and lengths
    _found: Made | None = None
    _low: int = 0
    _high: int = 0
    _lengths: int = 0

    def search(self, misses: Sequence[Record], low: int | None = None) -> Made | None:
        """The shortest record that meets the accuracy, to one per cent; None when none is found.

        Out of time, the shortest so far.

        Args:
            misses: records that missed.
            low: the length from which on longer ones are looked for, that of the first miss when None.

        Raises:
            OutOfTimeError: before one is found.
        """
        self._low = low or len(misses[0].samples)
        self.needed = min(map(self._reach, misses))
        if self._low > LONG:
            self._try_pilots(misses[0])
        try:
            self._lengthen()
            if self._found is not None:
                self._shorten()
                self._try_below()
        except OutOfTimeError:
            if self._found is None:
                raise
        return self._found

    def _try_pilots(self, first: Record) -> None:
        """Make a short record in each way, so that the most promising one of a long record is known.

        Args:
            first: that of the first way, if it is as long.
        """
        length = pilot_length(self._low, self.block)
        for number, way in enumerate(self.ways):
            if number == 0 and len(first.samples) == length:
                self._missed[number] = first
                continue
            made = way(length, max(self._low, self._rounded(min(self.needed, self.longest))))
            if made is not None and made.record is not None:
                self._missed[number] = made.record
                self.needed = min(self.needed, self._reach(made.record))

    def _lengthen(self) -> None:
        """Try ever longer records until one meets the accuracy, or none is worth trying."""
        while self._found is None and self._lengths < _LENGTHS:
            low = self._low
            # An estimate of the needed length that was repeatedly too low is no guide.
            least, margin = (_MARGIN, _MARGIN) if low > LONG else (_GROWTH, 1.0)
            growth = min(least ** min(2.0**self._lengths, _MOST_GROWTHS), _LEAP)
            self._high = self._rounded(
                min(max(margin * self.needed, growth * low), _LEAP * low, self.longest)
            )
            if self._high <= low:
                return
            self._lengths += 1
            self._found = self._met(self._high)
            if self._found is None:
                before, self._low = self.needed if self._lengths > 1 else np.inf, self._high
                self.needed = min(map(self._reach, self._missed.values()), default=self._high)
                # Records shorter than what the plant remembers promise far less than longer ones keep.
                if self._low >= _FEW and self.needed > max(_BEYOND * self.longest, _FALLS * before):
                    return

    def _shorten(self) -> None:
        """Narrow the interval between a length that misses and the one found to one per cent."""
        step = _STEP
        while self._high - self._low > max(_FINE * self._high, self.block) and self._lengths < _LENGTHS:
            self._lengths += 1
            low, high = self._low, self._high
            middle = np.sqrt(low * high) if high > _FAR * low else 0.5 * (low + high)
            if high > LONG:  # the first length was chosen by what is needed: it is hardly too long
                middle, step = max(middle, (1.0 - step) * high), min(2.0 * step, 1.0)
            whole = int(np.ceil(middle / self.block)) * self.block
            middle = self._rounded(middle) if self._rounded(middle) < high else whole
            if middle in (low, high):
                return
            tried = self._met(middle)
            if tried is None:
                self._low = middle
            else:
                self._high, self._found = middle, tried

    def _try_below(self) -> None:
        """Try all ways at lengths somewhat below the one found: short records may meet by luck."""
        below = [*_BELOW]
        while self._high <= LONG and below and self._lengths < _LENGTHS:
            shorter = int(below.pop(0) * self._high / self.block) * self.block
            if 0 < shorter < self._high:
                self._lengths += 1
                tried = self._met(shorter, hopeless=np.inf)
                if tried is not None:
                    self._high, self._found, below = shorter, tried, [*_BELOW]

    def _met(self, samples: int, hopeless: float = _HOPELESS) -> Made | None:
        """A record of this length that meets the accuracy, the most promising way tried first.

        Args:
            hopeless: how many times as long a way's record nearby would have to be for it not to be tried.
        """
        long = samples > LONG
        for number in sorted(range(len(self.ways)), key=self._promise):
            missed = self._missed.get(number)
            if (number, samples) in self._tried or (
                missed is not None
                and samples < _NEARBY * len(missed.samples)
                and samples * (_HOPELESS_LONG if long else hopeless) < self._reach(missed)
            ):
                if long:
                    return None
                continue
            self._tried.add((number, samples))
            made = self.ways[number](samples)
            if made is None or made.record is None:
                continue
            if made.record.met:
                return made
            self._missed[number] = made.record
            if long:
                return None
        return None

    def _promise(self, number: int) -> float:
        """Return the length that its latest miss predicts; a way without a miss comes first."""
        missed = self._missed.get(number)
        return 0.0 if missed is None else self._reach(missed)

    def _reach(self, record: Record) -> float:
        return reach(record, self.before)

    def _rounded(self, length: float) -> int:
        """The next length of whole blocks; of a long record one with a fast transform if it is near."""
        whole = int(np.ceil(length / self.block)) * self.block
        unit = self.block * self.inputs
        fast = unit * int(scipy.fft.next_fast_len(int(np.ceil(length / unit))))
        return whole if whole <= LONG or fast > min(_MARGIN * whole, self.longest) else fast
