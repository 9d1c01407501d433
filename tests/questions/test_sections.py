"""Each command uses, refuses or ignores each section of a spec as docs/questions.md states."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import Spec, analyse, assess, identify, parse_spec, questions, simulate, solve, validate
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.questions.assessment.build import build_identification
from inputdesign_cli.questions.campaign.directory import begun
from tests.support.refusals import refusal, refusals

PAGE = Path(__file__).parent.parent.parent / "docs" / "questions.md"
SPEC = """
title: one
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {variance: 1.0}
experiment: {samples: 80}
accuracy: {model_error: {relative: 0.02}}
limits: {input_power: 1000}
spectrum: {type: white}
signal: {type: multisine, candidates: 1, seed: 1}
solver: {any_spectrum: false}
simulation: {runs: 2, seed: 2}
"""
GIVEN = ["spectrum={given: {type: white, power: 1}}", "signal=null"]
BLOCK = ["campaign={block: 20}"]
# Another value of each section.
OTHER = {
    "title": "two",
    "sample_time": "2",
    "time_unit": "min",
    "plant": "{B: [0, 3.5], F: [1, -0.72]}",
    "noise": "{variance: 1.1, C: [1, -0.2]}",
    "channels": '{u1: {name: valve, unit: "%"}}',
    "experiment": "{samples: 80, prior: {information: [[100, 0], [0, 100]]}}",
    "estimate": "{parameters: {b1: 3.6, f1: -0.7}, covariance: [[1, 0], [0, 1]]}",
    "cost": "{output_power: 2}",
    "accuracy": "{model_error: {relative: 0.03}}",
    "objective": "best_accuracy",
    "limits": "{input_power: 900, band: [0.05, 3.1]}",
    "spectrum": "{type: fir, order: 2}",
    "uncertainty": "{intervals: {b1: [3, 4]}, scenarios: 2, fresh: 0}",
    "campaign": "{block: 40}",
    "signal": "{type: binary, candidates: 1, seed: 3, offset: 0.2}",
    "solver": "{any_spectrum: true}",
    "simulation": "{runs: 3, seed: 3}",
    "report": "{ellipses: [[b1, f1]]}",
    "figures": "{width: column}",
    "sweep": "{set: {noise.variance: [1, 2]}}",
}
# Other values for commands where those have no effect or take long.
SPECIAL = {
    "analyse": {"spectrum": "{given: {type: white, power: 2}}", "limits": "{input_power: 0.5}"},
    "simulate": {"campaign": "{stages: [80], max_samples: 80}"},
    "assess": {"signal": "{type: binary, candidates: 1, seed: 3}"},
    "campaign": {
        "limits": "{input_power: 1000, amplitude: 10}",
        "experiment": "{samples: 120}",
        "solver": "{time_limit: 1.0e-9}",
    },
}
# Pairs of a few seconds each, which `assess` covers as well.
ALIKE = {("identify", "signal")}
# Commands that take a spec without a design.
OF_DATA = ("identify", "explore --validate")


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """A record of the plant, too short for the required accuracy."""
    rng = np.random.default_rng(0)
    u, x = rng.choice([-1.0, 1.0], 80), np.zeros(80)
    for t in range(1, 80):
        x[t] = 0.7 * x[t - 1] + 3.6 * u[t - 1]
    path = tmp_path_factory.mktemp("data") / "d.csv"
    record = np.column_stack([u, x + rng.standard_normal(80)])
    np.savetxt(path, record, delimiter=",", header="u,y", comments="")
    return path


def content(results):
    """A result as text, without times, versions and the hash of its spec."""
    told = {k: v for k, v in results.result.items() if k not in ("timing_s", "environment", "spec_sha256")}
    tables = {name: table.columns for name, table in results.tables.items()}
    files = dict(results.files)
    return json.dumps([told, tables, files, sorted(results.curves)], sort_keys=True, default=plain)


def plain(value):
    return value.decode() if isinstance(value, bytes) else np.asarray(value).tolist()


def planned(spec):
    def decide(task):
        return replace(begun(task, Path(), Path()), resolved_spec=repr(task.rules))

    results = questions.next_round(spec, decide, begins=True)
    header, plan = results.outcome.title, results.outcome.campaign.plan
    head = [header, results.resolved_spec, plan.cost]
    return json.dumps([*map(repr, head), results.tables["signal"].columns], default=plain)


VERBS = {
    "solve": lambda spec, data: content(solve(spec)),
    "analyse": lambda spec, data: content(analyse(spec)),
    "simulate": lambda spec, data: content(simulate(spec)),
    "identify": lambda spec, data: content(identify(spec, data)),
    "assess": lambda spec, data: content(assess(spec, data).results),
    "campaign": lambda spec, data: planned(spec),
    "explore --validate": lambda spec, data: content(questions.explore(data, model=spec).results),
}


def answered(verb, spec, data):
    """The answer, or the code of the error if the time limit of `solver` ends it."""
    try:
        return VERBS[verb](spec, data)
    except InaccurateError as ended:
        return ended.diagnostics[0].code


def cells():
    """Verb, section and their cell in the table of docs/questions.md."""
    (block,) = re.findall(r"^\| section \|.*?\n\n", PAGE.read_text(), flags=re.MULTILINE | re.DOTALL)
    head, _, *rows = ([c.strip() for c in line.strip("|").split("|")] for line in block.strip().splitlines())
    assert [name.strip("`") for name in head[1:]] == list(VERBS)
    for names, *told in rows:
        for name in names.split(","):
            yield from ((verb, name.strip(" `"), cell) for verb, cell in zip(VERBS, told, strict=True))


CELLS = list(cells())


def stated(verb, changes):
    first = {"analyse": GIVEN, "campaign": BLOCK}.get(verb, [])
    return parse_spec(SPEC, overrides=[*first, *changes], design=verb not in OF_DATA)


def other(verb, section):
    return f"{section}={SPECIAL.get(verb, {}).get(section, OTHER[section])}"


@pytest.fixture(scope="module")
def base(data):
    return {verb: run(stated(verb, []), data) for verb, run in VERBS.items()}


def test_the_page_has_every_section_of_the_schema():
    sections = {section for _, section, _ in CELLS}
    assert sections == Spec.model_fields.keys() == OTHER.keys()
    assert {cell for _, _, cell in CELLS} == {"used", "refused", "-"}


@pytest.mark.parametrize(
    ("verb", "section"),
    [
        pytest.param(v, s, marks=pytest.mark.slow if (v, s) in ALIKE else ())
        for v, s, cell in CELLS
        if cell == "used"
    ],
)
def test_a_section_marked_used_changes_the_answer(verb, section, base, data):
    spec = stated(verb, [other(verb, section)])
    if (verb, section) == ("identify", "uncertainty"):  # it matters for several minima only
        assert build_identification(spec).knowledge != build_identification(stated(verb, [])).knowledge
        return
    assert answered(verb, spec, data) != base[verb]


@pytest.mark.parametrize("verb", VERBS)
def test_sections_marked_by_a_dash_do_not_change_the_answer(verb, base, data):
    unconcerned = [other(verb, section) for v, section, cell in CELLS if (v, cell) == (verb, "-")]
    assert VERBS[verb](stated(verb, unconcerned), data) == base[verb]


@pytest.mark.parametrize(("verb", "section"), [(v, s) for v, s, cell in CELLS if cell == "refused"])
def test_a_section_marked_refused_is_not_supported(verb, section, data):
    found = refusal(lambda: VERBS[verb](stated(verb, [other(verb, section)]), data))
    assert (found.code, found.key) in {("not-supported", section), ("not-supported", verb)}


@pytest.mark.parametrize("section", ["objective", "campaign"])
@pytest.mark.parametrize("verb", [solve, simulate, validate])
def test_objective_and_campaign_are_refused_beside_a_given_excitation(verb, section):
    spec = parse_spec(SPEC, overrides=[*GIVEN, f"{section}={OTHER[section]}"])
    assert refusals(lambda: verb(spec))[0].code == "not-supported"
