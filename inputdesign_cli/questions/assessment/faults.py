"""What to say of faults of measurement: samples that decide what a record says, sensors that stand still."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

import numpy as np

from inputdesign_cli.identification import Estimate, Frozen, frozen, shifted, spikes
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import TransferMatrix
from inputdesign_cli.tasks.build.data import Data

_SHOWN = 5
# Rows that an option lists.
_LISTED = 12
# Of so many samples in a hundred a sensor that stands still biases a model; spikes where it explains less.
_BIASING, _HALF = 0.02, 50.0


def faults(units: Units, estimate: Estimate, data: Data) -> list[str]:
    """A sentence for every output and kind of fault."""
    return [*_spikes(units, estimate, data), *_frozen(units, estimate, data)]


def biasing(units: Units, estimate: Estimate, data: Data, fitted: Sequence[float]) -> list[str]:
    """A sentence for every output whose faults of measurement make its model another than the plant's.

    Args:
        fitted: (p,), per cent of each output that the simulation explains.
    """
    told = []
    for output, runs in _still(estimate, data).items():
        share = sum(one.length for one in runs) / len(data.y)
        if share >= _BIASING:
            told.append(
                f"{_named(units, output)} stands still at {100.0 * share:.2g} % of the samples while "
                "the input moves: a model of what a sensor does not follow has another gain, and other "
                "dynamics, than the plant; leave these rows out (--without), which cuts the record there"
            )
    told += [
        f"a few samples hold {100.0 * one.share:.3g} % of the squares of the residuals of "
        f"{_named(units, one.output)}, and the simulation explains {fitted[one.output]:.1f} % of it: "
        "spikes, or events that the model does not know, decide what it is; leave rows out that are faults "
        "of measurement (--without)"
        for one in spikes(estimate.errors)
        if fitted[one.output] < _HALF
    ]
    return told


def _named(units: Units, output: int) -> str:
    return f"y{output + 1}" if units.outputs > 1 else "y"


def _still(estimate: Estimate, data: Data) -> dict[int, list[Frozen]]:
    """The stretches in which outputs stand still while an input moves."""
    if data.recorded is None:
        return {}
    known, simulated = data.recorded, estimate.simulated
    found = frozen(
        known.held, known.resolution, data.u, estimate.errors, data.y - simulated, simulated, data.lengths
    )
    return {
        output: [one for one in found if one.output == output]
        for output in sorted({one.output for one in found})
    }


def _frozen(units: Units, estimate: Estimate, data: Data) -> list[str]:
    """A sentence for every output that stands still while an input moves."""
    told = []
    for output, runs in _still(estimate, data).items():
        places = [
            f"rows {first} to {last}{_file(data, one.first)}"
            for one in runs[:_SHOWN]
            if data.recorded is not None
            for first, last in [data.recorded.rows[[one.first, one.first + one.length - 1]]]
        ]
        told.append(
            f"{_named(units, output)} stands still while the input moves, for "
            f"{sum(one.length for one in runs)} of {len(data.y)} samples ({', '.join(places)}"
            f"{', ..' * (len(runs) > _SHOWN)}), and rounding does "
            "not explain it: the sensor is frozen or saturated, or the logger repeats its last value; leave "
            "these rows out, which cuts the record there: "
            f"{_without_samples(data, [(one.first, one.first + one.length - 1) for one in runs])}"
        )
    return told


def loop_faults(controller: TransferMatrix | None, data: Data) -> list[str]:
    """A sentence where signals obey the controller of the loop at another time than they were logged at."""
    if controller is None or data.r is None:
        return []
    told = []
    for one in shifted(controller, data.u, data.y, data.r, data.lengths):
        several = data.u.shape[1] > 1 and one.letter != "y"
        name = f"{one.letter}{one.channel + 1}" if several else one.letter
        count = abs(one.lag)
        when = f"{count} sample{'s' * (count > 1)} {'late' if one.lag > 0 else 'early'}"
        told.append(
            f"{name} was logged {when}: the controller of the spec, u = r - C y, leaves "
            f"{100 * one.left:.3g} % of u as the columns stand, and {100 * one.then:.2g} % with {name} "
            "moved; a model of the loop would take the shift for a delay: move the column, or mend the "
            "controller of the spec"
        )
    return list(dict.fromkeys(told))


def file_of(files: Sequence[tuple[str, int]], at: int) -> str:
    """The file that a sample is of, where there are several; `files` are names and samples."""
    ends = np.cumsum([samples for _, samples in files])
    return files[int(np.searchsorted(ends, at, side="right"))][0] if len(files) > 1 else ""


def without_option(runs: Sequence[tuple[str, int, int]]) -> str:
    """The option that leaves out runs of rows: the name of the file, if need be, the first and the last."""
    listed = [
        f"{f'{name}:' if name else ''}{first}{f'-{last}' if last > first else ''}"
        for name, first, last in runs
    ]
    return f"--without {shlex.quote(','.join(listed))}" if len(listed) <= _LISTED else "--without"


def _without_samples(data: Data, runs: Sequence[tuple[int, int]]) -> str:
    """The option that leaves out samples, the first and the last of each run."""
    if data.recorded is None:
        return "--without"
    rows = data.recorded.rows
    return without_option([(file_of(data.files, first), rows[first], rows[last]) for first, last in runs])


def _file(data: Data, at: int) -> str:
    name = file_of(data.files, at)
    return f" of {name}" if name else ""


def places(units: Units, data: Data, samples: Sequence[int]) -> str:
    """When samples were taken, and in which file; the first few of many."""
    shown = [f"{data.time[at]:.10g} {units.time_unit}{_file(data, at)}" for at in samples[:_SHOWN]]
    return ", ".join(shown) + ", .." * (len(samples) > _SHOWN)


def _spikes(units: Units, estimate: Estimate, data: Data) -> list[str]:
    """A sentence for every output in whose residuals a few samples hold most of the sum of squares."""
    told = []
    for one in spikes(estimate.errors):
        many, output = len(one.samples), _named(units, one.output)
        told.append(
            f"{many} of {len(estimate.errors)} samples of {output} hold{'s' * (many == 1)} "
            f"{100 * one.share:.3g} % of the squares of its residuals (at "
            f"{places(units, data, one.samples)}): spikes, or events that the model does not know, decide "
            "what these data say; leave rows out that are faults of measurement, which cuts the record "
            f"there: {_without_samples(data, [(at, at) for at in one.samples])}"
        )
    return told
