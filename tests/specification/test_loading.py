"""Valid specs: their content, their defaults, and the places of their keys."""

from __future__ import annotations

import dataclasses
import math
import pickle
from pathlib import Path

import pydantic
import pytest

from inputdesign_cli.errors import Diagnostic, InfeasibleError, SpecError
from inputdesign_cli.specification import load_spec, parse_spec
from inputdesign_cli.specification.models.spectrum import GivenWhite

HERE = Path(__file__).parent
SPECS = sorted([*(HERE / "data").glob("*.yaml"), *(HERE.parents[1] / "specs").glob("*.yaml")])

GOOD = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 1}\naccuracy: {model_error: {relative: 0.01}}\n"
REST = "noise: {variance: 1}\naccuracy: {model_error: {relative: 0.01}}\n"


def by_name(name):
    return load_spec(next(p for p in SPECS if p.stem == name))


@pytest.mark.parametrize("path", SPECS, ids=lambda p: p.stem)
def test_every_example_loads_and_survives_writing_and_pickling(path):
    spec = load_spec(path)
    again = parse_spec(spec.to_yaml())
    assert again.sha256 == spec.sha256
    assert again.model_dump() == spec.model_dump()
    assert again.to_yaml() == spec.to_yaml()
    copy = pickle.loads(pickle.dumps(spec))
    assert copy.model_dump() == spec.model_dump()
    assert copy.locate("plant") == spec.locate("plant")


def test_factors_are_multiplied_and_variances_repeated():
    spec = by_name("flexible_transmission")
    controller = spec.experiment.controller
    # (1 - p z) times a polynomial, multiplied out by hand
    p, factor = 0.999455, controller.denominator_factors[1]
    expected = [a - p * b for a, b in zip((*factor, 0.0), (0.0, *factor), strict=True)]
    assert controller.denominator_polynomial == pytest.approx(expected)
    assert spec.clip_band(spec.accuracy.model_error.band) == (0.001, math.pi)
    assert by_name("two_by_two").plant.continuous.denominator_matrix[1][0] == (1.0, 0.5, 1.063)
    plant = "plant: {continuous: {numerator: [[[1], [2]]], denominator: [[1, 2], [1, 3]]}, sample: zoh}\n"
    rows = parse_spec(plant + REST).plant.continuous.denominator_matrix
    assert rows == (((1.0, 5.0, 6.0), (1.0, 5.0, 6.0)),)
    assert by_name("distillation_column").noise.covariance(2).tolist() == [[1e-10, 0.0], [0.0, 1e-10]]


def test_defaults_depend_on_the_rest_of_the_spec():
    open_loop = parse_spec(GOOD)
    assert (open_loop.cost.input_power, open_loop.cost.output_power) == (1.0, 0.0)
    assert open_loop.spectrum.type == "fir"
    assert open_loop.accuracy.model_error.probability == 0.95
    solver = open_loop.solver
    assert (solver.method, solver.tolerance, solver.grid) == ("exchange", 1e-7, 1000)
    closed = parse_spec(GOOD + "experiment: {controller: {numerator: [0.1]}}\n")
    assert (closed.cost.input_power, closed.cost.output_power) == (1.0, 1.0)
    asked = GOOD.replace("model_error: {relative: 0.01}", "criterion: D")
    best = parse_spec(asked + "limits: {input_power: 1}\n")
    assert best.spectrum is None
    assert best.goal == "best_accuracy"
    given = "spectrum: {given: {type: white, power: 1.7}}\n"
    analysis = parse_spec("plant: {B: [0, 1]}\nnoise: {variance: 1}\n" + given)
    assert not analysis.designs
    assert analysis.spectrum.given == GivenWhite(type="white", power=1.7)


ALLOWED = """\
limits: {input_power: {min: 1, max: [2]}, output_power: [1], rate: 1, amplitude: [2], energy: 3}
limits: {spectrum: 40}
limits: {spectrum: {max: {numerator: [1], denominator: [1, -0.5]}, min: 0}}
limits: {spectrum: {max: {table: cap.csv}, min: {continuous: {numerator: [1]}}}}
limits: {samples: 2000, band: [0, 3.1416]}
spectrum: {type: multisine, lines: 200}
spectrum: {type: multisine, frequencies: [0, 1, 3.14159265358979]}
spectrum: {type: free}
spectrum: {type: polynomial, basis: legendre, order: 3, band: [0, 2], factor_columns: 1}
spectrum: {type: pointwise}
spectrum: {given: {type: multisine, frequencies: [0.1, 1], amplitudes: [1, -1]}}
spectrum: {given: {type: multisine, frequencies: [0.1, 1], amplitudes: [[1, 2]]}}
spectrum: {given: {type: table, file: phi.csv}}
spectrum: {given: {signal: u.csv}}
signal: {type: multisine, phases: optimised, periods: 4, lines: 30, offset: 5, ramp: 9}
signal: {type: prbs, bits: 10, hold: 3, amplitudes: [1], candidates: 2}
solver: {method: lmi, grid: 500, positivity: kyp, tolerance: 1e-5}
objective: least_cost
simulation: {plant: {continuous: {numerator: [1], denominator: [1, 1]}, sample: zoh}, compare: []}
experiment: {samples: 500.0, prior: {information: [[1, 0], [0, 2]], parameters: [b1, f1]}}
experiment: {prior: {information: old.csv}}
title: 2024
time_unit: min
"""


