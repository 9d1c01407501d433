"""Every fault of an answer is reported for that answer alone, in words of its question."""

import json
import re

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.errors import (
    DataError,
    Diagnostic,
    IdesignError,
    InfeasibleError,
    Location,
    OutputError,
    SpecError,
)
from inputdesign_cli.wizard import composing
from inputdesign_cli.wizard.composing import Conversation, compose, with_spectrum
from inputdesign_cli.wizard.plants import system_of
from inputdesign_cli.wizard.questions import KEYS, in_their_words, question
from tests.support.wishes import ENGINEER

GOOD = {
    "plant": "gain 2, time constant 180 s, dead time 25 s",
    "wish": "own loop with 6 dB, Kp 1.5, Ti 180",
    "range": "plus/minus 5 around 40",
    "time": "20 min",
    "noise": "standard deviation 0.2",
}
FILES = {
    "empty.csv": "",
    "head.csv": "time,u,y\n",
    "text.csv": "hello world\nthis is no data\n",
    "nan.csv": "time,u,y\n" + "".join(f"{k},{int(k >= 20)},nan\n" for k in range(60)),
    "few.csv": "y\n1\n2\n",
    "empty.json": "",
    "lists.json": json.dumps({"num": [[1]], "den": [[1, 2]]}),
    "sampled.json": json.dumps({"num": [0.1], "den": [1, -0.9], "dt": 1}),
    "unstable.json": json.dumps({"num": [1], "den": [1, -1]}),
    "half_unstable.json": json.dumps({"num": [1], "den": [1, 1, -2]}),
    "improper.json": json.dumps({"num": [1, 2, 3], "den": [1, 1]}),
    "negative.json": json.dumps({"num": [1], "den": [10, 1], "delay": -3}),
    "nothing.json": json.dumps({"num": [0], "den": [10, 1]}),
    "huge.json": json.dumps({"num": [1e300], "den": [1e308, 1]}),
}
ANYWHERE = ("", "text", "-1", "0", "1e308", "nan", "1e-300", "$(rm)", "{a: 1}")
# Several answers to a question, with a stroke between them.
HOSTILE = {
    "plant": """
        gain nan, time constant 180 s | gain 1e308, time constant 180 s | gain 1e-300, time constant 1 s |
        gain 2, time constant 0 | gain 2, time constant 180, dead time 1e6 | gain 2, time constant 3 kg |
        gain 2, time constant 9, dead time -3 | gain 2, time constant 9, within -30 % |
        gain 2, time constant 9, within 0 % | gain 2, time constant 180 min | gain 2, time constant 1e90 s |
        log none.csv | log empty.csv | log head.csv | step none.csv | step empty.csv | step head.csv |
        log text.csv columns u, y | log text.csv columns u=u, y=y, q=3 |
        log text.csv | step text.csv | log nan.csv | step nan.csv | log . | step | none.json | empty.json |
        lists.json | sampled.json | unstable.json | half_unstable.json | improper.json | negative.json |
        nothing.json | huge.json
    """,
    "wish": """
        PI loop with nan dB | PI loop with 0 dB | PI loop with 0.01 dB | PI loop with -3 dB | PI loop |
        PI loop with 1e99 dB | PI loop with 90 degrees | PI loop with gain margin 0.5 | PI loop, 29 Hz |
        own loop with 6 dB, Kp 100, Ti 180 | own loop with 6 dB, Kp -1, Ti 180 | own loop with 6 dB, Kp 0 |
        own loop with 6 dB, Kp 1, Ti 0 | own loop with 6 dB, Kp 1, Ti -5 | own loop with 6 dB, Kp 1e90 |
        own loop with 6 dB, Kp 1, Ti 1e-9 | own loop with 6 dB, Kp 1, Ti 9 kg |
        own loop with 6 dB, 1/(z-1) | prediction within 0 % up to 1 | prediction within -5 % up to 1 |
        prediction within 500 % up to 1 | prediction within 5 % up to 0 | prediction within 5 % up to 1e9 |
        prediction within 1e-90 % up to 1 | parameters within 1e-90 % | parameters within 5 |
        Bode plot within 5 % from 1 to 0.1 | Bode plot within 5 % from 0.001 to 100 |
        Bode plot within 5 % from 0.001 to 0.0010001
    """,
    "range": """
        plus/minus nan | plus/minus 0 | plus/minus -5 | 45 to 35 | 5 to 5 | plus/minus 1e99 |
        plus/minus 5 around nan | plus/minus 5 around text | plus/minus 1e-99 | 0 to 1e99
    """,
    "time": "0 s | 1e99 h | 5 parsecs | 1e-9 s | 2 h around 5 | 10 s",
    "limits": "rate nan | rate 0 | rate -1 | rate 1e-99 | output 0 | rate 0.5 output | rate | output 1e99",
    "noise": """
        standard deviation nan | standard deviation 0 | standard deviation 1e99 | resolution 0 | rest |
        standard deviation 1e-160 | rest none.csv | rest empty.csv | rest head.csv | rest text.csv |
        rest nan.csv | rest few.csv | 0.2
    """,
    "drift": "maybe",
    "loop": """
        PI Kp 100, Ti 60 | PI Kp -1, Ti 60 | PI Kp nan | PI Kp 1, Ti 0 | PI Kp 1e90, Ti 1 | closed |
        PI Kp 1, Ti 60 kg | C(z) = 1/(z-1) | 1/s
    """,
    "signals": "square",
    "converter": """
        12 bits | 0 bits up to 100 | 99 bits up to 100 | 1e9 bits up to 100 | 12 bits up to 0 |
        12 bits up to 10 | 2 bits up to 100 | steps of 0 | steps of 1e-12 | steps of 6 | steps |
        steps of 0.1 up to 100
    """,
    "hold": "soon | -5 s | 0 s | 60 parsecs | 1e30 s",
    "return": "perhaps",
    "names": "valve | valve, temperature, pressure |  , temperature | valve in %;, temperature",
}
# A fault of two answers together is reported for the one that is easier to change.
ALSO = {"plant": {"time"}}
NOT_THEIRS = re.compile(
    r"<\w+>|q\^-1|\b(accuracy|plant|limits|noise|signal|experiment)\.\w|tau_c|--set|--columns"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("answers")
    for name, content in FILES.items():
        (made / name).write_text(content)
    return made


@pytest.mark.first(4)
@pytest.mark.parametrize("key", KEYS)
def test_every_fault_is_reported_for_its_answer_in_words_of_the_question(key, folder):
    for text in (*map(str.strip, HOSTILE[key].split("|")), *ANYWHERE):
        with pytest.raises(IdesignError) as caught:
            compose({**GOOD, key: text}, "x", folder).validate()
        for told in caught.value.diagnostics:
            asked = question(told.key)
            assert told.key in {key} | ALSO.get(key, set()), text
            assert told.message.startswith(f"{asked.asks} ({told.key}): "), text
            assert asked.allowed in told.hint, text
            assert not NOT_THEIRS.search(f"{told.message} {told.hint}"), (text, told)
            assert told.location is None or told.location.file.startswith(str(folder)), text


def test_errors_of_a_design_are_reported_in_words_of_the_question_too(folder):
    def solve(_):
        place = Location("<answers>", 3, 1, "limits: {amplitude: 5}")
        raise InfeasibleError.because("infeasible", "limits.amplitude is too small", "", "limits", place)

    with pytest.raises(InfeasibleError) as caught:
        with_spectrum(compose(GOOD, "x", folder), solve)
    (told,) = caught.value.diagnostics
    assert (told.key, told.location) == ("limits", None)
    assert "the amplitude is too small" in told.message


def test_a_file_that_cannot_be_written_is_no_fault_of_an_answer():
    with pytest.raises(OutputError) as caught, in_their_words({}):
        raise OutputError.because("output-full", "there is no space left")
    assert caught.value.diagnostics == (Diagnostic("output-full", "there is no space left"),)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "named"),
    [
        ("0.5 dB", r"less of a margin than ([\d.]+) dB"),
        ("50 degrees", r"example ([\d.]+ degrees)"),
        ("gain margin 20", r"example (gain margin [\d.]+)"),
    ],
)
def test_a_margin_that_the_loop_can_keep_is_named_in_the_unit_of_the_wish(asked, named, tmp_path):
    """The peak of |S| of this loop is 4.04 dB: a limit a little above is accepted, one below is not."""
    with pytest.raises(SpecError) as caught:
        compose({**ENGINEER, "wish": f"PI loop with {asked}"}, "x", tmp_path).validate()
    found = re.search(named, caught.value.diagnostics[0].hint)
    assert found is not None
    will_do = f"{float(found[1]) + 0.1:.3g} dB" if "dB" in asked else found[1]
    compose({**ENGINEER, "wish": f"PI loop with {will_do}"}, "x", tmp_path).validate()
    if "dB" in asked:
        below = {**ENGINEER, "wish": f"PI loop with {float(found[1]) - 0.02:.3g} dB"}
        with pytest.raises(SpecError):
            compose(below, "x", tmp_path).validate()


