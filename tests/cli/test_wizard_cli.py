"""`idesign wizard` without a terminal."""

from itertools import pairwise

import yaml

ANSWERS = [
    "plant=gain 2, time constant 180 s, dead time 25 s",
    "wish=own loop with 6 dB, Kp 1.5, Ti 180",
    "range=plus/minus 5 around 40",
    "time=20 min",
    "noise=resolution 0.1",
]


def test_without_a_terminal_it_says_what_is_needed(run, tmp_path):
    code, out, err = run("wizard")
    assert (code, out) == (2, "")
    assert "no-terminal" in err
    assert "plant, wish, range, noise" in err
    assert not (tmp_path / "experiment.yaml").exists()


def test_answers_make_a_spec_that_is_accepted(run, tmp_path):
    options = [part for text in ANSWERS for part in ("--answer", text)]
    code, out, err = run("wizard", *options, "-o", "mine.yaml")
    assert (code, err) == (0, "")
    assert "mine.yaml: written" in out
    text = (tmp_path / "mine.yaml").read_text()
    assert "of every spectrum" in text
    assert yaml.safe_load(text)["accuracy"]["loop"]["controller"]["pid"] == {"Kp": 1.5, "Ti": 180}
    assert run("validate", "mine.yaml")[0] == 0
    code, _, err = run("wizard", *options, "-o", "mine.yaml")
    assert (code, "output-exists" in err) == (2, True)
    code, _, err = run("wizard", *options, "-o", "other.yaml", "--answer", "time=soon")
    assert (code, "bad-answer" in err, "How much time" in err) == (2, True, True)


def test_a_trade_is_a_sweep_with_a_table(run, tmp_path):
    spec = (
        "plant: {B: [0, 1], F: [1, -0.8]}\nnoise: {variance: 1}\nexperiment: {samples: 40}\n"
        "accuracy: {standard_deviation: {b1: 0.5}}\nlimits: {amplitude: 2}\n"
        "spectrum: {type: multisine, lines: 8}\nsignal: {candidates: 1}\n"
    )
    (tmp_path / "small.yaml").write_text(spec)
    code, out, _ = run("solve", "small.yaml", "--fast", "--trade", "samples,amplitude", "--no-figures")
    assert code == 0
    rows = [line.split() for line in out.split("error / asked")[1].splitlines()[:4]]
    assert rows[0] == ["10", "s", "20", "s", "40", "s", "80", "s"]
    cells = {row[1]: [float(cell) for cell in row[2:]] for row in rows[1:]}
    assert list(cells) == ["1.0", "2.0", "4.0"]
    # Errors fall with time and with amplitude.
    assert all(a > b for row in cells.values() for a, b in pairwise(row))
    assert all(a > b > c for a, b, c in zip(*cells.values(), strict=True))
    assert (tmp_path / "runs" / "small-trade" / "trade.png").stat().st_size > 5000
    code, _, err = run("solve", "small.yaml", "--trade", "colour")
    assert (code, "neither samples nor amplitude" in err) == (2, True)
