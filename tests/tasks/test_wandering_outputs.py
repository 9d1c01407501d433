"""A log whose output wanders as a random walk does, beside the steps of its input."""

import numpy as np

from inputdesign_cli.specification import parse_spec
from inputdesign_cli.tasks import explore, solve
from inputdesign_cli.tasks.build.preparation import Preparation
from tests.identification.explore.test_integrated import GAIN, LAG, LATE, lagged, steps, walk


def test_the_plant_is_told_and_the_next_experiment_heeds_the_walk(tmp_path):
    rng = np.random.default_rng(1)
    u = steps()
    y = 60.0 + lagged(u) + walk(rng, u.size, 0.06) + 0.04 * rng.standard_normal(u.size)
    log = tmp_path / "log.csv"
    np.savetxt(
        log, np.column_stack([np.arange(u.size), 45.0 + u, y]), delimiter=",", header="time,u,y", comments=""
    )
    done = explore([log], Preparation())
    assert done.reasons == ()
    (output,) = done.results.result["exploration"]["outputs"]
    assert output["noise_integrates"] is True
    assert any("wanders as a random walk" in note for note in done.results.result["notes"])
    spec = parse_spec(done.results.resolved_spec, overrides=["signal=null", "spectrum.order=5"])
    design = solve(spec)
    assert design.result["status"] == "optimal"
    assert spec.noise.drifts == (True,)
    found = done.results.result["identification"]
    deviation = found["standard_deviation"]
    for name, truth in (("K", GAIN), ("T", LAG), ("L", LATE)):
        assert abs(found["theta"][name] - truth) < 4.0 * deviation[name], name