@pytest.mark.parametrize(("loop", "key"), [("open", "loop"), ("PI Kp 1, Ti 9", "plant")])
def test_a_controller_is_asked_for_only_where_there_is_none(loop, key):
    with pytest.raises(SpecError) as error, in_their_words({"loop": loop}):
        raise SpecError.because("infinite-information", "it tells without end", "", "plant")
    (told,) = error.value.diagnostics
    assert told.key == key
    assert ("let a controller hold" in told.hint) == (key == "loop")


ANSWERS = GOOD | {"limits": "none", "drift": "no", "loop": "open", "signals": "any", "converter": "no"}
ANSWERS |= {"hold": "no", "return": "no", "names": "as said"}


def answered(talk, until=None):
    """The conversation, answered as in ANSWERS up to the question of a key."""
    while (one := talk.question) is not None and one.key != until:
        assert talk.answer(ANSWERS[one.key]) is None, one.key
    return talk


def test_an_error_of_all_answers_together_leads_back_to_its_question(tmp_path):
    """The loop by Skogestad's rule has a peak |S| of 1.59 here, so that 1 dB is impossible."""
    talk = answered(Conversation({"wish": "PI loop with 1 dB"}, "x", tmp_path), "names")
    assert talk.answer("as said").diagnostics[0].code == "admissible-not-positive"
    assert (talk.question.key, talk.draft) == ("wish", None)
    assert talk.answer("PI loop with 6 dB") is None
    assert talk.draft is not None


