"""What a change of load that no input shows does to a model, and whether it is found.

    python benchmarks/level_shifts.py [LOGS] [FIRST_SEED] [--none]

Each log is of one or two lags behind a dead time, its input held for 15 to 45 samples; half begin in the
middle of things. From some sample on a load of 0.4 to 1.2 times the gain acts on the output, at once or
behind a lag. `explore` is given the whole, and looks for shifts or does not. A row tells where the shift is
and which rows are left out, and how far G is off up to the bandwidth, in per cent of itself, without and with
them. With --none nothing happens: cells that are left out are then false.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import scipy.signal

from inputdesign_cli.explore.joint import explore_records
from inputdesign_cli.questions.exploration.explore import explored_beside_shifts
from inputdesign_cli.records import Preparation, read_log

_BANDWIDTH = 0.7  # of the static gain


def lags(times: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator in q^-1 of 1/((T1 s + 1) (T2 s + 1)) behind a hold of one second."""
    below = np.ones(1)
    for time in times:
        below = np.polymul(below, [time, 1.0])
    b, a, _ = scipy.signal.cont2discrete(([1.0], below), 1.0)
    return b[0], a


def drawn(seed: int, *, none: bool) -> tuple[np.ndarray, int, tuple]:
    """A log (n, 2) of u and y, the sample from which a load acts, and the plant: gain, filter, dead time."""
    rng = np.random.default_rng(seed)
    samples, before = int(rng.integers(200, 500)), 300 * int(rng.integers(2))
    times = [float(rng.uniform(5.0, 25.0)), *([float(rng.uniform(2.0, 8.0))] if rng.integers(2) else [])]
    gain, late, whole = float(rng.uniform(0.5, 3.0)), int(rng.integers(1, 9)), samples + before
    u = np.repeat(rng.choice([-1.0, 1.0], whole), rng.integers(15, 46, whole))[:whole]
    b, a = lags(times)
    y = gain * scipy.signal.lfilter(b, a, np.concatenate([np.zeros(late), u]))[:whole]
    at = int(rng.integers(samples // 5, 4 * samples // 5))
    size, slow = rng.uniform(0.4, 1.2) * rng.choice([-1.0, 1.0]), float(rng.choice([0.0, 10.0, times[0]]))
    after = np.arange(samples) - at + 1.0
    load = np.where(after > 0.0, -np.expm1(-np.maximum(after, 0.0) / slow) if slow else 1.0, 0.0)
    colour = float(rng.choice([0.0, 0.6]))
    noise = scipy.signal.lfilter([np.sqrt(1.0 - colour**2)], [1.0, -colour], rng.standard_normal(whole))
    y = y[before:] + gain * rng.uniform(0.03, 0.12) * noise[before:]
    return np.c_[u[before:], y + (0.0 if none else gain * size * load)], at, (gain, b, a, late)


def off(model, plant) -> float:
    """The largest relative error of G up to the bandwidth, in per cent."""
    gain, b, a, late = plant
    w = np.linspace(1e-4, np.pi, 3000)
    true = gain * scipy.signal.freqz(b, a, w)[1] * np.exp(-1j * w * late)
    below = np.abs(true) > _BANDWIDTH * gain
    return 100.0 * float(np.max(np.abs(model.plant_at(w)[:, 0, 0] / true - 1.0)[below]))


def main() -> None:
    """Print a row for each log, and the medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", nargs="?", type=int, default=12)
    parser.add_argument("first", nargs="?", type=int, default=0)
    parser.add_argument("--none", action="store_true")
    given = parser.parse_args()
    print("| log | samples | shifts at | left out | G off, whole % | G off, without % |")
    print("|---|---|---|---|---|---|")
    found = []
    for seed in range(given.first, given.first + given.logs):
        rows, at, plant = drawn(seed, none=given.none)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "log.csv"
            np.savetxt(path, rows, delimiter=",", header="u,y", comments="")
            log = read_log(path, Preparation(sample_time=1.0, time_unit="s"))
        rest, best = explored_beside_shifts(log, loop=False)
        left = np.setdiff1d(log.recorded.rows, rest.recorded.rows) - log.recorded.rows[0]
        whole = explore_records(log.parts, step=log.step).model if left.size else best.model
        found.append((off(whole, plant), off(best.model, plant)))
        runs = np.split(left, np.flatnonzero(np.diff(left) > 1) + 1) if left.size else []
        where = " and ".join(f"{run[0]} to {run[-1]}" for run in runs) or "none"
        shifts = "" if given.none else at
        print(
            f"| {seed} | {len(rows)} | {shifts} | {where} | {found[-1][0]:.1f} | {found[-1][1]:.1f} |",
            flush=True,
        )
    print("| median | | | | {:.1f} | {:.1f} |".format(*np.median(found, axis=0)))


if __name__ == "__main__":
    main()
