"""A campaign on a simulated plant, one part after the other, as a user applies them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from inputdesign_cli import parse_spec
from inputdesign_cli.identification import information_of_data
from inputdesign_cli.questions.campaign.build import build_planner
from inputdesign_cli.questions.campaign.plans import Planner, standing
from inputdesign_cli.questions.campaign.schedule import Standing

SPEC = """
title: in parts
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {variance: 1.0}
experiment: {samples: 200}
accuracy: {model_error: {relative: 0.05, alpha: 2.45}}
spectrum: {type: fir, order: 4}
signal: {candidates: 1}
solver: {any_spectrum: false}
campaign: {block: 60}
"""
GAIN, POLE = 3.5, 0.72


def answered(
    u: np.ndarray, seed: int = 5, gain: float = GAIN, poles: tuple[float, ...] = (POLE,)
) -> np.ndarray:
    """The output (n,) of the true plant for u (n,) from rest, with white noise of variance one."""
    e = np.random.default_rng(seed).standard_normal(2000)[: len(u)]
    return lfilter([0.0, gain], np.poly(poles), u) + e


def planned(directory: Path) -> np.ndarray:
    """Times and samples (n, 2) of all plans so far, one after the other."""
    parts = sorted(directory.glob("plan_*.csv"))
    return np.concatenate([np.loadtxt(part, delimiter=",", skiprows=1, ndmin=2) for part in parts])


def written(path: Path, times: np.ndarray, u: np.ndarray, y: np.ndarray) -> Path:
    """A record as a logger writes it."""
    np.savetxt(path, np.column_stack([times, u, y]), delimiter=",", header="time_s,u,y", comments="")
    return path


def applied(directory: Path, path: Path, scale: float = 1.0, **plant: object) -> Path:
    """Apply the next part of a campaign to the true plant, and write its record."""
    times, u = planned(directory).T
    n = len(np.loadtxt(directory / "signal.csv", delimiter=",", skiprows=1, ndmin=2))
    y = answered(scale * u, **plant)
    return written(path, times[-n:], scale * u[-n:], y[-n:])


def planner(text: str = SPEC, *overrides: str) -> Planner:
    """The planner of the parts of a spec."""
    return build_planner(parse_spec(text, overrides=overrides))


def record(samples: int = 200, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """White noise (n, 1), and the output (n, 1) of the true plant."""
    u = np.random.default_rng(seed).standard_normal(samples)
    return u[:, None], answered(u)[:, None]


def stands(at: Planner, theta: Sequence[float] = (), share: float = 1.0, samples: int = 40) -> Standing:
    """The knowledge for the next plan at some parameters, with a share of the information of a record."""
    (u, y), model = record(samples), at.nominal.model
    model = model.at(np.array(theta), np.array([[1.0]])) if theta else model
    known = standing(at, model, lambda m: share * information_of_data(m, u, y), at.nominal.model)
    assert known is not None
    return known


def found(result: dict, code: str) -> list[dict]:
    """The findings of a result that have this code; each stands in the notes as well."""
    listed = [one for one in result.get("findings", []) if one["code"] == code]
    assert result.get("notes", []) == [one["message"] for one in result.get("findings", [])]
    return listed
