"""Accuracy of given excitations: Example 1 of the least-costly paper, closed forms, tables, limits."""

from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import analyse, load_spec, parse_spec, solve
from inputdesign_cli.errors import DataError, SpecError
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.text_formats import csv_text
from inputdesign_cli.specification.yaml.plain import to_yaml
from inputdesign_cli.specification.yaml.reader import read
from inputdesign_cli.spectrum import TabulatedSpectrum
from tests.support.first_order_specs import PLANT
from tests.support.refusals import refused

BASE = PLANT + "accuracy: {model_error: {relative: 0.01, alpha: 1}}\nspectrum: {given: GIVEN}\n"


def spec_of(given, base=BASE):
    return parse_spec(base.replace("GIVEN", given), file="given.yaml")


def r_u(outcome):
    columns = outcome.tables["bound"].columns
    return columns["frequency_rad_per_s"], columns["r_u"]


WHITE = "{type: white, power: 1.7}"
COSINE = "{type: multisine, frequencies: [0.15], amplitudes: [0.75]}"
SLOW = "{type: multisine, frequencies: [0.05], amplitudes: [0.75]}"


def test_example_1_of_the_least_costly_paper():
    """The cosine at 0.15 beats white noise of six times its power, that at 0.05 at low frequencies only."""
    white, cosine, slow = (analyse(spec_of(given)) for given in (WHITE, COSINE, SLOW))
    assert white.result["power"]["input"][0] / cosine.result["power"]["input"][0] == pytest.approx(6, abs=0.1)
    w, r_white = r_u(white)
    assert np.all(r_u(cosine)[1] < r_white)
    r_slow = r_u(slow)[1]
    assert np.all(r_slow[w < 0.03] < 0.6 * r_white[w < 0.03])
    assert np.all(r_slow[w > 1.0] > 1.3 * r_white[w > 1.0])


def test_the_information_of_one_cosine_has_its_closed_form():
    """M = N A^2 / 2 Re(F F^*) for b and f; the noise alone gives N / (1 - c^2) for c."""
    information = analyse(spec_of(COSINE)).result["information"]
    assert information["parameters"] == ["b1", "c1", "f1"]
    q = np.exp(-0.15j)
    F = np.array([q / (1 - 0.7 * q), -3.6 * q**2 / (1 - 0.7 * q) ** 2]) / (1 - 0.9 * q)
    expected = 500 * 0.75**2 / 2 * np.outer(F, F.conj()).real
    M = np.asarray(information["matrix"])
    np.testing.assert_allclose(M[np.ix_([0, 2], [0, 2])], expected, rtol=1e-9)
    assert M[1, 1] == pytest.approx(500 / (1 - 0.81), rel=1e-9)
    sd = information["standard_deviation"]
    np.testing.assert_allclose([sd["b1"], sd["f1"]], np.sqrt(np.diag(np.linalg.inv(expected))), rtol=1e-9)


def test_analyse_without_a_requirement_states_the_error_at_95_percent():
    asked = "accuracy: {model_error: {relative: 0.01, alpha: 1}}\n"
    outcome = analyse(spec_of(WHITE, BASE.replace(asked, "")))
    assert outcome.result["status"] == "given"
    assert "r_adm" not in outcome.tables["bound"].columns
    assert outcome.result["model_error"]["alpha"] == pytest.approx(np.sqrt(-2 * np.log(0.05)))


def test_white_excitation_of_the_flexible_transmission_costs_what_papers_md_lists(flexible):
    spec = load_spec("specs/flexible_transmission.yaml", ["spectrum={given: {type: white, power: 7.663650}}"])
    outcome = analyse(spec)
    assert outcome.result["model_error"]["worst_ratio"] == pytest.approx(1.0, abs=1e-6)
    assert outcome.result["cost"] == pytest.approx(21.939919, rel=1e-6)


def test_analyse_without_a_given_spectrum_is_refused():
    with pytest.raises(SpecError) as caught:
        analyse(parse_spec(BASE.replace("{given: GIVEN}", "{type: white}")))
    assert caught.value.diagnostics[0].code == "nothing-given"


SHIPPED = "specs/first_order_given.yaml"  # a cosine of amplitude 0.75: power 0.28125
SHIPPED_TWO = "specs/two_by_two_given.yaml"


def limits_not_kept(spec):
    return [one for one in analyse(spec).outcome.findings or () if one.code == "limit-not-kept"]


