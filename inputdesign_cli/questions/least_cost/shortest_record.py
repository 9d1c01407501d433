"""When the limits on single samples leave too little power: the shortest record that can be found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.questions.common.record import Made
from inputdesign_cli.signal import Record

# Lengths that are looked into: times the one that was asked for, or that many samples.
_LONGEST, _AT_LEAST = 64, 20_000
_LEAP, _DOUBLE = 8.0, 2.0
# So few samples tell nothing of what more of them would do: they may be less than a dead time.
_FEW = 100
_GROWTH, _MOST_GROWTHS = 1.03, 100.0
_FAR = 1.5
_FINE = 0.01
_LENGTHS = 24
_FALLS = 0.9  # of what seemed to be needed before
_BEYOND = 1.25  # times the longest that is looked for: not to be made up for by chance
# A way that missed nearby, and by so much, is not tried: other phases change a ratio by less as a rule.
_NEARBY, _HOPELESS = 1.2, 1.15
# Whether a record meets is a matter of luck near the shortest: so far below one that does all are tried.
_BELOW = (0.96, 0.9)


class Way(Protocol):
    """A kind of signal with a rule for its spectrum."""

    def __call__(self, samples: int) -> Made | None:
        """The first record of a length that is found to meet the accuracy, else the best of some, if any."""


def reach(record: Record, before: float = np.inf) -> float:
    """The length that a record needs, were its information in proportion to its length.

    Args:
        before: the worst ratio of what is known without it.
    """
    if not np.isfinite(record.worst_ratio):
        return _DOUBLE * len(record.samples)
    known = before**-2.0
    gain = record.worst_ratio**-2.0 - known
    return len(record.samples) * (1.0 - known) / gain if gain > 0.0 else np.inf


def longest_search(asked: int, most: int | None, longest: int) -> int:
    """How long records are looked into where those of `asked` samples miss.

    Args:
        most: samples of the longest experiment, where there is a limit.
        longest: samples of the longest record that is computed at all.
    """
    return min(max(_LONGEST * asked, _AT_LEAST, most or 0), longest)


@dataclass
class ShortestRecord:
    """The search for the shortest record, by trying lengths in several ways.

    Args:
        ways: what is tried at a length, until a record meets the accuracy.
        block: lengths are multiples of this.
        longest: samples of the longest that is looked for.
        before: the worst ratio of what is known without any record.
    """

    ways: Sequence[Way]
    block: int
    longest: int
    before: float = np.inf
    needed: float = 0.0  # samples that would do, by the records that missed
    _missed: dict[int, Record] = field(default_factory=dict)  # by way, its latest
    _tried: set[tuple[int, int]] = field(default_factory=set)  # ways and lengths

    def search(self, misses: Sequence[Record]) -> Made | None:
        """The shortest record that meets the accuracy, to one per cent; None when none is found.

        Out of time, the shortest so far.

        Args:
            misses: records of the length from which on longer ones are looked for.

        Raises:
            OutOfTimeError: before one is found.
        """
        low, found, lengths = len(misses[0].samples), None, 0
        self.needed = min(map(self._reach, misses))
        try:
            while found is None and lengths < _LENGTHS:
                # Where what is needed was told too low again and again, it is no guide.
                growth = min(_GROWTH ** min(2.0**lengths, _MOST_GROWTHS), _LEAP)
                high = self._rounded(min(max(self.needed, growth * low), _LEAP * low, self.longest))
                if high <= low:
                    return None
                lengths += 1
                found = self._met(high)
                if found is None:
                    before, low = self.needed if lengths > 1 else np.inf, high
                    self.needed = min(map(self._reach, self._missed.values()), default=high)
                    # Records shorter than what the plant remembers promise far less than longer ones keep.
                    if low >= _FEW and self.needed > max(_BEYOND * self.longest, _FALLS * before):
                        return None
            while found is not None and high - low > max(_FINE * high, self.block) and lengths < _LENGTHS:
                lengths += 1
                middle = self._rounded(np.sqrt(low * high) if high > _FAR * low else 0.5 * (low + high))
                if middle in (low, high):
                    break
                tried = self._met(middle)
                low, high, found = (middle, high, found) if tried is None else (low, middle, tried)
            below = [*_BELOW]
            while found is not None and below and lengths < _LENGTHS:
                shorter = int(below.pop(0) * high / self.block) * self.block
                if 0 < shorter < high:
                    lengths += 1
                    tried = self._met(shorter, hopeless=np.inf)
                    if tried is not None:
                        high, found, below = shorter, tried, [*_BELOW]
        except OutOfTimeError:
            if found is None:
                raise
        return found

    def _met(self, samples: int, hopeless: float = _HOPELESS) -> Made | None:
        """A record of this length that meets the accuracy, the most promising way tried first.

        Args:
            hopeless: how many times as long a way's record nearby would have to be for it not to be tried.
        """
        for number in sorted(range(len(self.ways)), key=self._promise):
            missed = self._missed.get(number)
            if (number, samples) in self._tried or (
                missed is not None
                and samples < _NEARBY * len(missed.samples)
                and samples * hopeless < self._reach(missed)
            ):
                continue
            self._tried.add((number, samples))
            made = self.ways[number](samples)
            if made is None or made.record is None:
                continue
            if made.record.met:
                return made
            self._missed[number] = made.record
        return None

    def _promise(self, number: int) -> float:
        """Where its latest record that missed would do; those that have not missed come first."""
        missed = self._missed.get(number)
        return 0.0 if missed is None else self._reach(missed)

    def _reach(self, record: Record) -> float:
        return reach(record, self.before)

    @property
    def tried(self) -> int:
        """Samples of the longest record that was tried."""
        return max((samples for _, samples in self._tried), default=0)

    def _rounded(self, length: float) -> int:
        return int(np.ceil(length / self.block)) * self.block
