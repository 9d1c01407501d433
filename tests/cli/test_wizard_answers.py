"""Answers in a file: what is wrong with one is told with its line, and what is no text is refused."""

import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.wizard.questions import KEYS, read_answers
from tests.wizard.test_faults import GOOD

_WRONG = {
    "plant": "nonsense",
    "wish": "PI loop with 0.1 dB",
    "range": "5 to 1",
    "time": ".inf",
    "limits": "fast",
    "noise": "rest none.csv",
    "drift": "perhaps",
    "loop": "PI Ti 3",
    "signals": "square",
    "converter": "99 bits up to 3",
}


@pytest.mark.parametrize("key", KEYS)
def test_a_wrong_answer_is_told_with_its_line(run, tmp_path, key):
    file = tmp_path / "a.yaml"
    said = {name: text for name, text in GOOD.items() if name != key} | {key: _WRONG[key]}
    said |= {"wish": "PI loop with 6 dB"} if key != "wish" else {}
    file.write_text("".join(f'{name}: "{text}"\n' for name, text in said.items()))
    code, _, err = run("wizard", "--answers", file, "-o", tmp_path / "s.yaml", "--no-solve")
    assert code == 2
    assert err.startswith(f"{file}:{list(said).index(key) + 1}:{len(key) + 3}: error[")
    assert f"({key})" in err


@pytest.mark.parametrize("value", ["[1, 2]", "{a: 1}", "[]"])
@pytest.mark.parametrize("key", KEYS)
def test_answers_are_texts(tmp_path, key, value):
    file = tmp_path / "a.yaml"
    file.write_text(f"\n{key}: {value}\n")
    with pytest.raises(SpecError, match=f"the answer to {key} is a (list|mapping)") as error:
        read_answers(file)
    place = error.value.diagnostics[0].location
    assert place is not None
    assert (place.file, place.line) == (str(file), 2)


def test_what_a_file_leaves_open_is_told_of_the_file(run, tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("plant: heater\n")
    code, _, err = run("wizard", "--answers", file, "-o", tmp_path / "s.yaml", "--no-solve")
    assert code == 2
    assert err.startswith(f"{file}:1:1: error[bad-answer] What is the model for? (wish): there is no answer")


def test_an_option_has_no_line(run, tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("".join(f'{name}: "{text}"\n' for name, text in GOOD.items()))
    out = tmp_path / "s.yaml"
    code, _, err = run("wizard", "--answers", file, "-a", "time=never", "-o", out, "--no-solve")
    assert code == 2
    assert err.startswith("error[bad-answer] How much time is there? (time)")


@pytest.mark.parametrize("text", ["", "- a\n", "text\n"])
def test_a_file_without_questions_is_refused_with_its_place(tmp_path, text):
    file = tmp_path / "a.yaml"
    file.write_text(text)
    with pytest.raises(SpecError, match="a mapping of questions") as error:
        read_answers(file)
    place = error.value.diagnostics[0].location
    assert place is not None
    assert (place.file, place.line) == (str(file), 1)


def test_a_question_that_there_is_not_is_told_with_its_line(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text("plant: heater\nplnat: heater\n")
    with pytest.raises(SpecError) as error:
        read_answers(file)
    place = error.value.diagnostics[0].location
    assert place is not None
    assert place.line == 2


@pytest.mark.slow
def test_an_integrator_in_open_loop_asks_for_a_controller(run, tmp_path):
    (tmp_path / "p.json").write_text('{"num": [2], "den": [180, 1, 0], "delay": 25}')
    said = GOOD | {"plant": "p.json", "wish": "PI loop with 6 dB"}
    given = [part for key, text in said.items() for part in ("-a", f"{key}={text}")]
    out = tmp_path / "s.yaml"
    code, _, err = run("wizard", *given, "-o", out, "--no-solve")
    assert code == 2
    assert "(loop): the plant integrates" in err
    assert "let a controller hold" in err
    code, _, err = run("wizard", *given, "-a", "loop=PI Kp 0.002, Ti 900", "-o", out, "--no-solve")
    assert code == 0, err