def test_a_wish_without_a_rule_of_tuning_is_asked_for_again(tmp_path):
    talk = answered(Conversation({"plant": "tank", "wish": "PI loop with 6 dB"}, "x", tmp_path), "loop")
    told = talk.answer("open")
    assert "no rule of tuning is at hand" in str(told)
    assert talk.question.key == "wish"


def test_the_answer_on_the_plant_is_interpreted_once(tmp_path, monkeypatch):
    """The exploration of a log takes seconds."""
    seen = []
    real = composing.understand_plant
    monkeypatch.setattr(composing, "understand_plant", lambda *a: (seen.append(a[0]), real(*a))[1])
    answered(Conversation({}, "x", tmp_path))
    assert seen == [ANSWERS["plant"]]


def test_for_a_log_the_noise_is_not_asked(tmp_path):
    talk = Conversation({"plant": "log log.csv", "wish": "prediction within 5 % up to 0.1"}, "x", tmp_path)
    assert talk.question.key == "range"
    known = {key: text for key, text in ANSWERS.items() if key not in ("noise", "drift", "names")}
    assert Conversation({**known, "plant": "log log.csv"}, "x", tmp_path).question.key == "names"
    assert Conversation(known, "x", tmp_path).question.key == "noise"


def test_default_answers_on_the_noise_of_a_log_do_not_enter_the_draft(tmp_path, monkeypatch):
    """The log determines its noise; nobody stated another one."""
    seen = []
    plant = composing.understand_plant(ANSWERS["plant"], "x", tmp_path)
    monkeypatch.setattr(composing, "understand_plant", lambda *_: plant)
    monkeypatch.setattr(
        composing, "noise_lines", lambda text, *_: (seen.append(text), ["noise: {variance: 1}"])[1]
    )
    talk = Conversation({"plant": "log log.csv"}, "x", tmp_path)
    while talk.question is not None:
        assert talk.answer(ANSWERS[talk.question.key]) is None
    assert set(seen) == {"as the log"}


def test_an_answer_that_names_its_question_may_come_out_of_turn(tmp_path):
    talk = Conversation({}, "x", tmp_path)
    for key in reversed(KEYS[1:]):
        assert talk.answer(f"{key}{'=' if key > 'n' else ': '}{ANSWERS[key]}") is None
    assert talk.question.key == "plant"
    assert talk.answer(ANSWERS["plant"]) is None
    assert (talk.question, talk.answers) == (None, ANSWERS)
    wrong = Conversation({}, "x", tmp_path)
    assert wrong.answer("time = soon").diagnostics[0].key == "time"
    assert wrong.question.key == "plant"


