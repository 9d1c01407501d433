"""What is known of the plant, whatever the words that said it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from inputdesign_cli.specification import Spec

_STEPS = (1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True)
class PlantAnswer:
    """What is known of the plant.

    Args:
        lines: of the spec, with comments.
        slow, late: its slowest time constant and its dead time, in seconds.
        intervals: what the parameters may be, by name; none where nothing is said.
        values: the parameters by name.
        controller: under which it usually runs, as YAML.
        files: to be written beside the spec, by name.
        covariance: the one of them that tells how good the estimate is.
        sampling: seconds between samples, where that is known already, and why.
        tunable: whether rules of tuning know it.
        channels: the larger number of its inputs and outputs.
        explored: the model of a log, whose noise is told in the spec.
        source: the name of that log.
        against: what the log says against that model, a sentence each.
    """

    lines: tuple[str, ...]
    slow: float
    late: float
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    controller: str | None = None
    files: Mapping[str, bytes] = field(default_factory=dict)
    covariance: str | None = None
    sampling: float | None = None
    why_sampling: str = "as the plant is sampled"
    tunable: bool = False
    channels: int = 1
    explored: Spec | None = None
    source: str = ""
    against: tuple[str, ...] = ()

    @property
    def sample_time(self) -> float:
        """A twentieth of the time constant, rounded down to 1, 2 or 5 times a power of ten."""
        if self.sampling is not None:
            return self.sampling
        return round_step(self.slow / 20.0)


def round_step(wanted: float) -> float:
    """Rounded down to 1, 2 or 5 times a power of ten."""
    decade = 10.0 ** np.floor(np.log10(wanted))
    return float(decade * max(step for step in _STEPS if step * decade <= wanted * (1 + 1e-9)))
