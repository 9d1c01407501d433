"""The distance of an estimate from the plant of the spec, in whatever order its lags are named."""

from types import SimpleNamespace

import numpy as np
import pytest

from inputdesign_cli.findings.far_from_nominal import from_nominal
from inputdesign_cli.outcome.units import Units
from tests.support.plants import stated

UNITS = Units("s", 1.0, sampled=True, closed_loop=False, inputs=1, outputs=1)
TWO_LAGS = """sample_time: 1
plant:
  parameters: {{K: 2, T1: {}, T2: {}}}
  continuous: {{numerator: [K], denominator: [[T1, 1], [T2, 1]]}}
  sample: zoh
noise: {{variance: 1}}
"""


def estimate_of(theta, names, rivals=()):
    """An estimate with deviations of one; `rivals` are other minima by excess and parameters."""
    search = SimpleNamespace(rivals=[SimpleNamespace(excess=excess, theta=x) for excess, x in rivals])
    return SimpleNamespace(theta=theta, covariance=np.eye(theta.size), names=names, search=search)


@pytest.mark.parametrize(("lags", "deviations"), [((30.0, 4.0), 0.0), ((4.0, 30.0), 0.0), ((30.0, 9.0), 5.0)])
def test_exchanged_names_of_two_lags_do_not_count_as_another_plant(lags, deviations):
    estimated = stated(TWO_LAGS.format(4.0, 30.0))
    estimate = estimate_of(estimated.theta, estimated.names)
    found = from_nominal(UNITS, stated(TWO_LAGS.format(*lags)), estimated, estimate, [], estimate.covariance)
    assert found.nominal.deviations == pytest.approx(deviations)
    assert bool(found.listed) == (deviations > 4.0)


@pytest.mark.parametrize(("excess", "statistic"), [(0.2, 0.2), (6.0, 6.0), (50.0, 25.0)])
def test_another_minimum_at_the_nominal_plant_limits_the_distance(excess, statistic):
    nominal, estimated = (stated(TWO_LAGS.format(lag, 30.0)) for lag in (4.0, 9.0))
    estimate = estimate_of(estimated.theta, estimated.names, [(excess, nominal.theta)])
    found = from_nominal(UNITS, nominal, estimated, estimate, [], estimate.covariance)
    assert found.nominal.statistic == pytest.approx(statistic)