@pytest.mark.parametrize(
    ("asked", "text", "meant"),
    [
        ("plant", "PI loop with 6 dB", "wish"),
        ("wish", "valve 40 +- 5 %", "range"),
        ("wish", "gain 2, time constant 180 s", "plant"),
        ("range", "one shift", "time"),
        ("noise", "12 bits up to 100", "converter"),
    ],
)
def test_an_answer_to_another_question_is_refused_with_that_question(asked, text, meant, tmp_path):
    talk = answered(Conversation({}, "x", tmp_path), asked)
    (told,) = talk.answer(text).diagnostics
    assert (told.key, talk.question.key) == (asked, asked)
    assert f'to answer "{question(meant).asks}" write {meant}={text}' in told.hint


_TANK = {"num": [4, 2], "den": [360, 2, 0], "delay": 25}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"num": [2], "den": [0, 0]}', "all coefficients of the denominator are zero"),
        ('{"num": [0], "den": [1, 1]}', "all coefficients of the numerator are zero"),
        ('{"num": [NaN], "den": [1, 1]}', "the numerator[0] must be finite"),
        ('{"num": [1], "den": [1, Infinity]}', "the denominator[1] must be finite"),
        ('{"den": [1, 1]}', "does not hold"),
        ('{"num": [true], "den": [1, 1]}', "must be a number, not true"),
        ('{"num": [1], "den": [1, 1], "delay": "x"}', "the delay"),
        ("[" * 100_000, "is not JSON"),
        ('{"num": [1], "den": [1, 1], "dealy": 25}', "does not hold"),
        ('{"num": [1], "den": [1, 1], "delay": null}', "the delay has no value"),
        ('{"num": [1], "den": [1, 1], "delay": NaN}', "the delay must be finite"),
        ('{"num": [2], "den": [1, 0]}', 'write its dead time ("delay": 5), however small, or the lag'),
        ('{"num": [2], "den": [1, 0, 1], "delay": 5}', "must lie in the left half plane"),
    ],
)
def test_faulty_files_of_transfer_functions_are_refused_with_the_reason(tmp_path, text, words):
    file = tmp_path / "p.json"
    file.write_text(text)
    with pytest.raises((SpecError, DataError)) as error:
        system_of(file)
    assert words in str(error.value)


def test_a_transfer_function_with_an_integrator_is_accepted(tmp_path):
    (tmp_path / "p.json").write_text(json.dumps(_TANK))
    loop = "PI Kp 0.0005, Ti 3000"
    draft = compose(GOOD | {"plant": "p.json", "loop": loop}, "s", tmp_path)
    assert (draft.spec().sample_time, draft.spec().plant.continuous.delays) == (5.0, ((25.0,),))
    plant = parse_spec(draft.text, design=False).plant
    assert plant.kind == "continuous"
    assert {one.label for one in plant.named_parameters} == {"b1", "b0", "a1", "L"}
    matrix = plant.continuous
    s = 1j * np.array([1e-4, 1e-2, 1.0])
    found = np.polyval(matrix.numerator_matrix[0][0], s) / np.polyval(matrix.denominator_matrix[0][0], s)
    assert found == pytest.approx(np.polyval(_TANK["num"], s) / np.polyval(_TANK["den"], s), rel=1e-12)


def test_the_dead_time_of_a_pure_integrator_determines_the_sample_time(tmp_path):
    """The plant is the template `tank`, 0.05 exp(-5 s)/s."""
    (tmp_path / "p.json").write_text(json.dumps({"num": [0.05], "den": [1, 0], "delay": 5}))
    draft = compose(GOOD | {"plant": "p.json", "loop": "PI Kp 0.8, Ti 60"}, "s", tmp_path)
    assert "sample_time: 2  # half the dead time, rounded down" in draft.text
    plant = draft.spec().plant
    assert {one.label for one in plant.named_parameters} == {"b0", "L"}


def test_a_zero_at_the_origin_cancels_an_integrator(tmp_path):
    for name, num, den in (("a", [2, 0], [180, 1, 0]), ("b", [2], [180, 1])):
        (tmp_path / f"{name}.json").write_text(json.dumps({"num": num, "den": den}))
    one, other = (system_of(tmp_path / f"{name}.json") for name in "ab")
    assert one.lines[1:] == other.lines[1:]
