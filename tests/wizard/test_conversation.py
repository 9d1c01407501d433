"""Questions that are asked one by one: a bad answer is told at once and asked again, and no other."""

import pytest

from inputdesign_cli.wizard import composing
from inputdesign_cli.wizard.composing import Conversation
from inputdesign_cli.wizard.questions import KEYS

GOOD = {
    "plant": "gain 2, time constant 180 s, dead time 25 s",
    "wish": "own loop with 6 dB, Kp 1.5, Ti 180",
    "range": "plus/minus 5 around 40",
    "time": "20 min",
    "limits": "none",
    "noise": "standard deviation 0.2",
    "drift": "no",
    "loop": "open",
    "signals": "any",
    "converter": "no",
}
BAD = {
    "plant": ["a kettle", "", "step nothing.csv", "nothing.json", "gain 1e999, time constant 3"],
    "wish": ["happiness", "PI loop with . dB", "own loop with 6 dB, Kp 1e200"],
    "range": ["a bit", "1e999 to 2", ""],
    "time": ["soon", "10 s", "1e308 h", "-1 h"],
    "limits": ["be careful", "rate 0"],
    "noise": ["little", "standard deviation 1e200", "rest nothing.csv"],
    "drift": ["perhaps"],
    "loop": ["closed", "PI Kp 1, Ti 2 parsecs"],
    "signals": ["sine"],
    "converter": ["16"],
}


def answered(talk, until=None):
    """The conversation, answered as in GOOD up to the question of a key."""
    while (one := talk.question) is not None and one.key != until:
        assert talk.answer(GOOD[one.key]) is None, one.key
    return talk


def test_every_bad_answer_is_told_by_its_question_which_comes_again(tmp_path):
    talk = Conversation({}, "x", tmp_path)
    for key in KEYS:
        for text in BAD[key]:
            assert talk.question.key == key
            (told,) = talk.answer(text).diagnostics
            assert (told.code, told.key) == ("bad-answer", key), text
            assert talk.draft is None
        assert talk.answer(GOOD[key]) is None
    assert talk.question is None
    assert talk.draft.spec().accuracy.loop.peak == pytest.approx(10 ** (6 / 20))


def test_what_only_all_answers_together_tell_leads_back_to_its_question(tmp_path):
    """The loop of Skogestad's rule has a peak of 1.59 here: 1 dB cannot be asked of it."""
    talk = answered(Conversation({"wish": "PI loop with 1 dB"}, "x", tmp_path), "converter")
    assert talk.answer("no").diagnostics[0].code == "admissible-not-positive"
    assert (talk.question.key, talk.draft) == ("wish", None)
    assert talk.answer("PI loop with 6 dB") is None
    assert talk.draft is not None


def test_the_loop_that_a_wish_needs_is_asked_for_by_the_wish(tmp_path):
    talk = answered(Conversation({"plant": "tank", "wish": "PI loop with 6 dB"}, "x", tmp_path), "loop")
    told = talk.answer("open")
    assert "no rule of tuning is at hand" in str(told)
    assert talk.question.key == "wish"


def test_a_plant_is_understood_once(tmp_path, monkeypatch):
    """A log takes seconds to be explored."""
    seen = []
    real = composing.understand_plant
    monkeypatch.setattr(composing, "understand_plant", lambda *a: (seen.append(a[0]), real(*a))[1])
    answered(Conversation({}, "x", tmp_path))
    assert seen == [GOOD["plant"]]


def test_of_a_log_the_noise_is_not_asked(tmp_path):
    talk = Conversation({"plant": "log log.csv", "wish": "prediction within 5 % up to 0.1"}, "x", tmp_path)
    assert talk.question.key == "range"
    known = {key: text for key, text in GOOD.items() if key not in ("noise", "drift", "converter")}
    assert Conversation({**known, "plant": "log log.csv"}, "x", tmp_path).question.key == "converter"
    assert Conversation(known, "x", tmp_path).question.key == "noise"
