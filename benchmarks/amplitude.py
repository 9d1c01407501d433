"""How near the records within an amplitude come to the bound over all records: N = 300, |u| <= 1.

    python benchmarks/amplitude.py [RANDOM_PLANTS] [--radius R] [--hold N|auto] [--seconds S] [--first K]

Output-error plants of order one and two get a relative error of 0.2 on [0.02, 2.5] rad/s at alpha 3. Without
RANDOM_PLANTS the eight reference plants of the table in docs/comparison.md are taken. A line a plant: ratio
r_u/r_adm by the bound over all spectra of the power of the amplitude, by the bound over all records, by the
record that is found; its distance; the best pseudo-random sequence; seconds of the whole answer.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import inputdesign_cli as idesign
from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.prbs import pseudo_random
from inputdesign_cli.specification import Spec

_SAMPLES = 300
_EIGHT = [
    ([0.0, 0.4049001171530397, -0.535669373161111], [1.0, -1.1678230039878865, 0.3695602648533095]),
    ([0.0, 0.6304370761833871], [1.0, -0.8702782177955612]),
    ([0.0, -2.7414673826398555, 1.799707382720902], [1.0, 0.3156615447842541, 0.3836519713971167]),
    ([0.0, -0.8677696061279299, -0.45264929211044586], [1.0, 0.2731968200210733, 0.3536968772039281]),
    ([0.0, 0.9591477498322549, -1.6413972945846467], [1.0, 0.7741917819679458, 0.49636395972848435]),
    ([0.0, 0.7204452380655215, 1.1360465324896427], [1.0, -0.5492627192181829, 0.6776192470498021]),
    ([0.0, -2.853291838457013], [1.0, -0.5059625218880031]),
    ([0.0, -1.1905918387572743, -0.45467078517172255], [1.0, 0.30850361698511586, 0.737684337131874]),
]


def random_plants(number: int, radius: float, first: int) -> list[tuple[list[float], list[float]]]:
    """Return random plants (B, F) of order one and two whose poles have moduli up to the radius."""
    found = []
    for seed in range(first, first + number):
        rng = np.random.default_rng(seed)
        order = int(rng.integers(1, 3))
        size, angle = rng.uniform(0.2, radius, 2), rng.uniform(0.2, 2.8)
        complex_pair = [1.0, -2.0 * size[0] * np.cos(angle), size[0] ** 2]
        real_poles = np.poly(rng.choice([-1.0, 1.0], order, p=[0.25, 0.75]) * size[:order])
        denominator = complex_pair if order == 2 and rng.random() < 0.5 else real_poles
        found.append(([0.0, *rng.standard_normal(order).tolist()], [float(a) for a in denominator]))
    return found


def worst_ratio(plant: tuple[list[float], list[float]], u: Array) -> float:
    """Return the largest r_u/r_adm of a record, by a plain program on a grid of frequencies."""
    B, F = (np.array(one) for one in plant)
    rows = []
    for lag in range(1, len(B)):
        rows.append(_filtered(np.eye(len(B))[lag], F, u))
    for lag in range(1, len(F)):
        rows.append(_filtered(-np.convolve(B, np.eye(len(F))[lag]), np.convolve(F, F), u))
    covariance = np.linalg.inv(np.array(rows) @ np.array(rows).T)
    w = np.geomspace(0.02, 2.5, 4000)
    shifts = np.exp(-1j * np.outer(w, np.arange(max(len(B), len(F)))))
    b, f = shifts[:, : len(B)] @ B, shifts[:, : len(F)] @ F
    slopes = np.hstack([shifts[:, 1 : len(B)] / f[:, None], -shifts[:, 1 : len(F)] * (b / f**2)[:, None]])
    parts = np.stack([slopes.real, slopes.imag], axis=1)
    spread = np.linalg.eigvalsh(parts @ covariance @ parts.transpose(0, 2, 1))[:, -1]
    return float(np.max(3.0 * np.sqrt(spread) / (0.2 * np.abs(b / f))))


def _filtered(numerator: Array, denominator: Array, u: Array) -> Array:
    import scipy.signal

    return scipy.signal.lfilter(numerator, denominator, u)


def best_sequence(plant: tuple[list[float], list[float]], hold: int) -> float:
    """Return the ratio of the best pseudo-random binary sequence of any register and clock."""
    rng, found = np.random.default_rng(0), []
    for clock in range(hold, 30 * hold, hold):
        for bits in range(3, 11):
            u = np.repeat(pseudo_random(bits, -(-_SAMPLES // clock), rng), clock)[:_SAMPLES]
            found.append(worst_ratio(plant, u))
    return min(found)


def solved(plant: tuple[list[float], list[float]], hold: int | str, seconds: float) -> dict[str, float]:
    """Return what `idesign solve` finds for a plant, checked by the plain program."""
    start = time.monotonic()
    spec = {
        "plant": {"B": plant[0], "F": plant[1]},
        "noise": {"variance": 1.0},
        "experiment": {"samples": _SAMPLES},
        "objective": "best_accuracy",
        "limits": {"amplitude": 1.0},
        "accuracy": {"model_error": {"relative": 0.2, "band": [0.02, 2.5], "alpha": 3}},
        "spectrum": {"type": "free"},
        "signal": {"type": "binary", "seed": 1, "hold": hold, "seconds": seconds},
    }
    results = idesign.solve(Spec.model_validate(spec))
    took, found = time.monotonic() - start, results.result
    u = results.signal[:, 0]
    return {
        "power": found["objective"]["any_spectrum_bound"],
        "bound": found["objective"]["any_record_bound"],
        "record": found["signal"]["worst_ratio"],
        "plain": worst_ratio(plant, u),
        "distance": found["signal"]["distance_to_best"],
        "hold": (held := found["signal"].get("hold", 1)),
        "sequence": best_sequence(plant, held),
        "seconds": took,
    }


def main() -> None:
    """Print a line for each plant, and the median and the largest distance."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("plants", nargs="?", type=int)
    parser.add_argument("--radius", type=float, default=0.9)
    parser.add_argument("--hold", type=lambda text: text if text == "auto" else int(text), default=1)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--first", type=int, default=0)
    asked = parser.parse_args()
    plants = _EIGHT if asked.plants is None else random_plants(asked.plants, asked.radius, asked.first)
    print("plant   power    bound   record    plain  distance  sequence  seconds  hold")
    distances = []
    for number, plant in enumerate(plants):
        one = solved(plant, asked.hold, asked.seconds)
        distances.append(one["distance"])
        print(
            f"{number:5d} {one['power']:8.4f} {one['bound']:8.4f} {one['record']:8.4f} {one['plain']:8.4f}"
            f" {one['distance']:9.2%} {one['sequence']:9.4f} {one['seconds']:8.1f} {one['hold']:5d}",
            flush=True,
        )
    print(f"distance: median {np.median(distances):.2%}, largest {max(distances):.2%}")


if __name__ == "__main__":
    main()
