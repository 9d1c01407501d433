"""Instructions for the experiment: signals to apply and to log, and the command that judges the record."""

from __future__ import annotations

import re
import shlex
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from inputdesign_cli.outcome.results import Results

# The channel of a header such as "u1 valve (%)".
_CHANNEL = re.compile(r"[ruy]\d+(?= |$)")


def instructions(results: Results, spec: str, joint: str = "") -> list[str]:
    """Return sentences on the signals to apply and to log, and the judging command; none without a record.

    Args:
        spec: the file that `assess` gets.
        joint: the command that judges the record together with earlier ones; empty if there are none.
    """
    signal, tables = results.outcome.signal, results.tables
    if signal is None or "predicted_output" not in tables:
        return []
    applied, caused = (
        [name.split()[0] for name in tables[table].columns if _CHANNEL.match(name)]
        for table in ("signal", "predicted_output")
    )
    inputs, outputs = [f"u{name[1:]}" for name in applied], [name for name in caused if name[0] == "y"]
    in_loop, around = applied[0].startswith("r"), signal.operating_point
    logged = ["time", *(applied if in_loop else []), *inputs, *outputs]
    step = f"{signal.sample_time:g} {results.time_unit}"
    where = "" if around is None else " at the operating point"
    how = " as r in u = r - C y (y counted from rest)" if in_loop else ""
    said = [
        f"Bring the plant to rest{where}, log {', '.join(logged[:-1])} and {logged[-1]} every {step}, "
        f"and apply signal.csv{how}."
    ]
    levels = " and ".join(f"{level:.6g}" for level in around or () if level)
    if in_loop:
        has = f"has the level {levels} of the input in it" if levels else "has no level"
        said.append(
            "r is what the controller adds its part to, and may go further than the actuator. In signal.csv "
            f"it {has}: while y rests, u = r. Log u as it is, level included, and r as applied."
        )
    if joint:
        return [*said, f"Then: {joint}"]
    judge = f"Then: idesign assess {shlex.quote(spec)} log.csv"
    if around is not None:
        known = [f"{name}={level:g}" for name, level in zip(inputs, around, strict=True)]
        point = ",".join([*known, *(f"{name}=REST" for name in outputs)])
        means = (
            f"in place of REST, the mean of {' and '.join(outputs)} while the plant rests, before signal.csv"
        )
        judge += f" --operating-point {point}   ({means})"
    if any(" " in name for name in (*tables["signal"].columns, *tables["predicted_output"].columns)):
        columns = ",".join(f"{name}=NAME" for name in ("time", *inputs, *outputs))
        said.append(f"Where the log has other names of columns, add --columns {columns}.")
    return [*said, judge]
