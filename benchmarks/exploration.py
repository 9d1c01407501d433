"""From raw logs to models: the simulation fit on the second half, beside the best of a brute-force search.

`python benchmarks/exploration.py [RECORD ..]` gives `idesign explore` the first half of each record of
docs/data and judges its model.yaml by the second, by the functions of the command. Beside it stands the best
ARX model of the first half, orders to 8 and delays to 8, that is chosen on that same second half; and what
the same search reaches there where the first half alone chooses: by simulation of its last 40 %, by BIC, and
the median of all. The column moves one input in each half, so that neither tells the other: blocks of its
record estimate and judge in turn, for `explore` and for the search.

`--structures` estimates OE and BJ models of orders two to five from the whole first half instead, and says
how well each explains that half (fit, BIC) and the other: whether any structure that the one does not
refute would do better on the other.
"""

import argparse
import itertools
import resource
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from inputdesign_cli.explore.division import divided
from inputdesign_cli.explore.fits import fits
from inputdesign_cli.identification.estimators import identify
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.questions import explore
from inputdesign_cli.records import Preparation, read_log
from inputdesign_cli.specification import load_spec

DATA = Path(__file__).parents[1] / "docs" / "data"
HIGHEST = 8
# Of the first half so much estimates where the rest of it judges.
SHARE = 0.6

# Name -> files (one is cut into halves), columns, whether there is a header.
RECORDS = {
    "two heaters": (
        ["tclab/two_heaters.txt"],
        {"u1": "Heater 1", "u2": "Heater 2", "y1": "Temperature 1", "y2": "Temperature 2"},
        True,
    ),
    "heater step": (["tclab/step.csv"], {"time": "1", "u1": "2", "y1": "3"}, False),
    "converter": (["buck_converter/buck_id.csv"], {"u1": "input", "y1": "y"}, True),
    "converter, two files": (
        ["buck_converter/buck_id.csv", "buck_converter/buck_valid.csv"],
        {"u1": "input", "y1": "y"},
        True,
    ),
    "cylinders": (
        ["cylinders/MultivariableCylinders.csv"],
        {"time": "1", "u1": "2", "u2": "3", "y1": "4", "y2": "5"},
        False,
    ),
    "column": (["wood_berry/record.csv"], {"u1": "u1", "u2": "u2", "y1": "y1", "y2": "y2"}, True),
}


def halves(name: str, folder: Path) -> list[Path]:
    """The two halves of a record as files."""
    files, _, headed = RECORDS[name]
    if len(files) == 2:
        return [DATA / file for file in files]
    lines = (DATA / files[0]).read_text().splitlines()
    head, rows = (lines[:1], lines[1:]) if headed else ([], lines)
    middle = len(rows) // 2
    found = []
    for part, some in (("first", rows[:middle]), ("second", rows[middle:])):
        found.append(folder / f"{part}.csv")
        found[-1].write_text("\n".join([*head, *some]) + "\n")
    return found


@dataclass(frozen=True)
class Searched:
    """Fits on a second half of ARX models of the first, and which of them a search would take.

    Attributes:
        best: the largest fit, known only to who has seen the second half.
        by_rest: that of the model whose like, estimated on 60 % of the first half, simulates the rest best.
        by_criterion: that of the model that BIC prefers on the first half.
        median: of all models.
    """

    best: float
    by_rest: float
    by_criterion: float
    median: float


def least_squares(parts, a: int, b: int, delay: int) -> tuple[PolynomialModel, float] | None:
    """An ARX model of one output with its BIC, or None where the records are too short for it."""
    begin = max(a, b + delay - 1)
    inputs = parts[0][0].shape[1]
    known, right = [], []
    for u, y in parts:
        rows = len(y) - begin
        if rows <= 0:
            return None
        columns = [-y[begin - lag : len(y) - lag, 0] for lag in range(1, a + 1)]
        for j in range(inputs):
            columns += [u[begin - lag : len(u) - lag, j] for lag in range(delay, delay + b)]
        known.append(np.stack([*columns, np.ones(rows)], 1))
        right.append(y[begin:, 0])
    known, right = np.concatenate(known), np.concatenate(right)
    if len(right) <= known.shape[1]:
        return None
    theta = np.linalg.lstsq(known, right, rcond=None)[0]
    each = np.split(theta[a:-1], inputs)
    if not all(np.any(part) for part in each):
        return None
    one = (np.ones(1),)
    model = PolynomialModel(
        (tuple(np.concatenate([np.zeros(delay), part]) for part in each),),
        (np.concatenate([[1.0], theta[:a]]),),
        ((np.ones(1),) * inputs,),
        one,
        one,
        np.eye(1),
    )
    variance = np.mean((right - known @ theta) ** 2)
    return model, len(right) * np.log(variance) + theta.size * np.log(len(right))


