"""The shortest record within limits on single samples: simulated searches, enumeration, priors."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from unittest.mock import Mock, patch

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.signal import lfilter

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.questions import build_task
from inputdesign_cli.questions.common.record import Made, make_record
from inputdesign_cli.questions.least_cost.record_search import ShortestRecord, Way
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.selection import Record
from tests.support.refusals import code_of

# A lag whose spectrum alone needs five samples, and two inputs whose designs differ with the length.
LAG = """
plant: {B: [0, 1.0], F: [1, -0.9]}
noise: {variance: 0.1}
accuracy: {model_error: {relative: 0.05}}
spectrum: {type: fir, order: 4}
limits: {amplitude: 1}
signal: {candidates: 2, seed: 0}
solver: {any_spectrum: false}
"""
TWO = """
plant:
  A: [1, -0.7]
  B: [[[0, 1.0], [0, -0.5]], [[0, 0.6], [0, 1.2]]]
noise: {variance: [[0.5, 0.1], [0.1, 0.4]]}
accuracy: {model_error: {relative: 0.4}}
spectrum: {type: fir, order: 3}
limits: {amplitude: [1.0, 0.6]}
signal: {candidates: 1}
solver: {any_spectrum: false}
"""
SHORTEST = "objective: shortest_experiment\n"


@dataclass
class Ways:
    """Stand-ins for ways to make a record: they meet the accuracy from a length on, with information in
    proportion to it. `before` is the ratio by the prior alone; `tried` lists ways and lengths.
    """

    enough: Sequence[int]
    until: int = 1000
    before: float = np.inf
    tried: list[tuple[int, int]] = field(default_factory=list)

    def record(self, number: int, samples: int) -> Record:
        enough = self.enough[number]
        known = self.before**-2.0
        ratio = (known + samples / enough * (1.0 - known)) ** -0.5
        return Record(np.zeros((samples, 1)), "binary", ratio, met=samples >= enough)

    def way(self, number: int) -> Way:
        def made(samples: int, spectrum_of: int | None = None) -> Made:
            if len(self.tried) >= self.until:
                raise OutOfTimeError([])
            self.tried.append((number, samples))
            return Made(self.record(number, samples), Mock(), Mock())

        return made

    def found(self, start: int, block: int = 1, longest: int = 10**6) -> int | None:
        """The length that the search finds from `start` on, where the first way misses."""
        ways = [self.way(number) for number in range(len(self.enough))]
        made = ShortestRecord(ways, block, longest, self.before).search([self.record(0, start)])
        return None if made is None or made.record is None else len(made.record.samples)


@settings(deadline=None, max_examples=25)
@given(
    enough=st.lists(st.integers(20, 20_000), min_size=1, max_size=4),
    start=st.integers(2, 19),
    block=st.sampled_from([1, 4, 10]),
    before=st.sampled_from([np.inf, 3.0, 1.1, 1.001]),
)
def test_the_search_finds_the_shortest_length_of_all_ways_within_one_percent(enough, start, block, before):
    ways = Ways(enough, before=before)
    start = block * max(start // block, 1)
    if start >= min(enough):
        return
    found = ways.found(start, block)
    assert found is not None
    assert min(enough) <= found <= min(enough) * 1.011 + block
    assert found % block == 0
    lengths = {samples for _, samples in ways.tried}
    assert len(lengths) <= 24
    assert len(ways.tried) <= len(lengths) * len(enough)


@settings(deadline=None, max_examples=25)
@given(
    enough=st.lists(st.integers(3_000, 300_000), min_size=2, max_size=6),
    share=st.floats(0.3, 0.99),
    inputs=st.sampled_from([1, 2, 3]),
)
def test_few_long_records_are_made(enough, share, inputs):
    """Short records show which way is best, so that few long ones are made, and in the best way only."""
    ways = Ways(enough)
    start = max(int(share * min(enough)), 2_001)
    if start >= min(enough):
        return
    search = ShortestRecord([ways.way(n) for n in range(len(enough))], 1, 10**6, inputs=inputs)
    found = search.search([ways.record(0, start)])
    assert found is not None
    assert found.record is not None
    assert min(enough) <= len(found.record.samples) <= 1.011 * min(enough)
    long = [(number, samples) for number, samples in ways.tried if samples >= start]
    assert len(long) <= 4
    assert max(enough[number] for number, _ in long) <= 1.02 * min(enough)
    assert len(ways.tried) - len(long) <= len(enough)


LONG = """
plant: {B: [0, 1.0], F: [1, -0.9]}
noise: {variance: 1.0}
accuracy: {model_error: {relative: 0.012}}
spectrum: {type: fir, order: 4}
limits: {amplitude: 1}
solver: {any_spectrum: false}
"""


@pytest.mark.slow
def test_a_long_shortest_record_takes_few_records_of_its_length():
    """The work is the number of samples of all records, at most 15 times the length that is found."""
    made, plain = [], SignalGenerator.several

    def several(self, rngs):
        made.extend(self.samples for _ in rngs)
        return plain(self, rngs)

    with patch.object(SignalGenerator, "several", several):
        found = solve(parse_spec(LONG + SHORTEST)).result["signal"]
    assert found["samples"] > 4000
    assert found["worst_ratio"] <= 1.0 + 1e-9
    assert sum(made) <= 15 * found["samples"]


@pytest.mark.first(1)
@pytest.mark.parametrize("method", ["filtered_noise", "binary", "multisine"])
def test_candidates_of_a_record_that_is_far_from_the_accuracy_are_not_all_made(method):
    """No choice of phases compensates for a third less accuracy than required."""
    made, plain = [], SignalGenerator.several

    def several(self, rngs):
        made.extend(self.samples for _ in rngs)
        return plain(self, rngs)

    short = f"experiment: {{samples: 1500}}\nobjective: best_accuracy\nsignal: {{type: {method}}}\n"
    task = build_task(parse_spec(LONG + short))
    design = task.designed().design
    design = replace(design, problem=replace(design.problem, goal="cost"))
    with patch.object(SignalGenerator, "several", several):
        record = make_record(task.record, design, 1500)
    assert record is not None
    assert not record.met
    assert len(made) == 1


def test_a_search_ends_at_the_longest_record_and_at_the_time_limit():
    assert Ways([5000]).found(100, longest=4000) is None
    assert Ways([4000]).found(100, longest=4000) == 4000
    assert Ways([950]).found(100, longest=900) is None
    with pytest.raises(OutOfTimeError):
        Ways([5000], until=1).found(100)
    cut = Ways([5000], until=4)
    found = cut.found(4)
    assert found is not None
    assert found >= 5000


class Slow(Ways):
    """Ways for a plant that hardly responds within the first samples: short records predict too little."""

    def record(self, number: int, samples: int) -> Record:
        found = super().record(number, samples)
        return replace(found, worst_ratio=found.worst_ratio * (1000.0 if samples < 30 else 1.0))


@pytest.mark.parametrize("start", [3, 8, 20])
def test_uninformative_short_records_do_not_end_the_search(start):
    found = Slow([48]).found(start, longest=20_000)
    assert found is not None
    assert 48 <= found <= 49


def shortest_of_two_levels(b: float, pole: float, variance: float, relative: float, alpha: float) -> int:
    """The shortest record of levels -1 and 1 from rest for b q^-1 / (1 - pole q^-1), by enumeration."""
    w = np.linspace(0.0, np.pi, 400)
    z = np.exp(-1j * w)
    F = 1.0 - pole * z
    gradients = np.stack([z / F, -b * z**2 / F**2]) / np.abs(b * z / F)
    for samples in range(3, 16):
        u = np.array([(1.0, *rest, 0.0) for rest in itertools.product((1.0, -1.0), repeat=samples - 2)])
        of_b = lfilter([0.0, 1.0], [1.0, -pole], u)
        of_f = lfilter([0.0, -b], [1.0, -pole], of_b)
        psi = np.stack([of_b, of_f], axis=-1)
        covariances = np.linalg.inv(psi.swapaxes(1, 2) @ psi / variance)
        worst = np.zeros(len(u))
        for gradient in gradients.T:
            rows = np.stack([gradient.real, gradient.imag])
            worst = np.maximum(worst, np.linalg.eigvalsh(rows @ covariances @ rows.T)[:, -1])
        if alpha * np.sqrt(worst.min()) <= relative:
            return samples
    raise AssertionError


@pytest.mark.slow
@pytest.mark.parametrize("relative", [0.25, 0.2, 0.15])
def test_a_two_level_record_is_within_one_sample_of_the_shortest(relative):
    """All sequences are enumerated to find the shortest."""
    text = f"""
