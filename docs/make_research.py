"""Writes docs/research.md: compares published criteria on a published example.

python docs/make_research.py [DIR]
"""

from __future__ import annotations

import re
from pathlib import Path

from pages import Terminal, filled, keep, write

TEXT = """\
# Research: published designs side by side

Least-costly and D-optimal designs, compared on a published example (`python docs/make_research.py`).

## 1. A design from a paper

The first illustration of [Bombois and Scorletti](references.md#bombois-least-costly): y = 3.6 q^-1 / (1 -
0.7 q^-1) u + (1 - 0.9 q^-1) e, an error below 1 % of |G| at all frequencies after 500 samples:

{copy}

{least}

The paper prints 0.25, and 1.7 for white noise ([papers.md](papers.md)).

![r_u against r_adm](images/research_bound.png)

## 2. What the proof says

The first line bounds every FIR spectrum of order 20 by the dual problem. The second bounds every spectrum:
{over} % of the cost at most could be saved by another family. The certificate, the accuracy that a unit of
power gives at each frequency, is nowhere above one.

![the certificate](images/research_optimality.png)

## 3. The rival: D-optimal, of the same power

{rival}

It maximises log det M, whichever error matters. How large is the error of its record where 1 % is asked?

{judged}

{ratio} times the admissible error. The error falls with the root of the power, so a D-optimal record of the
required accuracy takes {more} times the power of the least-costly spectrum. White noise takes {white} times
as much.

## 4. A longer filter

A sweep over the order of the FIR spectrum, with one row per point in `sweep.csv`:

{sweep}

![cost against the order, above the bound over every spectrum](images/research_curves.png)

## 5. Is the theory true after 500 samples?

r_u is asymptotic. Two hundred simulated experiments with the designed spectrum, each estimated:

{simulated}

With 95 % probability (chi-squared, two degrees of freedom) the estimate lies in an ellipse, and r_u is the
largest |G_hat - G| in it. So to first order at least 95 % of the runs stay within r_u at all frequencies
together.

Further: [python.md](python.md), [method.md](method.md), [errata.md](errata.md).
"""


def research(folder: Path, images: Path) -> str:
    """The page; its runs go into `folder`, its figures into `images`."""
    terminal, found = Terminal(folder), dict[str, str]()
    shown = ("asked", "cost", "log det", "power", "model error", "signal", "proved")
    found["copy"], _ = terminal.run("examples", "first_order")
    found["least"], said = terminal.run("solve", "first_order.yaml", "-o", "least_costly", kept=shown)
    cost, white = (float(re.findall(rf"{word}([\d.]+)", said)[0]) for word in (r"cost +", "excitation: "))
    (floor,) = re.findall(r"at all gets below ([\d.]+)", said)
    found["over"] = f"{100.0 * (1.0 - float(floor) / cost):.0f}"
    found["white"] = f"{white / cost:.2g}"
    found["rival"], _ = terminal.run(
        *("solve", "first_order.yaml", "--set", "accuracy={criterion: D}", "--set", "cost=null"),
        *("--set", f"limits={{input_power: {cost}}}", "-o", "d_optimal"),
        kept=shown,
    )
    given = "spectrum={given: {signal: d_optimal/signal.csv}}"
    found["judged"], said = terminal.run(
        *("analyse", "first_order.yaml", "--set", given, "--set", "signal=null", "-o", "d_judged"), kept=shown
    )
    ratio = float(re.findall(r"r_u / r_adm at most ([\d.]+)", said)[0])
    found["ratio"], found["more"] = f"{ratio:.3g}", f"{ratio**2:.3g}"
    found["sweep"], _ = terminal.run(
        "sweep", "first_order.yaml", "--set", "spectrum.order=0:40:10", "-o", "orders"
    )
    found["simulated"], _ = terminal.run(
        *("simulate", "first_order.yaml", "--set", "simulation.runs=200", "-o", "simulated"),
        kept=("simulated",),
    )
    keep(folder / "least_costly", images, "research", bound="bound", optimality="optimality")
    keep(folder / "orders", images, "research", curves="curves")
    return filled(TEXT, found)


if __name__ == "__main__":
    write("research", research)
