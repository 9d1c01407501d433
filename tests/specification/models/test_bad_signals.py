"""What can be wrong with spectrum, signal, solver, simulation and report: where it is reported, under which code and key.

See `tests.support.bad_specs` for the sign §.
"""

# ruff: noqa: E501 (a row is easier to read on one line)

from __future__ import annotations

from tests.support.bad_specs import CONTINUOUS, Row, each

ROWS: list[Row] = [
    # spectrum
    ("missing-key", "spectrum", "type: white", {"§spectrum": "{order: 3}"}),
    ("unknown-word", "spectrum.type", 'did you mean "multisine"', {"spectrum": "{type: §multi-sine, lines: 3}"}),
    ("unsuitable-key", "spectrum.basis", "type: polynomial", {"spectrum": "{type: fir, §basis: legendre}"}),
    ("unsuitable-key", "spectrum.type", "given", {"spectrum": "{§type: fir, given: {type: white, power: 1}}"}),
    ("unknown-key", "spectrum.ordr", 'did you mean "order"', {"spectrum": "{type: fir, §ordr: 3}"}),
    ("missing-key", "spectrum.order", "type: polynomial", {"§spectrum": "{type: polynomial, band: [0, 1]}"}),
    ("missing-key", "spectrum", "lines or frequencies", {"§spectrum": "{type: multisine}"}),
    ("not-increasing", "spectrum.frequencies", "follows", {"spectrum": "{type: multisine, frequencies: §[1, 0.5]}"}),
    ("beyond-nyquist", "spectrum.frequencies[1]", "Nyquist", {"spectrum": "{type: multisine, frequencies: [1, §4]}"}),
    ("bad-band", "spectrum.frequencies[1]", "outside limits.band", {
        "spectrum": "{type: multisine, frequencies: [1, §2]}", "limits": "{band: [0, 1.5]}"}),
    ("missing-key", "spectrum.given", "type: white", {"spectrum": "{§given: {power: 1}}"}),
    ("missing-key", "spectrum.given.power", '"power"', {"spectrum": "{§given: {type: white}}"}),
    ("unsuitable-key", "spectrum.given.amplitudes", "type: multisine", {
        "spectrum": "{given: {type: white, power: 1, §amplitudes: [1]}}"}),
    ("wrong-shape", "spectrum.given.amplitudes", "1 amplitude, and", {
        "spectrum": "{given: {type: multisine, frequencies: [1, 2], amplitudes: §[1]}}"}),
    ("wrong-shape", "spectrum.given.power", "inputs is 1", {"spectrum": "{given: {type: white, power: §[1, 2]}}"}),
    # signal, solver, simulation
    ("unsuitable-key", "signal.phases", "type: multisine", {"signal": "{type: binary, §phases: random}"}),
    ("out-of-range", "signal.seed", "at least 0", {"signal": "{seed: §-1}"}),
    ("wrong-shape", "signal.offset", "inputs is 1", {"signal": "{offset: §[1, 2]}"}),
    ("out-of-range", "solver.tolerance", "less than 0.01", {"solver": "{tolerance: §0.1}"}),
    ("unknown-word", "solver.method", "exchange, lmi or alternating", {"solver": "{method: §simplex}"}),
    ("unknown-word", "simulation.compare[1]", "white", {"simulation": "{compare: [white, §whit]}"}),
    ("wrong-shape", "simulation.compare", "must be a list", {"simulation": "{compare: §white}"}),
    ("unstable-polynomial", "simulation.plant.A", "radius 2", {"simulation": "{plant: {B: [0, 1], A: §[1, -2]}}"}),
    ("wrong-shape", "simulation.plant", "2 inputs", {"simulation": "{§plant: {B: [[[1], [1]]]}}"}),
    ("wrong-shape", "simulation.plant", "not sampled", {"simulation": f"{{§plant: {CONTINUOUS}}}"}),
    ("conflicting-keys", "simulation.noise.relative_std", "variance", {
        "simulation": "{noise: {variance: 1, §relative_std: 0.1}}"}),
    ("missing-key", "simulation.noise", "variance or relative_std", {"simulation": "{§noise: {C: [1]}}"}),
    # report
    ("wrong-shape", "report.ellipses[0]", "two different parameters", {"report": "{ellipses: [§[b1]]}"}),
    ("wrong-shape", "report.ellipses[1]", "two different", {"report": "{ellipses: [[b1, f1], §[b1, b1]]}"}),
    ("not-a-text", "report.ellipses[0][1]", "a parameter name", {"report": "{ellipses: [[b1, §2]]}"}),
]  # fmt: skip


@each(ROWS)
def test_the_complaint_names_code_key_place_and_remedy(row, check_row):
    check_row(row)