@pytest.mark.parametrize("extra", ALLOWED.splitlines())
def test_valid_blocks_are_accepted_and_survive_writing(extra):
    spec = parse_spec(GOOD + extra + "\n")
    assert parse_spec(spec.to_yaml()).model_dump() == spec.model_dump()


LEAST_COST = """\
{model_error: {absolute: 0.1, weight: {numerator: [1], denominator: [[1, -0.5], [1]]}}}
{model_error: {table: r.csv, band: [0.1, 3], region: ellipsoid}}
{model_error: {sensitivity: {max_db: 6, controller: {numerator: [1]}}}}
{information: [[1, 0], [0, 1]]}
{information: {parameters: [b1, f1], matrix: [[1, 0], [0, -1]]}}
{application: {parameters: [b1, f1], hessian: [[1, 1], [1, 1]], gamma: 100}}
{weighted_variance: {weight: {continuous: {numerator: [1]}, sample: zoh}, max: 0.01}}
{weighted_variance: {max: 1, band: [0, 1]}}
{standard_deviation: {b1: 0.01, 'b3[1,2]': 1e-3}}
"""
BEST_ACCURACY = """\
{criterion: E, scale: relative}
{criterion: A, model_error: {relative: 0.1}}
{closed_loop_error: {control: {internal_model: {numerator: [0.5]}}}}
{closed_loop_error: {control: {model_reference: {numerator: [[[0, 1]]]}}}}
{closed_loop_error: {control: {minimum_variance: true}, reference: {variance: 2}}}
"""


@pytest.mark.parametrize(
    ("goal", "accuracy"),
    [
        *(("least_cost", line) for line in LEAST_COST.splitlines()),
        *(("best_accuracy", line) for line in BEST_ACCURACY.splitlines()),
    ],
)
def test_valid_accuracies_are_accepted_and_set_the_goal(goal, accuracy):
    extra = f"limits: {{input_power: 1}}\naccuracy: {accuracy}\n"
    spec = parse_spec("plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 1}\n" + extra)
    assert spec.goal == goal
    assert len(spec.accuracy.requirements) + len(spec.accuracy.goals) >= 1


def test_the_spec_is_frozen():
    spec = parse_spec(GOOD)
    with pytest.raises(pydantic.ValidationError):
        spec.plant = spec.plant
    with pytest.raises(pydantic.ValidationError):
        spec.plant.B = (1.0,)


def test_keys_are_located_by_line_and_column():
    text = "plant:\n  B: [0, 1]\n  F:\n    - 1\n    - -0.5\nnoise: {variance: 1}\n"
    text += "accuracy:\n  standard_deviation:\n    b3[1,2]: 0.5\n"
    spec = parse_spec(text, "my.yaml")

    places = {
        "plant": (1, 1),
        "plant.B": (2, 6),
        "plant.B[1]": (2, 10),
        "plant.B.1": (2, 10),
        "plant.F": (4, 5),
        "plant.F[1]": (5, 7),
        "noise.variance": (6, 19),
        "accuracy.standard_deviation.b3[1,2]": (9, 14),
        # An absent key is located at the entry that would hold it.
        "plant.A": (1, 1),
        "plant.B[7]": (2, 6),
        "noise.C[0]": (6, 1),
    }
    assert {key: (spec.locate(key).line, spec.locate(key).column) for key in places} == places
    assert spec.locate("plant.B").file == "my.yaml"
    assert spec.locate("plant.B").text == "  B: [0, 1]"


def test_errors_raised_elsewhere_are_located_in_the_spec():
    spec = parse_spec(GOOD, "my.yaml")
    error = spec.complain("unstable-polynomial", "no good", hint="mend", key="plant.F")
    assert isinstance(error, SpecError)
    place = spec.locate("plant.F")
    assert error.diagnostics == (Diagnostic("unstable-polynomial", "no good", "mend", "plant.F", place),)
    bare = InfeasibleError([Diagnostic("a-b", "one", key="noise.variance"), Diagnostic("c-d", "two")])
    placed = spec.place(bare)
    assert type(placed) is InfeasibleError
    located = dataclasses.replace(bare.diagnostics[0], location=spec.locate("noise.variance"))
    assert placed.diagnostics[0] == located
    assert placed.diagnostics[1] == bare.diagnostics[1]


def test_the_fingerprint_depends_on_the_content_only():
    spec = parse_spec(GOOD)
    lines = GOOD.replace("variance: 1}", "variance: 1.0}").splitlines()
    assert parse_spec("\n".join(["# comment", *reversed(lines)])).sha256 == spec.sha256
    assert parse_spec(GOOD.replace("0.01", "0.02")).sha256 != spec.sha256
    assert len(spec.sha256) == 64


def test_texts_that_look_like_other_things_stay_texts():
    for title in ("1e-3", "yes", "null", "010", "2001-01-01", "", "a: b", "# x", "ü\u2028", "1.5"):
        spec = parse_spec(GOOD).to_yaml()
        spec = parse_spec(spec, overrides=["title='" + title.replace("'", "''") + "'"])
        assert parse_spec(spec.to_yaml()).title == spec.title