def brute_force(first, second) -> Searched:
    """ARX models of one output that least squares finds on the records `first`, judged by `second`.

    What is chosen by the largest of hundreds of fits on `second` has been lucky there; rules that see
    `first` alone tell what the search is worth to a user.
    """
    cuts = [int(SHARE * len(y)) for _, y in first]
    begun = [(u[:at], y[:at]) for (u, y), at in zip(first, cuts, strict=True)]
    rest = [(u[at:], y[at:]) for (u, y), at in zip(first, cuts, strict=True)]
    found = []
    for orders in itertools.product(range(1, HIGHEST + 1), range(1, HIGHEST + 1), range(HIGHEST + 1)):
        whole, part = least_squares(first, *orders), least_squares(begun, *orders)
        if whole is None or part is None:
            continue
        # All are judged by the same samples, past what the longest of them needs to begin.
        unseen = fits(part[0], rest, 2 * HIGHEST).simulation[0]
        found.append((fits(whole[0], second).simulation[0], unseen, -whole[1]))
    judged, unseen, criterion = np.nan_to_num(np.array(found).T, neginf=-1e9)
    return Searched(
        float(judged.max()),
        float(judged[np.argmax(unseen)]),
        float(judged[np.argmax(criterion)]),
        float(np.median(judged)),
    )


def model_of(result, output: int) -> str:
    """The structure that was chosen for an output."""
    structure = result["exploration"]["outputs"][output]["structure"]
    orders = " ".join(f"{letter}{n}" for letter, n in structure["orders"].items())
    return f"{structure['family']} {orders}, delay {' and '.join(map(str, structure['delay']))}"


def compared(name: str) -> None:
    """Print the rows of one record."""
    files, columns, _ = RECORDS[name]
    prepared = Preparation(columns=columns)
    with tempfile.TemporaryDirectory() as folder:
        # Of the column the blocks that estimated stand for the first half, those that judged for the second.
        paths = [DATA / file for file in files] if name == "column" else halves(name, Path(folder))
        started = time.perf_counter()
        found = explore(paths[:1], prepared)
        seconds = time.perf_counter() - started
        logs = [read_log(path, prepared) for path in paths]
        parts = [[(log.u, log.y)] for log in logs]
        validation = found.results.result["validation"]
        if name == "column":
            parts = list(divided(parts[0])[:2])
        else:
            model = Path(folder) / "model.yaml"
            model.write_bytes(found.results.files["model.yaml"])
            judged = explore(paths[1:], prepared, model=load_spec(model, design=False))
            validation = judged.results.result["validation"]
    fitted = validation["simulation_fit_percent"]
    for i, fit in enumerate(fitted if isinstance(fitted, list) else [fitted]):
        best = brute_force(*([(u, y[:, i : i + 1]) for u, y in some] for some in parts))
        row = [name, f"y{i + 1}", model_of(found.results.result, i), f"{fit:.1f}", f"{best.best:.1f}"]
        others = [f"{x:.1f}" for x in (best.by_rest, best.by_criterion, best.median)]
        print("|", " | ".join([*row, f"{fit - best.best:+.1f}", *others, f"{seconds:.0f}"]), "|", flush=True)


def structures(name: str) -> None:
    """Print what OE and BJ models of several orders, estimated from a first half, make of both halves."""
    prepared = Preparation(columns=RECORDS[name][1])
    with tempfile.TemporaryDirectory() as folder:
        first, second = [
            [(log.u, log.y[:, :1])]
            for log in (read_log(path, prepared) for path in halves(name, Path(folder)))
        ]
    (u, y), one = first[0], np.ones(1)
    for order, noise in itertools.product(range(2, 6), range(3)):
        delay = max(5 - order, 1)
        B, F = np.concatenate([np.zeros(delay), np.ones(order)]), np.concatenate([one, np.zeros(order)])
        C = np.concatenate([one, np.zeros(noise)])
        inputs = u.shape[1]
        structure = PolynomialModel(((B,) * inputs,), (one,), ((F,) * inputs,), (C,), (C,), np.eye(1))
        found = identify(structure, u, y, rest=False)
        samples, size = len(y), structure.theta.size
        bic = samples * float(np.log(found.noise[0, 0])) + size * np.log(samples)
        model = structure.at(found.theta, found.noise)
        on_both = [fits(model, part).simulation[0] for part in (first, second)]
        row = [name, "BJ" if noise else "OE", f"{order}", f"{delay}", f"{noise}", f"{bic:.0f}"]
        print("|", " | ".join([*row, *(f"{fit:.1f}" for fit in on_both)]), "|", flush=True)


def long_record(rows: int) -> None:
    """Time and memory of a record of so many rows."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 1.0], rows // 5 + 1), 5)[:rows]
    y = np.zeros(rows)
    for k in range(3, rows):
        y[k] = 1.5 * y[k - 1] - 0.56 * y[k - 2] + 0.1 * u[k - 3]
    y += 0.3 * rng.standard_normal(rows)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.csv"
        np.savetxt(path, np.column_stack([u, y]), delimiter=",", header="u,y", comments="")
        started = time.perf_counter()
        explore([path], Preparation())
        seconds = time.perf_counter() - started
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"\n{rows} rows: {seconds:.1f} s, {memory:.0f} MB")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("records", nargs="*", default=list(RECORDS), help=f"of {', '.join(RECORDS)}")
    parser.add_argument("--rows", type=int, default=0, help="also a simulated record of so many rows")
    parser.add_argument("--structures", action="store_true", help="estimates of several orders instead")
    chosen = parser.parse_args()
    if chosen.structures:
        print("| record | family | order | delay | C, D | BIC | fit %, first half | second half |")
        print("|---|---|---|---|---|---|---|---|")
        for name in chosen.records:
            structures(name)
        return
    print(
        "| record | output | model | fit % | best ARX % | difference | by its rest | BIC | median | seconds |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name in chosen.records:
        compared(name)
    if chosen.rows:
        long_record(chosen.rows)


if __name__ == "__main__":
    main()
