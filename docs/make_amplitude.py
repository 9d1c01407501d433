"""Draws the picture of docs/amplitude.md: the accuracy within an amplitude against the length of the record.

    python docs/make_amplitude.py

It prints the figures, too. Ratios are multiplied by the root of the length, which removes the common trend.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from inputdesign_cli import solve
from inputdesign_cli.figures.style import BLUE, DASHED, GREY, ORANGE, rendered
from inputdesign_cli.specification import Spec

IMAGE = Path(__file__).parent / "images" / "amplitude.png"
POWER, RECORDS = "bound by the power a^2", "bound over all records (proved)"
LENGTHS = (60, 120, 250, 500, 1000)
PLANT = {"B": [0, 0.4049001171530397, -0.535669373161111], "F": [1, -1.1678230039878865, 0.3695602648533095]}


def found(samples: int, signal: dict[str, object]) -> dict[str, float]:
    """Return the bounds and the ratio of the record of one kind of signal."""
    spec = {
        "plant": PLANT,
        "noise": {"variance": 1.0},
        "experiment": {"samples": samples},
        "objective": "best_accuracy",
        "limits": {"amplitude": 1.0},
        "accuracy": {"model_error": {"relative": 0.2, "band": [0.02, 2.5], "alpha": 3}},
        "spectrum": {"type": "free"},
        "signal": {"seed": 1, **signal},
    }
    result = solve(Spec.model_validate(spec)).result
    objective = result["objective"]
    return {
        POWER: objective["any_spectrum_bound"],
        RECORDS: objective["any_record_bound"],
        str(signal["type"]): result["signal"]["worst_ratio"],
    }


def main() -> None:
    """Solve for every length and kind, and draw the ratios."""
    curves: dict[str, list[float]] = {}
    kinds = {"binary": {"seconds": 20.0}, "multisine": {"phases": "optimised"}, "prbs": {}}
    for samples in LENGTHS:
        point: dict[str, float] = {}
        for kind, more in kinds.items():
            point |= found(samples, {"type": kind, **more})
        for name, ratio in point.items():
            curves.setdefault(name, []).append(ratio * float(np.sqrt(samples)))
        print(samples, {name: float(f"{ratio:.4g}") for name, ratio in point.items()}, flush=True)

    styles = {
        "prbs": (GREY, DASHED),
        "multisine": (GREY, "-"),
        "binary": (BLUE, "-"),
        RECORDS: (ORANGE, "-"),
        POWER: (ORANGE, DASHED),
    }

    def paint(page: Figure) -> None:
        page.set_size_inches(8.0, 4.2)
        axes = page.subplots()
        for name, (color, line) in styles.items():
            values = curves[name]
            axes.plot(LENGTHS, values, color=color, linestyle=line, marker="o", markersize=4, label=name)
        axes.set_xscale("log")
        axes.set_xticks(LENGTHS, [str(n) for n in LENGTHS])
        axes.minorticks_off()
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("samples N")
        axes.set_ylabel("largest r_u / r_adm, times the root of N")
        axes.legend(handlelength=5.0)

    IMAGE.write_bytes(rendered(paint))


if __name__ == "__main__":
    main()
