"""Designs of many parameters: proofs close, whatever the solver leaves of a face."""

import json

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.design.convex.designs import solve_design
from inputdesign_cli.questions.task import build_task


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1])
def test_sixteen_parameters(seed):
    """An output-error plant of order 8; the face once shrank to what the last round used, and cycled."""
    rng = np.random.default_rng([seed, 8])
    roots = rng.uniform(0.5, 0.9, 4) * np.exp(1j * rng.uniform(0.2, 2.9, 4))
    F = np.poly(np.concatenate([roots, roots.conj()])).real
    B = np.concatenate([[0.0], rng.normal(size=8)])
    z = np.exp(-1j * np.linspace(0.0, np.pi, 8001))
    B = B / np.abs(np.polyval(B[::-1], z) / np.polyval(F[::-1], z)).max()
    spec = {
        "plant": {"B": B.tolist(), "F": F.tolist()},
        "noise": {"variance": 0.01},
        "experiment": {"samples": 1000},
        "cost": {"input_power": 1},
        "accuracy": {"model_error": {"absolute": 0.1, "alpha": 2.0}},
        "spectrum": {"type": "fir", "order": 40},
    }
    task = build_task(parse_spec(json.dumps(spec)))
    design = solve_design(task.asked.question, tolerance=1e-6, any_spectrum_tolerance=1e-3)
    assert design.result.gap <= 1e-6
    assert design.any_spectrum.gap <= 1e-3
    assert design.problem.demands.worst_ratio(design.result.informations).ratio <= 1.0 + 1e-9
    # Any frequencies at all make a relaxation: a plain bound by the active ones holds.
    assert design.any_spectrum.certificate.bound <= design.result.objective
