"""What is offered for a plant that a record cannot tell from an integrator."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from inputdesign_cli.specification import parse_spec
from inputdesign_cli.tasks.build.system import build_model
from inputdesign_cli.tasks.result import integrating

PLANT = "plant: {B: [0, 1], F: [1, -0.7]}\n"


@pytest.mark.parametrize("loop", [True, False])
def test_an_integrator_in_a_loop_is_offered_with_its_controller(monkeypatch, loop):
    """Filled in, the offer is a spec; without a loop it has no controller."""
    monkeypatch.setattr(integrating, "_rises", lambda *_: True)
    model = parse_spec(f"sample_time: 1\n{PLANT}", design=False)
    parts = SimpleNamespace(model=build_model(model), moving=[0], used=[(None, np.zeros(100))])
    monkeypatch.setattr(integrating, "_deviations", lambda found, change: np.ones(len(change)))
    (reason,) = integrating.like_integrators(parts, 1.0, "s", loop=loop)
    offer = r"(plant: .*? sample: zoh\})(?:, and the controller as it was, )?(.*)$"
    plant, law = re.search(offer, reason).groups()
    spec = parse_spec(f"sample_time: 1\n{plant}\n{law.replace('..', '1')}\n", design=False)
    assert (spec.experiment.controller is not None) == loop
