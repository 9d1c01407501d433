"""The noise of a spec: as it is stated, estimated from data at rest, or taken from the model of a log."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.specification import Noise, Spec
from inputdesign_cli.specification.fading_noise import DRIFT_STEP, WHITE, discrete, drifting
from inputdesign_cli.specification.models.units import SECONDS
from inputdesign_cli.wizard.grammar import NUMBER, UNIT, Phrase, needed, short
from inputdesign_cli.wizard.plants import PlantAnswer, unit_of_time
from inputdesign_cli.wizard.questions import AS_LOGGED, bad_answer, chosen, file_of, in_their_words

_CHANGES = r"(?:fad|chang|var[yi]|wander)\w*"
_LASTING = (
    rf"{_CHANGES}(?: slowly)?(?: in| within| over)?|(?:with (?:an? )?)?(?:correlation time|memory)|lasts"
    r"|slow(?:ly)?"
)
_SLOWLY = rf"\b(?:{_CHANGES} )?slow(?:ly)?\b(?: {_CHANGES})?"
_FADING = 0.2  # assumed correlation time of noise, as a share of the time constant of the plant
_SAME_STEP = 0.01  # relative difference at which rows and samples count as equally far apart
_DEVIATION = "(?:(?:noise )?(?:standard deviation|deviation|std|rms|sigma)|noise)"
_WHITE = 3.0  # a correlation of more than this number of standard deviations is not that of white noise
_FEWEST = 20  # rows of data at rest
_STRONGEST = 0.98  # largest correlation from one sample to the next
_SAID = "the output drifts, as you said"
_STEADY = 1e-3  # a D(1) below it counts as an integrator
_LONG = 100_000  # samples after which the impulse response of a log's noise has decayed


@dataclass(frozen=True)
class _Level:
    """Holds the standard deviation of the noise, its colour, and how they are known."""

    deviation: float
    why: str
    fades: float | None = None  # its correlation time as stated, in time_unit; 0 for white noise
    pole: float = 0.0  # the pole that data at rest show
    guessed: bool = False  # its colour is not known
    rounded: bool = False  # the deviation is a lower bound, due to rounding
    drifts: bool = False
    slow: bool = False  # its correlation time is the time constant of the plant


def noise_lines(text: str, drift: str, folder: Path, plant: PlantAnswer) -> list[str]:
    """Return the lines of `noise` from the answers, and from the model of a log where they leave it open.

    Noise of unknown colour gets a pole, which costs a parameter. Correlated noise has more power at the
    frequencies of a plant than white noise of its size, so that white noise would promise too much.

    Raises:
        SpecError: `bad-answer`.
        DataError: a file cannot be used.
    """
    explored = plant.explored
    moves = explored is not None and _moves(explored.noise)
    level = None if text.lower() in AS_LOGGED and explored else _stated(text, folder, plant)
    moved = moves or (level is not None and level.drifts)
    drifts = chosen("drift", drift, {"yes": True, "no": False, "not known": moved})
    regressed = explored is not None and explored.plant.kind == "polynomial" and len(explored.plant.A) > 1
    if explored is not None and (level is None or level.fades is None or regressed):  # A colours noise, too
        return _beside_log(explored, level, plant.source, moves=moves, drifts=drifts)
    assert level is not None
    fades, pole, why = level.fades, level.pole, level.why
    colour = f"fades in {short(fades)} {plant.time_unit}, as you said" if fades else "white"
    if level.slow:
        colour = 'as long as the plant: that is how "slowly" is taken'
    if level.guessed and not drifts:
        fades = float(f"{max(_FADING * plant.slow, 2.0 * plant.sample_time):.1g}")
        colour = "a guess, for noise is seldom white; called white it would promise too much accuracy"
    variance = level.deviation**2 * (1.0 - pole**2)
    if fades:
        variance, pole = discrete(level.deviation, fades, plant.sample_time)
    exact = f"D: [1, {short(-pole)}], variance: {short(variance)}"
    if fades and not drifts:
        return [
            f"noise:  # every {short(plant.sample_time)} {plant.time_unit} exactly e/D with {exact}",
            f"  standard_deviation: {short(level.deviation)}  # {why}",
            f"  correlation_time: {short(fades)}  # {colour}",
        ]
    variance, zero = drifting(variance, pole) if drifts else (variance, 0.0)
    lines = ["noise:", f"  variance: {short(variance)}  # {why}", *_drift(drifts, _SAID)]
    lines += [f"  C: [1, {short(-zero)}]"] * drifts
    return lines + [f"  D: [1, {short(-pole)}]  # {colour if fades else why}"] * bool(pole)


def _beside_log(explored: Spec, level: _Level | None, source: str, *, moves: bool, drifts: bool) -> list[str]:
    """Return the spec's lines of noise with the spectrum of a log's model, scaled to the stated size.

    A resolution is a lower bound on noise, and the log may show more. If the log drifts but the answer denies
    it, the noise is white; if only the answer has a drift, the noise gets an integrator.
    """
    noise, plant = explored.noise, explored.plant
    assert plant.kind != "regression"
    A = _per_output(plant.A if plant.kind == "polynomial" else (1.0,), plant.outputs)
    variance = noise.covariance(len(A))
    powers = np.diag(variance)
    if not moves:  # the noise power over that of e, for each output
        impulse = np.eye(1, _LONG)[0]
        rows = zip(_per_output(noise.C, len(A)), _per_output(noise.D, len(A)), A, strict=True)
        gains = [np.sum(filtered(c, np.convolve(d, a), impulse) ** 2) for c, d, a in rows]
        powers = powers * np.array(gains)
    if level is not None:
        shares = level.deviation**2 / powers
        scale = np.sqrt(np.maximum(shares, 1.0) if level.rounded else shares)
        variance = variance * np.outer(scale, scale)
    own = short(variance[0, 0]) if len(A) == 1 else json.dumps(variance.tolist())
    why = f"as in {source}" if level is None else f"{level.why}; as in {source} otherwise"
    seen = f"{', '.join(map(short, powers))}, {'and drift' if moves else 'and no drift'}"
    lines = [f"noise:  # the log has a variance of {seen}", f"  variance: {own}  # {why}"]
    if moves and not drifts:
        return lines
    C, D = _per_output(noise.C, len(A)), _per_output(noise.D, len(A))
    drift, new = (True, (1.0, DRIFT_STEP - 1.0)) if drifts and not moves else (noise.drift, (1.0,))
    C = [np.convolve(row, new).tolist() for row in C]
    named = [(name, rows) for name, rows in (("C", C), ("D", D)) if any(len(row) > 1 for row in rows)]
    shape = [f"  {name}: {json.dumps(rows if len(rows) > 1 else rows[0])}" for name, rows in named]
    return [*lines, *_drift(drift, "the log shows it" if moves else _SAID), *shape]


def _moves(noise: Noise) -> bool:
    """Return whether noise drifts, or has so long a correlation time that it resembles drift."""
    longest = min(abs(float(np.sum(row))) for row in _per_output(noise.D, 1))
    return bool(np.any(noise.drift)) or longest < _STEADY


def _per_output(rows: Sequence[Any], outputs: int) -> Sequence[Sequence[float]]:
    """Return one polynomial for each output."""
    return rows if isinstance(rows[0], Sequence) else [rows] * outputs


def _drift(drift: Any, why: str) -> list[str]:
    return [f"  drift: {json.dumps(drift)}  # an integrator in the noise: {why}"] * bool(np.any(drift))


def _stated(text: str, folder: Path, plant: PlantAnswer) -> _Level:
    """Return the noise level that an answer states."""
    if text.lower() in AS_LOGGED:
        raise bad_answer("noise", 'the plant is no log: write plant "log FILE", or here "rest FILE"')
    if rests := re.fullmatch(r"(?:rest|as in)\s+(.*)", text, re.I):
        return _at_rest(folder / rests[1].strip(), plant)
    said, step = Phrase(text, "noise", plant.clock, plant.units[0]), plant.sample_time
    white, drifts = (
        said.take(r"\bwhite\b") is not None,
        said.take(r"\b(?:slowly )?drift\w*(?: slowly)?") is not None,
    )
    fades = 0.0 if white else said.after(_LASTING, "time")
    if (
        fades is not None
        and not white
        and needed(fades, "noise", "the time in which it fades") < WHITE * step
    ):
        unit = plant.time_unit
        why = f"noise that fades in {short(fades)} {unit} is white in samples {short(step)} {unit} apart"
        raise bad_answer("noise", f'{why}: write "white"')
    slow = fades is None and said.take(_SLOWLY) is not None
    fades = max(plant.slow, WHITE * step) if slow else fades
    rounding = _resolution(said)
    deviation = said.after(_DEVIATION, named=True)
    if deviation is None and not re.fullmatch(rf"\s*{NUMBER}\s*", text):
        deviation = said.number(rf"^[\s|]*{NUMBER}({UNIT})")
    said_both = {"the standard deviation": deviation, "the resolution": rounding}
    sizes = {what: needed(one, "noise", what) for what, one in said_both.items() if one is not None}
    if not sizes:
        raise bad_answer("noise", "it does not say a standard deviation or a resolution")
    said.finish("which noise")
    spoken = " ".join(text.split())
    because = [f'standard deviation {short(deviation)} ("{spoken}")'] if deviation is not None else []
    if rounding is not None:
        least = "" if because else ": the least that noise can be"
        because.append(f"rounding to {short(rounding)} has a variance of its square over 12{least}")
    size = math.hypot(deviation or 0.0, (rounding or 0.0) / math.sqrt(12.0))
    guessed = fades is None and deviation is not None
    return _Level(
        size,
        "; ".join(because),
        fades,
        guessed=guessed,
        rounded=rounding is not None,
        drifts=drifts,
        slow=slow,
    )


def _resolution(said: Phrase) -> float | None:
    """Return the step of a sensor's resolution, stated or computed from bits and range; None if neither."""
    begins = r"\bresolution\b\s*(?:of\s*)?"
    bits = said.take(rf"{begins}(\d+)\s*bits?\s*(?:up to|over|to|range)\s*{NUMBER}({UNIT})")
    if bits is not None:
        return needed(said.sized(float(bits[2]), bits[3].strip()), "noise", "its range") / 2.0 ** int(bits[1])
    counted = said.take(rf"{begins}{NUMBER}[\s-]*(bits?|digits?|levels?|counts?|steps?)\b")
    if counted is not None:
        why = f"{counted[1]} {counted[2]} are no size without a range"
        raise bad_answer("noise", f'{why}: "resolution 12 bits up to 100", or the step itself')
    return said.after("resolution", named=True)


