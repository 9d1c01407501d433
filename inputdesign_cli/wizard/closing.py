"""What to apply, what to log, and how it is judged, in the user's words."""

from __future__ import annotations

import re

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.specification import Spec
from inputdesign_cli.wizard.phrases import short


def to_log(spec: Spec, results: Results, file: str) -> list[str]:
    """What to record, and how it is judged."""
    applied, caused = (
        [name for name in results.tables[table].columns if re.fullmatch(r"[ruy]\d+", name)]
        for table in ("signal", "predicted_output")
    )
    numbers = [name[1:] for name in applied]
    inputs, outputs = [f"u{n}" for n in numbers], [name for name in caused if name.startswith("y")]
    # A coarse converter holds none but levels of its own, and the record swings about one of these.
    point_of = results.result.get("signal", {}).get("operating_point", spec.signal.offset or 0.0)
    levels = np.broadcast_to(np.asarray(point_of, dtype=float), len(inputs))
    references = any(name.startswith("r") for name in applied)
    what = ", ".join(["time", *inputs, *outputs[:-1]])
    known = [f"{name}={level:g}" for name, level in zip(inputs, levels, strict=True)]
    point = ",".join([*known, *(f"{name}=REST" for name in outputs)])
    apply = "apply signal.csv"
    if references:
        apply = (
            "apply signal.csv as r in u = r - C y (C y counted from rest; r is no position of the actuator)"
        )
    return [
        f"Bring the plant to rest at the operating point, {apply}, and log "
        f"{what} and {outputs[-1]} every {short(spec.sample_time)} {spec.time_unit}.",
        *(_of_references(levels) if references else ()),
        f"Then: idesign assess {file} log.csv --operating-point {point}   (REST: the level of "
        f"{' and '.join(outputs)} before it began)",
    ]


def _of_references(levels: Array) -> list[str]:
    """Whether the level of the inputs (r,) belongs into r, and r into the log."""
    told = " and ".join(f"{level:g}" for level in levels)
    into = f"r in signal.csv has the level {told} of the input in it" if np.any(levels) else "r has no level"
    return [
        f"{into}: while y rests, u = r. Log u as it is, level included; r need not be logged, and where it "
        "is, it is logged as applied: its level does not matter to assess."
    ]