plant: {{B: [0, 1.0], F: [1, -0.7]}}
noise: {{variance: 0.1}}
accuracy: {{model_error: {{relative: {relative}, alpha: 2}}}}
spectrum: {{type: multisine, lines: 50}}
limits: {{amplitude: 1}}
signal: {{type: binary, seed: 1}}
solver: {{any_spectrum: false}}
objective: shortest_experiment
"""
    found = solve(parse_spec(text)).result["signal"]
    assert found["worst_ratio"] <= 1.0 + 1e-9
    least = shortest_of_two_levels(1.0, 0.7, 0.1, relative, 2.0)
    assert least <= found["samples"] <= least + 1


@pytest.mark.parametrize("kind", ["binary", "ternary"])
def test_a_shortest_record_has_the_whole_amplitude(kind):
    """Its first length, the least period of two inputs, needs less."""
    text = f"""
plant: {{A: [1, -0.177, -0.088], B: [[[0, -0.327], [-0.655, -0.567]]]}}
noise: {{variance: 0.012}}
accuracy: {{model_error: {{relative: 0.745, alpha: 2, band: [0.1, 2.8]}}}}
spectrum: {{type: free}}
limits: {{amplitude: 0.8}}
signal: {{type: {kind}, seed: 1, seconds: 3}}
objective: shortest_experiment
"""
    found = solve(parse_spec(text)).result["signal"]
    assert found["of_limits"]["amplitude.input"] == pytest.approx(1.0)
    assert found["samples"] < 14
    assert found["worst_ratio"] <= 1.0 + 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.3, 0.9, 0.96])
def test_a_prior_shortens_the_shortest_record(share):
    """Short records add almost nothing to a prior; in proportion to them no length would suffice."""
    text = LAG + SHORTEST
    known = np.array(solve(parse_spec(text)).result["information"]["matrix"])
    prior = f"experiment: {{prior: {{information: {(share * known).tolist()}}}}}\n"
    found = solve(parse_spec(text + prior)).result
    assert found["signal"]["worst_ratio"] <= 1.0 + 1e-9
    whole = solve(parse_spec(text)).result["signal"]["samples"]
    assert found["samples"] <= found["signal"]["samples"] < whole


@pytest.mark.first(1)
@pytest.mark.parametrize("more", [1e-6, 0.05, 3.0])
@pytest.mark.parametrize("text", [LAG, TWO], ids=["lag", "two inputs"])
def test_a_sufficient_prior_needs_no_experiment(text, more):
    known = np.array(solve(parse_spec(text + SHORTEST)).result["information"]["matrix"])
    prior = f"experiment: {{prior: {{information: {((1.0 + more) * known).tolist()}}}}}\n"
    found = solve(parse_spec(text + SHORTEST + prior)).result
    assert (found["status"], found["objective"]["value"]) == ("nothing_needed", 0.0)
    assert "signal" not in found


@pytest.mark.parametrize(("samples", "misses"), [(20, True), (4000, False)])
def test_a_stated_length_of_a_shortest_record_is_kept_and_doubted_if_it_misses(samples, misses):
    text = f"plant: {{B: [0, 0.2], F: [1, -0.8]}}\nnoise: {{variance: 0.1}}\n{SHORTEST}"
    text += "spectrum: {type: white}\naccuracy: {standard_deviation: {b1: 0.02}}\nlimits: {input_power: 1}\n"
    found = solve(parse_spec(f"{text}signal: {{samples: {samples}}}\n")).result
    codes = {one["code"] for one in found.get("findings", ())}
    assert found["signal"]["samples"] == samples
    assert (found["signal"]["worst_ratio"] > 1.0) == misses == ("record-misses-accuracy" in codes)


@pytest.mark.parametrize("relative", [0.2, 0.1, 0.05])
def test_where_power_alone_is_limited_the_record_is_as_long_as_it_must_be(relative):
    """The spectrum needs fewer samples than a record from rest, which loses the response to its last ones."""
    text = LAG.replace("amplitude: 1", "input_power: 1").replace("0.05", str(relative)) + SHORTEST
    found = solve(parse_spec(text)).result
    signal = found["signal"]
    assert found["objective"]["value"] + 1.0 < signal["samples"]
    assert signal["worst_ratio"] <= 1.0 + 1e-9
    assert signal["power"][0] <= 1.0 + 1e-9
    assert signal["extra_power"] == pytest.approx(signal["power"][0] - 1.0)


def test_where_no_record_within_the_longest_experiment_excites_every_parameter():
    text = LAG.replace("amplitude: 1", "input_power: 1, samples: 2").replace("0.05", "0.2") + SHORTEST
    assert code_of(solve, parse_spec(text), kind=InfeasibleError) == "limits-too-tight"


@pytest.mark.parametrize("limits", ["amplitude: 1", "input_power: 1"])
def test_a_shortest_record_that_is_too_long_to_compute_is_named_and_its_spectrum_kept(limits):
    text = LAG.replace("amplitude: 1", limits).replace("0.05", "2e-4") + SHORTEST
    found = solve(parse_spec(text)).result
    assert found["objective"]["value"] > 1e6
    assert "signal" not in found
    assert ("record-not-computed", "limits") in [(one["code"], one["where"]) for one in found["findings"]]