def _at_rest(path: Path, plant: PlantAnswer) -> _Level:
    """Return the level of the noise in the column y of a file in which u, if it is there, rests.

    If rows are not as far apart as samples, noise with one pole is assumed. Its correlation decays by the
    same factor in the same time.
    """
    from inputdesign_cli.questions.building.tables import read_samples
    from inputdesign_cli.records import read_sheet
    from inputdesign_cli.records.columns import columns_of, time_columns

    file_of("noise", path)
    with in_their_words({}, "noise"):
        sheet = read_sheet(path, key="noise")
        wanted = {"y": "y"} | {name: name for name in sheet.header if name.lower() in ("u", "u1")}
        found, apart = read_samples(path, wanted, key="noise"), 0.0
        for name in time_columns(sheet)[:1]:
            times = columns_of(sheet, {"time": name})["time"]
            apart = float(np.median(np.diff(times))) * SECONDS[unit_of_time(sheet, name)] / plant.clock
    step = plant.sample_time
    y, apart = found.pop("y"), apart if apart > 0.0 else step
    if any(np.ptp(u) > 0.0 for u in found.values()):
        raise bad_answer("noise", f'u in {path.name} moves: name its plant, too, as "log {path.name}"')
    if y.size < _FEWEST:
        raise bad_answer("noise", f"{path.name} has {y.size} rows, and {_FEWEST} are the least")
    v = y - y.mean()
    power = float(np.mean(v**2))
    if power == 0.0:
        raise bad_answer("noise", f"y of {path.name} does not change; write the resolution of the sensor")
    rho = float(np.mean(v[1:] * v[:-1]) / power)
    same = abs(apart - step) <= _SAME_STEP * step
    seen = f"of {path.name}: {y.size} samples" + ("" if same else f", {short(apart)} {plant.time_unit} apart")
    if abs(rho) <= _WHITE / np.sqrt(y.size):
        return _Level(math.sqrt(power), f"{seen}, white as far as they show")
    pole = min(rho if same else max(rho, 0.0) ** (step / apart), _STRONGEST)
    why = f"{seen}, correlation {rho:.2g} from one to the next"
    return _Level(math.sqrt(power), why, pole=pole)
