"""Convert the numbers of an experiment into its user's units, and name its signals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property


@dataclass(frozen=True)
class Units:
    """Holds the units and names of time, frequency and channels that the user of an experiment uses.

    `sampled` is whether time is discrete. The experiment then has frequencies in rad/sample; in continuous
    time it has them in rad per `time_unit`, as the user does. `channels` are names and units of u1, .. and
    y1, .. if the user gave them, else empty. `by_duration` is whether the user states lengths in `time_unit`,
    not in samples. One input and one output carry no index in the names of curves and entries.
    """

    time_unit: str
    sample_time: float
    sampled: bool
    closed_loop: bool
    inputs: int
    outputs: int
    channels: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    by_duration: bool = False

    @cached_property
    def frequency(self) -> float:
        """Return the divisor that turns an experiment's frequency into rad per time unit."""
        return self.sample_time if self.sampled else 1.0

    @cached_property
    def step(self) -> float:
        """Return the time between samples in the unit of the experiment's frequency: 1, or `sample_time`."""
        return 1.0 if self.sampled else self.sample_time

    @property
    def per_time(self) -> str:
        """Return the unit of frequencies, for sentences: rad/s."""
        return f"rad/{self.time_unit}"

    def length(self, samples: int, section: str = "experiment") -> str:
        """Return the key that states or limits a length, with its value: experiment.samples: 600."""
        if self.by_duration:
            return f"{section}.duration: {samples * self.sample_time:.10g}"
        return f"{section}.samples: {samples}"

    def named(self, w: float) -> str:
        """Return a frequency of an experiment for a sentence, in the user's unit: 0.15 rad/s."""
        return f"{w / self.frequency:.4g} {self.per_time}"

    @property
    def frequency_header(self) -> str:
        """Return the header of a column of frequencies: frequency_rad_per_s."""
        return f"frequency_rad_per_{self.time_unit}"

    @property
    def time_header(self) -> str:
        """Return the header of a column of times: time_s."""
        return f"time_{self.time_unit}"

    @cached_property
    def excitation(self) -> str:
        """Return the signal that is designed: r in closed loop, u in open loop."""
        return "r" if self.closed_loop else "u"

    @cached_property
    def excitations(self) -> tuple[str, ...]:
        """Return the names of the columns of the record: u1, u2, .., in closed loop r1, r2, .."""
        return tuple(f"{self.excitation}{a + 1}" for a in range(self.inputs))

    def label(self, channel: str) -> str:
        """Return the user's name of a channel, with its unit: `valve (%)`; empty where none is stated.

        An excitation r1 is added to u1 and has its unit.
        """
        drives = f"u{channel[1:]}"
        name, unit = self.channels.get(channel, ("", self.channels.get(drives, ("", ""))[1]))
        return f"{name} ({unit})".strip() if unit else name

    def header(self, channel: str) -> str:
        """Return the label as the header of a column, which begins with the channel."""
        return f"{channel} {self.label(channel)}".strip()

    def passage(self, entry: tuple[int, int] | None) -> str:
        """Return the user's names of the input and output of an entry of G, from zero: `valve → level`.

        Empty where not both have names, and for all entries together (None) unless there is one alone.
        """
        output, input = (0, 0) if entry is None and self.single else entry or (-1, -1)
        ends = [self.channels.get(f"{x}{i + 1}", ("", ""))[0] for x, i in (("u", input), ("y", output))]
        return " → ".join(ends) if all(ends) else ""

    @cached_property
    def single(self) -> bool:
        """Return whether there is one input and one output."""
        return self.inputs == self.outputs == 1

    def entry(self, output: int, input: int) -> str:
        """Return an entry of G, counted from zero, as in names of parameters: `[2,1]`; empty for one."""
        return "" if self.single else f"[{output + 1},{input + 1}]"

    def suffix(self, output: int, input: int) -> str:
        """Return the index of an entry in names of columns: `_21`; empty for one input and output."""
        return "" if self.single else f"_{output + 1}{input + 1}"


@dataclass(frozen=True)
class Header:
    """Holds the head of every result: the title, the spec as resolved (YAML), and the units."""

    title: str
    resolved_spec: str
    units: Units