@pytest.mark.parametrize(
    ("spec", "limits", "broken"),
    [
        (SHIPPED, "{input_power: 0.3, output_power: 40, samples: 500}", {}),
        (SHIPPED, "{input_power: 0.28}", {"input_power": (0.28125, 0.28)}),
        (SHIPPED, "{input_power: {min: 0.3}}", {"input_power": (0.28125, 0.3)}),
        (SHIPPED_TWO, "{input_power: [30, 20]}", {"input_power": (22.5, 20.0)}),
        (SHIPPED, "{excitation_power: 0.2, output_power: 30}", {"output_power": (), "excitation_power": ()}),
        (SHIPPED_TWO, "{amplitude: {input: [100, 6], output: 1000}}", {"amplitude.input": ()}),
        (
            SHIPPED_TWO,
            "{rate: [1, 100], amplitude: {output: [1000, 1]}}",
            {"amplitude.output": (), "rate": ()},
        ),
    ],
)
def test_every_limit_that_an_excitation_breaks_is_found(spec, limits, broken):
    found = {one.where: one.figures for one in limits_not_kept(load_spec(spec, [f"limits={limits}"]))}
    assert list(found) == [f"limits.{name}" for name in broken]
    for name, figures in broken.items():
        if figures:
            assert (found[f"limits.{name}"]["value"], found[f"limits.{name}"]["limit"]) == pytest.approx(
                figures
            )


def test_a_record_longer_than_allowed_is_found(tmp_path):
    (tmp_path / "u.csv").write_text("u\n" + "1\n-1\n1\n" * 40)
    given = f"spectrum={{given: {{signal: {tmp_path / 'u.csv'}}}}}"
    spec = load_spec(SHIPPED, [given, "limits={samples: 100}", "experiment.samples=100"])
    (found,) = limits_not_kept(spec)
    assert found.where == "limits.samples"
    assert dict(found.figures) == {"value": 120, "limit": 100}


MOVES, AT = np.sign(np.random.default_rng(1).standard_normal(200)), np.arange(200.0)


def given_samples(path, u, times, header, offset=0):
    """The outcome of analyse for samples in a file, in the shipped spec with this offset."""
    path.write_text(csv_text(Table({header: times, "u1": u})))
    return analyse(load_spec(SHIPPED, [f"spectrum={{given: {{signal: {path}}}}}", f"signal.offset={offset}"]))


@pytest.mark.parametrize(
    ("times", "header", "hint"),
    [
        (AT, "time_ms", "sample_time: 0.001;"),
        (1.004 * AT, "time_s", "sample_time: 1.004;"),
        (AT + 3 * (AT > 99), "time", "once, in order"),
        (-AT, "time_s", "once, in order"),
    ],
)
def test_times_of_a_given_signal_are_those_of_the_spec(times, header, hint, tmp_path):
    (told,) = refused(given_samples, tmp_path / "u.csv", MOVES, times, header, kind=DataError)
    assert (told.code, told.key) == ("data-not-uniform", "spectrum.given.signal")
    assert hint in told.hint


@pytest.mark.parametrize(("level", "offset"), [(0, 0), (40, 40), (40, 0), (0, 40)])
def test_samples_of_a_given_signal_count_from_the_offset(level, offset, tmp_path):
    """A level that no offset explains is doubted."""
    found = given_samples(tmp_path / "u.csv", MOVES + level, 1000.0 * AT, "time_ms", offset)
    assert found.result["signal"]["input_peak"] == pytest.approx([np.abs(MOVES + level - offset).max()])
    assert found.tables["signal"].columns["u1"] == pytest.approx(MOVES + level)
    told = [one.figures["offset"] for one in found.outcome.findings or () if one.code == "given-level"]
    assert told == ([] if level == offset else [pytest.approx([level + MOVES.mean()], abs=1e-2)])


SPECS = Path(__file__).parents[2] / "specs"
# Shipped specs whose design is a spectral density that just meets the requirement.
DENSITIES = {
    **{name: [] for name in ("application", "first_order", "weighted_variance", "flexible_transmission")},
    "motor_loop": ["spectrum.order=4", "signal.candidates=1"],
    **{name: [] for name in ("two_by_two_arx", "two_by_two_loop")},
}
_OF_THE_DESIGN = ("limits", "simulation", "objective", "solver", "uncertainty", "campaign")


def given_back(spec, **given):
    """The result of analyse for an excitation in place of the design of a shipped spec."""
    stated = {
        key: value for key, value in read(spec.read_text(), "spec").data.items() if key not in _OF_THE_DESIGN
    }
    stated["spectrum"] = {"given": {key: str(value) for key, value in given.items()}}
    stated.pop("signal", None)
    return analyse(parse_spec(to_yaml(stated), str(spec), folder=spec.parent)).result


@pytest.mark.parametrize(
    "name",
    [n if n in ("application", "motor_loop") else pytest.param(n, marks=pytest.mark.slow) for n in DENSITIES],
)
def test_a_designed_spectrum_is_met_and_missed_at_a_thousandth_less_power(name, tmp_path):
    """The written spectrum has the powers of the design; the record has the powers stated in the result."""
    spec, path, signal = SPECS / f"{name}.yaml", tmp_path / "spectrum.csv", tmp_path / "signal.csv"
    designed = solve(load_spec(spec, DENSITIES[name]))
    path.write_text(csv_text(designed.tables["spectrum"]))
    found = given_back(spec, type="table", file=path)
    assert found["status"] == "met"
    within = 1e-3 if name == "flexible_transmission" else 1e-4  # a table resolves sharp resonances less well
    for kind, power in found["power"].items():
        np.testing.assert_allclose(power, designed.result["power"][kind], rtol=within)
    ratio = found.get("model_error", {}).get("worst_ratio", 1.0)
    if ratio > 1.0 + 1e-9:
        assert found["findings"][0]["code"] == "met-within-table"
    head, *rows = path.read_text().splitlines()
    scaled = [0.999 if column.startswith("phi") else 1.0 for column in head.split(",")]
    cells = [[float(cell) * s for cell, s in zip(row.split(","), scaled, strict=True)] for row in rows]
    path.write_text("\n".join([head, *(",".join(map(repr, row)) for row in cells)]) + "\n")
    assert given_back(spec, type="table", file=path)["status"] == "missed"
    signal.write_text(csv_text(designed.tables["signal"]))
    applied, told = given_back(spec, signal=signal), designed.result["signal"]
    for kind in ("input", "output"):
        if f"{kind}_power" in told:
            np.testing.assert_allclose(applied["power"][kind], told[f"{kind}_power"], rtol=1e-9)


# With integral action power near frequency zero is almost free: one huge line must not hide the others.
INTEGRAL_ACTION = """
plant: {A: [1, -0.0063055794, -0.24801378, 0.085217878], B: [0, 0, 1.9794985, 1.2099904]}
noise: {variance: 0.1}
experiment:
  samples: 1000
  controller: {numerator: [0.09405895722038726, -0.056435374332232356], denominator: [1, -1]}
cost: {input_power: 1, output_power: 1}
accuracy: {model_error: {relative: 0.2, alpha: 2}}
spectrum: {given: GIVEN}
"""


@pytest.mark.first(2)
@pytest.mark.parametrize("spectrum", ["{type: free}", "{type: multisine, lines: 40}"])
@pytest.mark.parametrize("base", [INTEGRAL_ACTION, BASE], ids=["integral action", "open loop"])
def test_the_listed_sinusoids_reproduce_cost_and_error_of_the_design(base, spectrum):
    solved = solve(parse_spec(base.replace("{given: GIVEN}", spectrum)))
    designed, table = solved.result, solved.tables["spectrum"].columns
    frequency = table["frequency_rad_per_s"]
    np.testing.assert_array_equal(frequency, designed["spectrum"]["frequencies"])
    inside = (frequency > 0) & (frequency < np.pi)
    amplitude = np.sqrt(np.where(inside, 2.0, 1.0) * table["power"])
    given = f"{{type: multisine, frequencies: {frequency.tolist()}, amplitudes: {amplitude.tolist()}}}"
    found = analyse(spec_of(given, base)).result
    assert found["status"] == "met"
    assert found["cost"] == pytest.approx(designed["cost"], rel=1e-9)
    ratio = designed["model_error"]["worst_ratio"]
    assert found["model_error"]["worst_ratio"] == pytest.approx(ratio, rel=1e-8)


@pytest.mark.parametrize("rows", [40, 41])
def test_the_margin_of_a_table_has_the_size_of_its_interpolation_error(rows):
    """Interpolating exp(w) misses h^2/8 exp(w) between rows, and four times that from every second row."""
    w = np.linspace(0.0, 3.0, rows)
    spectrum = TabulatedSpectrum(w, np.exp(w)[:, None, None].astype(complex))
    added = (spectrum.raised(0.25).phi - spectrum.phi)[1:-1, 0, 0].real
    expected = (w[1] ** 2 / 8.0 * np.exp(w))[1:-1]
    inner = slice(1, -2)
    assert np.all(added[inner] >= 0.8 * expected[inner])
    assert np.all(added[inner] <= 2.4 * expected[inner])


def test_a_flat_table_gives_the_information_of_white_noise(tmp_path):
    table = tmp_path / "phi.csv"
    rows = "\n".join(f"{w:.17g},1.7" for w in np.linspace(0.0, np.pi, 40))
    table.write_text("frequency_rad_per_s,phi\n" + rows + "\n", encoding="utf-8")
    tabulated = analyse(spec_of(f"{{type: table, file: {table}}}"))
    white = analyse(spec_of(WHITE))
    np.testing.assert_allclose(
        tabulated.result["information"]["matrix"], white.result["information"]["matrix"], rtol=1e-9
    )
    assert tabulated.result["power"]["output"] == pytest.approx(white.result["power"]["output"])
