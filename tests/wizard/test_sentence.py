"""From one sentence to a spec: its answers, the remarks on it, and the questions that it leaves open."""

import re

import numpy as np
import pytest

from inputdesign_cli import solve
from inputdesign_cli.errors import SpecError
from inputdesign_cli.wizard.composing import Conversation, compose
from inputdesign_cli.wizard.plants import plant_of_words
from inputdesign_cli.wizard.questions import QUESTIONS, read_answers, taken_for_granted
from inputdesign_cli.wizard.sentence import in_sentence, not_understood, spread
from inputdesign_cli.wizard.wishes import input_range
from tests.support.refusals import code_of
from tests.support.wishes import ENGINEER

EXCHANGER = (
    "I want a PI loop with a safe margin for a heat exchanger: gain about 1.72 degC/%, "
    "time constant about 262 s, dead time 31 s, noise of 0.1 degC that fades in a minute, "
    "valve 45 +- 8 %, one shift."
)
MOTOR = (
    "PI loop with 6 dB for a motor with friction: gain about 10 (rad/s)/V, time constant about 0.5 s, "
    "dead time about 0.02 s; the voltage may move +-5 V around 10 V for 20 s; noise 1 rad/s, white"
)
TANK = (
    "PI loop with a safe margin for a tank level: it integrates about 1.2 %/min per %, "
    "dead time about 10 s, the valve may move +-10 around 50 %, one hour, noise 0.2 %, fades in 5 s"
)
LEVEL = (
    "A tank, the level rises about 12 % per minute per 10 % of valve, dead time about 10 s, "
    "PI loop with a safe margin, valve 50 +- 10 %, one hour, noise 0.2 %, fades in 5 s"
)
ROOM = (
    "Predict the room temperature within 5 % up to 0.001 rad/s; radiator valve 50 +- 20 %, "
    "gain about 0.15 degC/%, time constant about 3 h, dead time about 10 min, two days, "
    "noise 0.05 degC that fades in half an hour"
)

KNOWN = {
    EXCHANGER: "gain=1.72 offset=45 amplitude=8 duration=28800 correlation_time=60 max_sensitivity_db=6",
    MOTOR: "gain=10 offset=10 amplitude=5 duration=20 variance=1",
    TANK: "slope=0.02 offset=50 duration=3600 standard_deviation=0.2 correlation_time=5",
    LEVEL: "slope=0.02 offset=50 amplitude=10 correlation_time=5",
    ROOM: "time_constant=10800 dead_time=600 amplitude=20 correlation_time=1800 relative=0.05",
}

# Sentences of engineers who have not read the documentation, and entries that the spec then has.
# Steps q of a sensor add q^2/12 to the variance.
WRITTEN = {
    "I have a DC motor with dry friction and want to tune a PI speed controller. 10 rad/s per volt, "
    "time constant roughly 0.5 s, hardly any dead time. Voltage 10 V plus minus 5 V, I have 30 seconds. "
    "Noise about 1 rad/s.": (
        "gain=10 time_constant=0.5 tau_c=0.125 offset=10 amplitude=5 max_sensitivity_db=6 duration=30 "
        "standard_deviation=1 correlation_time=0.1"
    ),
    "motor, gain about 10 rpm/V, lag about 500 ms, it sticks a bit at low speed, voltage 6 to 14 V, 1 "
    "minute, noise 5 rpm white, PI with a safe margin": (
        "gain=10 time_constant=0.5 offset=10 amplitude=4 duration=60 variance=25"
    ),
    "PI loop with 6 dB for a motor: 10 rad/s per V, 0.5 s lag, 0.05 s of dead time, voltage 10 V +/- 5 "
    "V, 60 s, noise 9.549297 rpm slow, the bearing has some stiction": (
        "dead_time=0.05 standard_deviation=1 correlation_time=0.5"
    ),
    "PI level control for a tank: level rises 1.2 cm per minute per % of valve, dead time 10 s, valve "
    "50 +- 10 %, one hour, level noise 3 mm slowly": (
        "slope=0.02 L=none amplitude=10 standard_deviation=0.3 correlation_time=10"
    ),
    "I want a level controller for my tank. When I open the inlet valve by 10 % the level rises by "
    "about 12 cm per minute. Delay about 10 s. The valve can go from 40 to 60 %. The level is measured "
    "in cm with 0.2 cm noise. We have one hour.": (
        "slope=0.02 dead_time=10 offset=50 standard_deviation=0.2"
    ),
    "PI loop with a safe margin for a tank, level in cm: it integrates with 0.02 cm/s per %, dead time "
    "10 s, valve 50 +- 10 %, one hour, noise 0.3 cm, slow": ("slope=0.02 correlation_time=10"),
    "Temperature control of a room with a radiator. 10 % more valve warms the room by about 1.5 degC, "
    "time constant about 3 h, delay 10 minutes, valve 50 % plus or minus 20 %, two days, noise 0.05 K": (
        "gain=0.15 time_constant=10800 dead_time=600 offset=50 amplitude=20"
    ),
    "I want to predict the temperature of a room with a radiator within 5 %. The radiator valve can "
    "move between 30 and 70 %. Gain 0.15 °C/%, time constant 3 hours, dead time 10 minutes. The sensor "
    "has 0.1 °C resolution. I have two days.": (
        "relative=0.05 offset=50 amplitude=20 gain=0.15 variance=0.0008333333333333334"
    ),
    "Room with a radiator: gain 0.15 degC per %, time constant 3 hours, dead time 10 min, valve 30-70 "
    "%, 48 hours, noise 0.05 degC slowly varying, predict temperature within 5 % up to 0.001 rad/s": (
        "correlation_time=10800 amplitude=20 duration=172800"
    ),
    "Heat exchanger: gain 1.7 degC/%, 262 s time constant, 31 s dead time, all within 20 %. Temperature "
    "noise 0.1 degC, fades within a minute. Steam valve around 45 %, may move by 8 %. PI, gain margin "
    "2. 8 hours.": ("gain=1.7 time_constant=262 dead_time=31 gain_margin=2 offset=45 amplitude=8"),
    "I want a PI speed controller for a DC motor with dry friction. I run it around 6 V and may move it by "
    "+-2 V. Speed about 80 rad/s per volt, time constant about a tenth of a second, sensor noise about 0.8 "
    "rad/s. 20 seconds. We can sample every 10 ms.": (
        "time_constant=0.1 sample_time=0.01 offset=6 amplitude=2 duration=20 standard_deviation=0.8"
    ),
    "I want a level controller for my tank. The inlet valve stands at 50 % and may go from 40 to 60 %. "
    "When I open the inlet valve by 10 % the level rises by about 12 cm per minute. Delay about 10 s. 0.15 "
    "cm noise. At most one hour.": ("slope=0.02 offset=50 amplitude=10 duration=3600"),
    "PI loop with a safe margin: radiator valve in % around 40, may move +-15 %; temperature about 1.5 degC "
    "per 10 %, about an hour, 2 min dead time; sensor noise 0.04 degC that fades in 5 min, slow weather; "
    "two days": ("gain=0.15 time_constant=3600 offset=40 amplitude=15 dead_time=120 duration=172800"),
    "The valve works at 40 %, it may move between 25 and 55 %. The temperature rises by about 1.5 degC when "
    "the valve opens 10 %, after about an hour. Dead time 3 min. PI with good margin. Noise 0.1 degC. 2 days "
    "max.": ("gain=0.15 time_constant=3600 amplitude=15 duration=172800"),
    "exchanger: gain 1.72 degC/%, 262 s, 31 s, noise 0.1 degC, valve (%) at 45 +- 8, max 8 h, PI loop Ms 2": (
        "time_constant=262 dead_time=31 amplitude=8 max_sensitivity_db=6.0206 duration=28800"
    ),
    "PI speed loop with gain margin 2 for a 24 V drive with dry friction, around 9 V, about 20 rad/s per V "
    "and 0.3 to 0.4 s, noise half a rad/s (white), voltage may move +-3 V around 9 V, experiment up to "
    "20 s": ("gain=20 time_constant=0.35 offset=9 amplitude=3 duration=20 variance=0.25"),
    "K=1.7, T = 262 s, L=31 s, noise 0.1 degC, valve stands at 45 % and may move 8 % up and down, PI, 8 h": (
        "gain=1.7 time_constant=262 dead_time=31 amplitude=8 max_sensitivity_db=6"
    ),
    "evaporator level: feed pump 60 %, +/- 5 %; integrating, 0.01 %/s per %; dead time 12 s; noise 0.3 %; "
    "PI; 90 min": ("slope=0.01 dead_time=12 offset=60 amplitude=5"),
    "flow loop: valve 40 +- 10 %, flow in m3/h, 0.8 m3/h per %, 2 s, dead time 0.5 s, noise 0.3 m3/h white, "
    "10 min, PI with 6 dB": ("gain=0.8 time_constant=2 dead_time=0.5 variance=0.09"),
    "PI controller for a room. The radiator valve is at 40 %, it may move by +-20 %. One percent of valve "
    "gives about 0.11 degC, it reacts within about 0.7 h, dead time about 2 min. Noise 0.04 degC. The sensor "
    "shows 0.01 degC steps. The weather drifts slowly. I have 16 hours at most, less is better.": (
        # The noise, of variance 0.04^2 + 0.01^2 / 12, and a random walk are (1 + c q^-1) e / (1 - q^-1).
        "gain=0.11 time_constant=2520 dead_time=120 offset=40 duration=57600 variance=0.001963771"
    ),
    "I've got a heat exchanger on steam. Steam valve sits at 35 %, I can swing it ±5 %. Outlet temperature "
    "responds about 0.8 °C per %, in roughly 4 minutes, after 20 seconds or so. Sensor noise ±0.1 °C. I need "
    "a PI controller with a good margin, and I've got about 3 hours.": (
        "gain=0.8 time_constant=240 dead_time=20 offset=35 amplitude=5 standard_deviation=0.1 duration=10800"
    ),
    "Level tank, inlet valve at 50 %, +/-10 % allowed, level goes up 0.5 cm/min for each % of valve, 20 s "
    "dead time, measurement noise 0.15 cm, outflow increases slowly with level, two hours available, PI "
    "level controller": ("slope=0.00833333 dead_time=20 offset=50 amplitude=10 duration=7200"),
    "Room heating: valve around 40 % (25 to 55 %), temperature rises approximately 1.5 K for 10 % more "
    "valve, takes about an hour, delay of a few minutes; sensor noise 0.04 K, lasts 5 min; two days; PI": (
        "gain=0.15 time_constant=3600 dead_time=210 offset=40 amplitude=15 duration=172800"
    ),
    "Servo: 12 rpm per V, settles in 2 s, no dead time, 5 V +- 2 V, noise 3 rpm, 1 minute, PI": (
        "time_constant=0.5 duration=60"
    ),
    "Please design a test for a flow loop: running around 40 %, steps of 10 % are fine, gain 0.9 l/s per %, "
    "time constant between 3 and 4 s, dead time 1 s, noise rms 0.2 l/s white, 5 min, parameters within 3 %": (
        "time_constant=3.5 offset=40 amplitude=10 L=none duration=300"
    ),
}


def heard(sentence, folder, *more):
    """The draft after a sentence, and `more` answers to the questions that it leaves open."""
    talk = Conversation({}, "x", folder)
    for text in (sentence, *more):
        assert talk.answer(text) is None
    assert talk.question is None
    return talk.draft


def written(sentence, folder):
    """The draft after a sentence that is understood completely, and its text without the title."""
    found = in_sentence(sentence)
    if found.unclear:
        raise not_understood(found.unclear[0])
    draft = compose(found.answers, "x", folder, remarks=found.remarks)
    return draft, draft.text.split("\n", 2)[2]


@pytest.mark.parametrize(("sentence", "facts"), (KNOWN | WRITTEN).items())
def test_a_sentence_as_engineers_write_it_becomes_a_spec(sentence, facts, tmp_path):
    draft, text = written(sentence, tmp_path)
    for name, value in (fact.split("=") for fact in facts.split()):
        found = re.search(rf"\b{name}: (?:\[)?([-+.\de]+)", text)
        assert (found is None) == (value == "none"), name
        assert found is None or float(found[1]) == pytest.approx(float(value), rel=1e-4), name
    rough = re.findall(r"friction|stiction|sticks", sentence)
    assert sum("no linear model has it" in note for note in draft.notes) == len(rough)
    assert draft.spec() is not None
    assert sentence not in KNOWN or any("about" in note for note in draft.notes)


@pytest.mark.first(2)
@pytest.mark.parametrize("sentence", [*WRITTEN, *KNOWN])
def test_no_word_of_a_sentence_is_dropped_silently(sentence, tmp_path):
    """A strange word or number anywhere is refused, repeated in a remark, or written."""
    words = sentence.split(" ")
    for i in range(len(words) + 1):
        for strange in ("blorgy", "blorgy 7.77"):
            try:
                draft, text = written(" ".join([*words[:i], strange, *words[i:]]), tmp_path)
            except SpecError:
                continue
            assert all(part in f"{text} {draft.notes}" for part in strange.split()), words[:i]


@pytest.mark.parametrize(
    ("part", "instead", "refused"),
    [
        ("dead time 31 s", "some minutes of dead time", "minutes"),
        ("dead time 31 s", "it reacts slowly after a delay", "reacts"),
        ("one shift", "two nights", "nights"),
        ("time constant about 262 s", "the time constant is long", "time constant"),
        ("valve 45 +- 8 %", "the valve stands at 45 %, it may go from 40 to 60 %", "the middle of 40 to 60"),
        ("262 s", "2,400 s", "comma"),
        ("noise of 0.1 degC that fades in a minute", "noise 0.25 not white", "not"),
        ("noise of 0.1 degC that fades in a minute", "noise 0.3 peak-to-peak, white", "peak-to-peak"),
        ("noise of 0.1 degC that fades in a minute", "noise 5 % of the temperature", "% of the temperature"),
        ("45 +- 8 %", "45 % +- 8 % of that", "% of that"),
        ("one shift", "we have at least 6 min", "at least 6 min"),
        ("one shift", "seventy-three minutes", "minutes"),
        ("one shift", "an hour and a half", "half"),
        ("PI loop", "P loop", "PI and PID"),
    ],
)
def test_a_size_that_is_not_understood_is_refused(part, instead, refused, tmp_path):
    """A plant without its dead time, or an hour in place of two nights, would be another experiment."""
    with pytest.raises(SpecError, match=refused) as found:
        written(EXCHANGER.replace(part, instead), tmp_path)
    assert found.value.diagnostics[0].code == "bad-answer"


@pytest.mark.parametrize(
    "running",
    [
        "A level controller already runs with Kp 0.8, Ti 200 s",
        "a PI controller (Kp 0.8, Ti 200 s) is running",
        "it runs under a PI controller with Kp 0.8 and Ti 200 s",
        "the existing PI has Kp 0.8, Ti 200 s",
    ],
)
def test_a_running_controller_becomes_the_controller_of_the_experiment(running, tmp_path):
    """It was once taken for the controller to be tuned, and the experiment got a default."""
    text = f"level integrates 0.02 cm/s per %, dead time 10 s. {running}. PI loop with a safe margin, "
    text += "valve 50 +- 10 %, noise 0.15 cm white, 1 h"
    spec = written(text, tmp_path)[0].spec()
    assert (spec.experiment.controller.pid.Kp, spec.experiment.controller.pid.Ti) == (0.8, 200.0)
    assert spec.accuracy.loop.tuning is not None


@pytest.mark.parametrize(
    ("part", "where", "value"),
    [
        ("we get one hour", "limits.duration", 3600.0),
        ("the valve must not move more often than every 30 s", "signal.hold", 30.0),
        ("the output may deviate 3 degC at most", "limits.amplitude.output", 3.0),
        ("the level must not move by more than 3 degC", "limits.amplitude.output", 3.0),
        ("operating point 45 %, may go 35 to 55 %", "signal.offset", 45.0),
        ("an experiment of 30 min", "limits.duration", 1800.0),
    ],
)
def test_limits_are_understood_in_usual_wordings(part, where, value, tmp_path):
    """The rating of a device, 2 kW, sets no limit."""
    spoken = "PI loop with a safe margin, gain 2 degC/%, time constant 180 s, dead time 25 s, noise 0.1 degC"
    parts = [spoken.replace("PI loop", "PI loop for a 2 kW heater"), part]
    spec = written(", ".join([*parts, *["valve 50 +- 10 %"] * ("go" not in part)]), tmp_path)[0].spec()
    there = spec
    for name in where.split("."):
        there = getattr(there, name)
    if where == "signal.hold":
        there *= spec.sample_time
    assert float(np.max(there)) == pytest.approx(value)


@pytest.mark.parametrize(
    ("said", "ends"),
    [
        *dict.fromkeys(["3 to 6 min", "between 3 and 6 min", "3-6 min", "of 3 to 6 min"], (180, 360)).items(),
        ("of only a few minutes", (120, 300)),
        ("of between 2 and 5 minutes", (120, 300)),
    ],
)
def test_a_time_between_two_ends_is_an_interval(said, ends):
    found = plant_of_words(f"gain 2, time constant 40 min, dead time {said}")
    assert found.intervals["dead_time"] == pytest.approx(ends, rel=1e-3)
    remarks = in_sentence(f"gain 2, time constant 40 min, dead time {said}, valve 45 +- 8 %").remarks
    assert remarks == (('"a few minutes" is taken as 2 to 5 minutes',) if "few" in said else ())


@pytest.mark.parametrize(
    ("margin", "entry"),
    [
        ("a safe margin", {"max_sensitivity_db": 6.0}),
        ("a safe margin (gain margin 2)", {"gain_margin": 2.0}),
        ("a good phase margin of 30 degrees", {"phase_margin": 30.0}),
    ],
)
def test_a_number_determines_the_size_of_a_safe_margin(margin, entry, tmp_path):
    plant = "gain 2, time constant 100 s, dead time 10 s, 45 +- 5 %, 2 h, noise 0.1"
    spec = heard(f"PI loop with {margin}: {plant}", tmp_path, *["no"] * 3).spec()
    loop = spec.accuracy.loop
    stated = {name: getattr(loop, name) for name in ("max_sensitivity_db", "gain_margin", "phase_margin")}
    assert {name: value for name, value in stated.items() if value is not None} == entry


@pytest.mark.parametrize(
    "leak", ["a slow outflow that grows with the level", "the tank leaks slowly", "it has a small leak"]
)
def test_a_leak_gives_a_remark_and_does_not_colour_the_noise(leak, tmp_path):
    tank = (
        "level rises about 0.5 cm per minute per %, dead time 20 s, noise of 0.15 cm, valve 50 +- 10 %, 2 h"
    )
    draft = heard(f"PI loop with 6 dB: {tank}, {leak}", tmp_path, *["no"] * 3)
    assert any("assess tests for one" in note for note in draft.notes)
    assert "slow" not in draft.text.split("noise:")[1].split("accuracy:")[0]


def test_a_sentence_adds_to_other_answers(tmp_path):
    """The plant of an answer is kept; the sentence adds the rest, which was once dropped."""
    answers = read_answers(None, ["plant=gain 2, time constant 180 s, dead time 25 s"])
    assert spread(answers, "PI loop with a safe margin")
    assert answers.texts["plant"].startswith("gain 2")
    assert "wish" in answers.texts
    with pytest.raises(SpecError):
        spread(read_answers(None, ["plant=heater"]), "something else")


def test_only_questions_that_a_sentence_leaves_open_are_asked(tmp_path):
    talk = Conversation({}, "x", tmp_path)
    assert talk.answer(EXCHANGER.replace("valve 45 +- 8 %, ", "")) is None
    asked = []
    while talk.question is not None:
        asked.append(talk.question.key)
        assert talk.answer({"range": "40 +- 5"}.get(asked[-1], "no")) is None
    assert asked == ["range", "hold", "converter", "return"]


@pytest.mark.parametrize(
    ("part", "question", "answer"),
    [
        ("dead time: about 2 degC/%, 3 minutes", "plant", "gain about 2 degC/%, time constant 3 minutes"),
        ("9 V nominal, +- 3 V", "range", "at 9 V, +- 3 V"),
        ("a drive, which runs around 9 V, +- 3 V", "range", "a drive runs around 9 V, +- 3 V"),
        (
            "working around 50 % and allowed to move +-10 %",
            "range",
            "working around 50 %, and allowed to move +-10 %",
        ),
        ("weather disturbs slowly", "drift", "yes"),
        ("the experiment may take 20 s", "time", "20 s"),
        ("it may go 15 % to either side of 40 %", "range", "by 15 % around 40 %"),
        ("gain 2 K/%. It takes about an hour", "plant", "gain 2 K/%, time constant about 1 hour"),
        (
            "For 10 % more valve y rises by 2 K. It takes an hour",
            "plant",
            "gain 2 K per 10 %, time constant 1 hour",
        ),
        ("the valve (in %) sits at 40 %, +- 5 %", "range", "the valve (in %) sits at 40 %, +- 5 %"),
        ("gain 2, time constant 40 s, roughly", "plant", "gain 2, time constant 40 s, roughly"),
        ("gain 2, reacts after a few s", "plant", "gain 2, reacts after 3.5 s within 42.85714 % itself"),
        ("10 % more makes the room about 1.5 degC warmer", "plant", "gain about 1.5 degC per 10 %"),
        ("10 % more gets the water 1.5 degC colder", "plant", "gain -1.5 degC per 10 %"),
        ("with 6 dB gain margin", "wish", "gain margin 6 dB"),
        ("our loop now has Kp 1.2, Ti 90 s", "loop", "Kp 1.2, Ti 90 s"),
        ("no drift", "drift", "no"),
        ("a binary signal", "signals", "two levels"),
        ("without return", "return", "no"),
        ("slow noise of 0.1 degC; 2 h", "noise", "slow, noise of 0.1 degC, noise 0.1, white"),
        ("rise time 440 s", "plant", "time constant 200 s"),
        ("all values approximate", "plant", "roughly"),
        ("Ms of 2 dB", "wish", "2 dB"),
        ("1 h 30 min", "time", "90 min"),
        ("to know the gain within 3 %", "wish", "parameters within 3 %"),
        ("1 min test", "time", "1 min"),
        (
            "one volt more gives about 20 rad/s more, 0.3-0.5 s time constant",
            "plant",
            "gain about 20 rad/s per 1 volt, time constant 0.4 s within 25 % itself",
        ),
        (
            "10 % more radiator valve gives about 1.5 degC, that takes about an hour",
            "plant",
            "gain about 1.5 degC per 10 %, time constant about 1 hour",
        ),
        ("one more volt gives 2 rad/s less", "plant", "gain -2 rad/s per 1 volt"),
        (
            "2 % of valve makes the pressure rise by 0.3 bar per minute",
            "plant",
            "rises by 0.3 bar per minute per 2 %",
        ),
        (
            "1 l/h of caustic raises the pH by 0.3, T 4 min",
            "plant",
            "gain 0.3 per 1 l/h, time constant 4 min",
        ),
        ("the pressure rises 0.2 bar per m3/h", "plant", "the pressure rises 0.2 bar per m³/h"),
        ("10 % give 5 cm per minute more", "plant", "rises by 5 cm per minute per 10 %"),
        ("No controller runs now", "loop", "open"),
        ("There is no controller yet", "loop", "open"),
        ("Experiment in open loop", "loop", "open"),
        ("For each volt the speed rises by 20 rad/s", "plant", "gain 20 rad/s per 1 volt"),
        ("The speed rises by 20 rad/s per V", "plant", "gain 20 rad/s per V"),
        ("the angle rises by 2 rad/s per V", "plant", "rises by 2 rad/s per V"),
        (
            "level goes up 0.5 cm in a minute for each % of valve",
            "plant",
            "level rises by 0.5 cm per minute per 1 % of valve",
        ),
        ("gain 2, lag 3 s; experiment 20 s", "time", "20 s"),
        ("a drive with dry friction, working at 9 V", "range", "working at 9 V"),
        ("gain 2, delay 2..4 minutes", "plant", "gain 2, delay 3 minutes within 33.33333 % itself"),
        ("PI for the level in a tank; level in cm", "names", "level in cm"),
        (
            "gain 2 rad/s per V, lag 1h7min, dead time none",
            "plant",
            "gain 2 rad/s per V, lag 67 min, dead time none",
        ),
        ("gain 2, lag 3 s, speed between 150 and 210 rad/s, 9V+-3V", "range", "9V+-3V"),
        ("lag 3 s; forty-five minutes", "time", "45 minutes"),
        (
            "the level climbs about 10 cm a minute per 10 %",
            "plant",
            "the level rises by about 10 cm per minute per 10 %",
        ),
        ("settles in one to two seconds", "plant", "time constant 0.375 seconds within 33.33333 % itself"),
        ("no position shorter than 10 minutes", "hold", "10 minutes"),
        ("each position lasts 20 s", "hold", "20 s"),
        ("the valve must stay 20 s in each position", "hold", "20 s"),
        ("valve 40 +- 10 %, at least 10 min per position", "hold", "10 min"),
        ("gain 2 degC/%, lag 30 min, temperature noise 0.1, PI loop", "names", "temperature"),
        ("positions are kept for 20 s", "hold", "20 s"),
        ("gain 2, lag 3 s; PI loop with 6 dB peak sensitivity", "wish", "PI loop, 6 dB"),
        ("gain 2, lag 3 s; PI loop, maximum sensitivity of at most 2", "wish", "PI loop, Ms 2"),
        ("it must not hold any position for less than 10 minutes", "hold", "10 minutes"),
        ("Rest at 3 V, may change by 1 V", "range", "Rest at 3 V, may change by 1 V"),
        ("Gate is at 40 mm, plus or minus 6 mm", "range", "Gate is at 40 mm, plus or minus 6 mm"),
        ("valve at 40 %, 5 % either way", "range", "valve at 40 %, by 5 %"),
        ("valve 40 % give or take 4 %", "range", "valve 40 % give or take 4 %"),
        ("one ml/min more means 0.1 pH less", "plant", "gain -0.1 pH per 1 ml/min"),
        ("lag 3 s; no faster than 1 % per second", "limits", "rate 1 per second"),
        ("lag 3 s. From 8:00 to 14:00", "time", "360 min"),
        ("valve at 40 %, may go 10 % up and 10 % down", "range", "valve at 40 %, by 10 %"),
        ("valve 30 %, not above 38 % and not below 22 %", "range", "valve at 30 %, 22 % to 38 %"),
        ("it must not change by more than 1 % per minute", "limits", "rate 1 per minute"),
        (
            "gain 2, lag 3 s, nothing happens in the first few s",
            "plant",
            "gain 2, lag 3 s, dead time 3.5 s within 42.85714 % itself",
        ),
        ("lag 3 s; we cannot have more than 40 minutes", "time", "40 minutes"),
        ("lag 3 s; the trial may last an hour", "time", "1 hour"),
        ("gain 2, reacts 12 s after the feeder changes", "plant", "gain 2, dead time 12 s"),
        ("gain 2, 63 % of it is reached after 70 s", "plant", "gain 2, time constant 70 s"),
        ("gain 2, it needs 20 minutes to react fully", "plant", "gain 2, time constant 5 minutes"),
        ("gain 2, lag 3 s, each known to 10 %", "plant", "gain 2, lag 3 s, each known within 10 %"),
        ("a converter of 12 bits from 0 to 100 %, valve 40 +- 5 %", "converter", "12 bits up to 100 %"),
        ("Feeder at 45 %, plus or minus 8 %", "range", "at 45 %, plus or minus 8 %"),
        (
            "the valve, which is at 30 %, may be varied by 4 %",
            "range",
            "the valve is at 30 %, may be varied by 4 %",
        ),
        ("level 3 m; the level must stay within 20 cm", "limits", "output 20 cm"),
        ("temperature scatters by +- 0.3 K, flow 12 +- 1 l/min", "range", "flow 12 +- 1 l/min"),
        ("lag 3 s; shortest positions of 2 min", "hold", "2 min"),
        ("lag 3 s; shortest time between moves 30 s", "hold", "30 s"),
        (
            "log good.csv, columns u=controller output; y=level",
            "plant",
            "log good.csv, columns u=controller output; y=level",
        ),
        ("lag 3 s; at the end the valve must be where it started", "return", "yes"),
    ],
)
def test_a_part_of_a_sentence_answers_its_question(part, question, answer, tmp_path):
    """The part is also accepted as an answer, next to other answers without units."""
    assert in_sentence(f"{part}; noise 0.1, white").answers[question] == answer
    if question in ("hold", "converter", "limits", "return", "drift", "loop", "signals"):  # whole answers
        said = {"plant": "gain 2, time constant 180 s, dead time 6 s", "range": "40 +- 5", "time": "1 day"}
        compose(ENGINEER | said | {question: answer}, "x", tmp_path).spec()


@pytest.mark.parametrize("fades", ["fades in", "that fades over", "which dies away in", "varies within"])
@pytest.mark.parametrize(
    "noise",
    [
        *(
            "noise of 0.1",
            "the reading scatters by 0.1",
            "the tacho scatters 0.1",
            "the level is noisy by 0.1",
        ),
        *("the level scatters by +- 0.1", "noise of +-0.1", "the level is noisy with 0.1"),
    ],
)
def test_noise_has_the_correlation_time_that_is_stated(noise, fades, tmp_path):
    """The length of the experiment is not stated; the time was once taken for it."""
    _, text = written(
        f"{noise}, {fades} about ten minutes; gain 2, lag 5 min, dead time 30 s; 40 +- 5; PI", tmp_path
    )
    assert (
        re.search(r"standard_deviation: (\S+)", text)[1],
        re.search(r"correlation_time: (\S+)", text)[1],
    ) == (*("0.1", "600"),)


PLAIN = (
    "gain 2 degC/%, time constant 200 s, dead time 20 s; valve 40 +- 5 %; noise 0.1 degC; 2 h; PI with 6 dB"
)


@pytest.mark.parametrize(
    "gain",
    ["minus 2 degC/%", "of negative 2 degC/%", "the temperature rises by 10 degC when the valve closes 5 %",
     "when the valve closes by 5 % the temperature rises by 10 degC",
     "closing the valve by 5 % raises the temperature by 10 degC", "10 % more valve gives 20 degC less",
     "opening the valve by 10 % makes the temperature fall by 20 degC",
     "the temperature falls by 20 degC per 10 % of valve", "the temperature drops 2 degC per % of valve"],
)  # fmt: skip
def test_a_negative_gain_is_understood(gain, tmp_path):
    words = gain if "valve" in gain else f"gain {gain}"
    spec = heard(PLAIN.replace("gain 2 degC/%", words), tmp_path, *["no"] * 3).spec()
    assert spec.plant.continuous.gain == pytest.approx(-2.0)


@pytest.mark.parametrize("does", ["warms", "cools"])
def test_a_rise_without_a_move_of_the_input_is_no_gain(does):
    """The size of the move is unknown and not assumed; the rise is no range of the input."""
    said = in_sentence(f"the heater {does} the room by 1.5 degC in about an hour; noise 0.1, white").answers
    assert "range" not in said
    assert code_of(plant_of_words, said["plant"]) == "bad-answer"


@pytest.mark.parametrize(
    "words",
    ["closing the valve by 5 % makes the temperature fall by 10 degC",
     "when I raise the lower valve by 5 % the temperature rises by 10 degC",
     "opening the pressure reducing valve by 5 % raises the temperature by 10 degC",
     "the temperature rises by 10 degC when the reducing valve opens 5 %"],
)  # fmt: skip
def test_other_gains_keep_a_positive_sign(words):
    said = in_sentence(PLAIN.replace("gain 2 degC/%", words)).answers["plant"]
    assert plant_of_words(said).values["gain"] == pytest.approx(2.0)


@pytest.mark.parametrize(
    "part",
    ["the experiment starts after 10 min", "the valve may increase by 5 %", "an increase of 5 % in load",
     "I want now a PI with Kp 1.2, Ti 90 s", "the plant gets 10 % slower in winter"],
)  # fmt: skip
def test_words_about_other_things_do_not_change_the_plant(part):
    heard = in_sentence(f"{PLAIN}; {part}").answers
    assert heard["plant"] == in_sentence(PLAIN).answers["plant"]
    assert "loop" not in heard


@pytest.mark.parametrize(
    "part",
    ["reverse acting", "the gain is negative", "time constant 2 ks", "dead time 3 samples", "sampling 0.5 Hz",
     "rate 2 % per sample", "four times faster than the plant", "it may move by 5 % in total", "unstable",
     "upwards only", "known to a factor of two", "all accurate to ten percent", "noise slower than the plant",
     "PRBS please", "the valve is open or closed", "overnight", "not white", "not PID",
     "the loop is switched off", "columns of the log: valve and level", "sample time x", "u=valve"],
)  # fmt: skip
def test_words_that_change_the_meaning_are_asked_about(part):
    assert in_sentence(f"{part}; {PLAIN}").unclear


@pytest.mark.parametrize("apart", ["0.5 min", "30 s", "16.6667 %"])
def test_a_tolerance_may_have_its_own_unit(apart):
    gain = plant_of_words("gain 1.5 degC/% +- 0.2, time constant 9 s").intervals["gain"]
    assert gain == pytest.approx((1.3, 1.7))
    found = plant_of_words(f"gain 2, time constant 40 min, dead time 3 min +- {apart}")
    assert found.intervals["dead_time"] == pytest.approx((150.0, 210.0), rel=1e-5)


@pytest.mark.parametrize("last", ["dead time 2 to 4 min", "dead time 3 min +- 1 min", "2-4 min dead time"])
def test_a_tolerance_of_one_quantity_is_no_tolerance_of_all(last):
    found = plant_of_words(f"gain 2, time constant 40 min, {last}")
    assert set(found.intervals) == {"dead_time"}
    both = plant_of_words("gain 2, time constant 40 min, dead time 3 min, within 10 %")
    assert set(both.intervals) == {"gain", "time_constant", "dead_time"}


def test_a_remark_lists_the_questions_that_were_not_asked():
    (said,) = taken_for_granted({"hold": "60 s"})
    assert [one.key for one in QUESTIONS if one.unsaid and one.unsaid in said] == [
        "time",
        "converter",
        "return",
    ]
    assert taken_for_granted({"hold": "no", "time": "2 h", "converter": "no", "return": "no"}) == []


@pytest.mark.parametrize("lag", ["settles in about 4 h", "time constant about 1 h"])
def test_a_settling_time_or_time_constant_may_be_approximate(lag):
    assert plant_of_words(f"gain 2, {lag}").intervals["time_constant"] == pytest.approx((2880.0, 4320.0))


def test_parts_that_are_not_understood_are_asked_for_in_other_words(tmp_path):
    """New words are added to the answers that are known."""
    talk = Conversation({}, "x", tmp_path)
    sentence = EXCHANGER.replace("time constant about 262 s, dead time 31 s", "some minutes or so")
    assert talk.answer(sentence.replace("valve 45 +- 8 %", "valve 45, 8 up")) is None
    assert talk.unclear == ["some minutes or so", "valve 45", "8 up"]
    assert talk.answer("gibberish").diagnostics[0].code == "bad-answer"
    assert talk.answer("time constant -3 s").diagnostics[0].code == "bad-answer"
    assert talk.unclear[0] == "some minutes or so"
    assert talk.answer("time constant 262 s, dead time 31 s") is None
    assert talk.answer("range=45 +- 8 %") is None
    assert talk.answer("valve 45 % +- 8 %") is None  # again, in place of the first
    while talk.question is not None:
        assert (bool(talk.question.unsaid), talk.answer("no")) == (True, None)
    assert "gain: 1.72, time_constant: 262, dead_time: 31" in talk.draft.text
    assert (talk.draft.spec().limits.amplitude.input, talk.draft.spec().signal.offset) == (8, 45)


def test_a_part_that_is_left_out_gives_a_remark(tmp_path):
    talk = Conversation({}, "x", tmp_path)
    assert talk.answer(f"{EXCHANGER} Serial number 77.") is None
    assert talk.answer("leave it out") is None
    assert talk.remarks[-1] == "left out: Serial number 77"
    assert talk.unclear == []


def test_an_operating_point_that_is_stated_twice_must_be_the_same():
    assert input_range("+-3 V around 9 V, at 9 V") == input_range("9 V +- 3 V")
    assert code_of(input_range, "+-3 V around 9 V, at 10 V") == "bad-answer"


def test_a_sentence_may_leave_the_plant_open():
    answers = read_answers(None, [])
    assert spread(answers, "PI temperature loop with a safe margin")
    assert set(answers.texts) == {"wish"}


def test_a_plant_that_lacks_a_quantity_is_completed_by_the_next_answer(tmp_path):
    talk = Conversation({}, "x", tmp_path)
    assert talk.answer("gain 2, dead time 25 s").diagnostics[0].key == "plant"
    assert talk.answer("time constant 180 s") is None
    assert talk.answers["plant"] == "gain 2, dead time 25 s, time constant 180 s"


@pytest.mark.parametrize(
    "text", ["gain 2, time constant 180 s, dead time 25 s, each within 30 %", "heater", ""]
)
def test_an_answer_to_one_question_is_no_sentence(text):
    assert in_sentence(text).answers == {}


def test_a_log_may_stand_in_a_sentence():
    assert in_sentence("PI loop with 6 dB, gain ca. 2").answers["plant"] == "gain ca. 2"
    found = in_sentence("PI loop with 6 dB, log a.csv columns u=OP [%], y=PV, valve 45 +- 8 %").answers
    assert found["plant"] == "log a.csv columns u=OP [%], y=PV"
    assert set(found) == {"wish", "plant", "range"}


def test_a_clause_that_answers_no_question_gives_a_remark():
    (remark,) = in_sentence(EXCHANGER + " The moon is full.".lower()).remarks
    assert "moon full" in remark


@pytest.mark.parametrize(
    "part",
    [
        "avoid two levels",
        "do not use a binary signal",
        "no binary signal",
        "without three levels",
        "rather a multisine than two levels",
        "two levels are not allowed",
        "avoid drift",
        "don't want a loop",
        "avoid more than 0.5 % of overshoot",
    ],
)
def test_negated_wishes_are_asked_about_and_answer_no_question(part):
    heard = in_sentence(f"gain 2 degC per %, lag 3 min, noise 0.1, {part}, 2 h")
    assert set(heard.answers) == {"plant", "noise", "time"}
    assert len(heard.unclear) == 1
    assert heard.unclear[0] in part


def test_a_sentence_in_a_file_yields_to_other_answers_and_keeps_its_line(tmp_path):
    file = tmp_path / "a.yaml"
    file.write_text(f'time: 2 h\nplant: "{EXCHANGER}"\n')
    said = read_answers(file)
    assert spread(said)
    assert (said.texts["time"], said.texts["range"]) == ("2 h", "valve 45 +- 8 %")
    assert said.places["range"].line == 2


@pytest.mark.parametrize("word", ["about", "roughly", "circa", "ca.", "~", "approximately"])
def test_about_means_within_a_fifth_and_gives_a_remark(word):
    plant = plant_of_words(f"dead time {word} 35 s within 10 %, gain {word} 1.6, time constant 240 s")
    assert plant.intervals == {"gain": pytest.approx((1.28, 1.92)), "dead_time": pytest.approx((31.5, 38.5))}
    (said,) = plant.heard
    assert "gain 1.28 to 1.92" in said
    assert "dead time" not in said
    assert plant_of_words(f"gain {word} 1.6, time constant 9, dead time 1, each within 5 %").heard == ()


@pytest.mark.parametrize(
    ("said", "missing"),
    [
        ("gain 2, time constant 9 s", "dead time"),
        ("gain 2, time constant 9 s, no dead time", ""),
        ("gain 2, time constant 9 s, dead time 1 s", ""),
        ("integrates 0.02 %/s per %, dead time 20 s", "lag of the actuator"),
    ],
)
def test_quantities_that_a_plant_in_words_leaves_out_give_a_remark(said, missing):
    heard = plant_of_words(said).heard
    assert len(heard) == bool(missing)
    assert missing in "".join(heard)


@pytest.mark.parametrize(
    "late", ["delayed by 5 s", "5 s transport delay", "a delay of 5 s", "pure delay 5 s"]
)
def test_a_dead_time_may_be_called_a_delay(late):
    plant = plant_of_words(in_sentence(f"gain 2, lag near 25 minutes, {late}, noise 0.1").answers["plant"])
    assert plant.values == {"gain": 2.0, "time_constant": 1500.0, "dead_time": 5.0}
    assert list(plant.intervals) == ["time_constant"]  # "near" means "about"


@pytest.mark.parametrize("plant", ["words", "system"])
@pytest.mark.parametrize("answer", [{"hold": "20 s"}, {"loop": "open"}, {"hold": "20 s", "loop": "open"}])
def test_an_integrator_in_open_loop_gets_no_power_at_frequency_zero(plant, answer, tmp_path):
    """The output is proportional to the sum of the input over the record, which stays small."""
    (tmp_path / "p.json").write_text('{"num": [0.02], "den": [1, 0], "delay": 10}')
    known = "integrates 1.2 %/min per %, dead time 10 s" if plant == "words" else "p.json"
    draft = compose(ENGINEER | {"plant": known, "time": "30 min"} | answer, "x", tmp_path)
    spec = draft.spec()
    assert spec.experiment.controller is None
    unasked = "loop" not in answer
    assert any("open loop" in note for note in draft.notes) == unasked
    solved = solve(spec.with_(uncertainty=None, **{"solver.any_spectrum": False}))
    (u,) = (
        values - spec.signal.offset
        for name, values in solved.tables["signal"].columns.items()
        if name.startswith("u1")
    )
    assert np.max(np.abs(np.cumsum(u))) < 0.1 * len(u) * np.max(np.abs(u))
    if "hold" in answer:
        assert np.min(np.diff(np.flatnonzero(np.diff(u)))) * spec.sample_time >= 20


def test_an_integrating_plant_gets_a_stable_loop_by_default(tmp_path):
    """1/(1 + C G) of Skogestad's settings has a peak below 6 dB, evaluated in continuous time."""
    answers = ENGINEER | {"plant": "integrates 1.2 %/min per %, dead time 10 s", "time": "1 h"}
    spec = compose(answers, "x", tmp_path).spec()
    pid = spec.experiment.controller.pid
    s = 1j * np.geomspace(1e-4, 3, 3000)
    loop = pid.Kp * (1 + 1 / (pid.Ti * s)) * 0.02 / s * np.exp(-10 * s)
    assert np.max(1 / np.abs(1 + loop)) < 2.0
    open_loop = compose(answers | {"loop": "PI Kp 1, Ti 300"}, "x", tmp_path)
    assert not any("controller" in note for note in open_loop.notes)
    for wrong in (
        "integrates 0.02",
        "integrates 0, dead time 5 s",
        "gain 2, integrates 3, time constant 9 s",
    ):
        with pytest.raises(SpecError):
            plant_of_words(wrong)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("valve 45 +- 8 %", (8, 45, "valve", "%")),
        ("may move +-8", (8, 0, "", "")),
        ("the steam valve may move by 8 % around 45 %", (8, 45, "steam valve", "%")),
        ("heater from 35 V to 45 V", (5, 40, "heater", "V")),
        ("the input may be moved ±8 around 45", (8, 45, "", "")),
        ("± 5 % around 40 %", (5, 40, "", "%")),
        ("5 % around 40 %", (5, 40, "", "%")),
        ("5 around 40", (5, 40, "", "")),
        ("plus/minus 5 around 40", (5, 40, "", "")),
        ("plus/minus 5", (5, 0, "", "")),
        ("35 to 45", (5, 40, "", "")),
        ("the pump moves 50 +- 10 m3/h", (10, 50, "pump", "m³/h")),
        ("run at 40 V, +- 5 V", (5, 40, "", "V")),
    ],
)
def test_a_range_states_the_name_and_the_unit_of_the_input(text, found):
    span = input_range(text)
    assert (span.amplitude, span.offset, span.name, span.unit) == found


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("gain 20 rad/s per V, lag 0.4 s, 9 +- 3 V, noise 0.5 rad/s, PI speed loop", "speed"),
        ("opening the valve 10 % raises the level by 10 cm per minute, PI loop with 6 dB", "level"),
        ("gain 2 degC/%, lag 30 min, temperature noise 0.1, PI loop", "temperature"),
        ("gain 2 degC/%, lag 30 min, noise of the temperature 0.1, PI loop", "temperature"),
        ("fan speed stands at 60 % and may move by 10 %, gain -0.2 degC per %, lag 5 min, PI loop", None),
        ("gain 0.1 pH per l/h, lag 60 s, acid flow 30 +- 5 l/h, noise 0.02 pH, PI loop", None),
        ("steam pressure 4 +- 0.5 bar, gain 10 degC per bar, lag 10 min, noise 0.1, PI loop", None),
        ("pump speed 1500 +- 100 rpm, gain 0.2 bar per 100 rpm, lag 20 s, PI pressure loop", "pressure"),
        ("log log.csv columns u=valve, y=outlet; PI temperature loop", None),
        ("temperature is controlled by steam flow, gain 2 degC per l/h, lag 9 min, PI loop", "temperature"),
        ("pump speed is controlled by an inverter, gain 2 bar/%, lag 20 s, PI loop", None),
    ],
)
def test_an_output_has_the_name_of_the_controlled_quantity_not_of_the_input(text, name):
    assert in_sentence(text).answers.get("names") == name


@pytest.mark.parametrize(
    ("answers", "channels"),
    [
        ({"plant": "gain 2 degC/%, time constant 180 s"}, {"u1": {"unit": "%"}, "y1": {"unit": "degC"}}),
        ({"names": "valve in %, outlet temperature in degC"},
         {"u1": {"name": "valve", "unit": "%"}, "y1": {"name": "outlet temperature", "unit": "degC"}}),
        ({"names": "level in cm, inlet valve in %"},
         {"u1": {"name": "inlet valve", "unit": "%"}, "y1": {"name": "level", "unit": "cm"}}),
        ({"names": "valve in %, flow in l/min"},
         {"u1": {"name": "valve", "unit": "%"}, "y1": {"name": "flow", "unit": "l/min"}}),
        ({"names": "flow in l/min"}, {"y1": {"name": "flow", "unit": "l/min"}}),
        ({"names": "flow"}, {"y1": {"name": "flow"}}),
        ({}, {}),
    ],
)  # fmt: skip
def test_channels_have_the_names_and_units_that_were_stated(answers, channels, tmp_path):
    spec = compose(ENGINEER | {"plant": "gain 2, time constant 180 s"} | answers, "x", tmp_path).spec()
    found = {name: one.model_dump(exclude_none=True) for name, one in (spec.channels or {}).items()}
    assert found == channels


def test_the_loop_of_a_lag_without_a_dead_time_keeps_the_default_margin(tmp_path):
    """Skogestad's settings for a closed loop four times as fast; |1/(1 + C G)| half a sample late."""
    answers = ENGINEER | {"plant": "gain 2, time constant 180 s"}
    draft = compose(answers, "x", tmp_path)
    draft.validate()
    spec = draft.spec()
    tau, step = spec.accuracy.loop.tuning.simc.tau_c, spec.sample_time
    assert tau == 45.0
    s = 1j * np.geomspace(1e-5, np.pi / step, 3000)
    loop = 180.0 / (2 * tau) * (1 + 1 / (180.0 * s)) * 2 / (180 * s + 1) * np.exp(-s * step / 2)
    assert np.max(1 / np.abs(1 + loop)) < 10 ** (6 / 20)
    with pytest.raises(SpecError, match="a PI will do"):
        compose(answers | {"wish": "PID loop with 6 dB"}, "x", tmp_path)


@pytest.mark.parametrize(("lag", "late"), [(200, 20), (100, 5), (30, 30)])
def test_the_loop_of_a_pid_is_sampled_fast_enough_for_its_derivative(lag, late, tmp_path):
    plant = f"gain 2 degC/%, time constant {lag} s, dead time {late} s"
    draft = heard(f"{plant}; valve 40 +- 5 %; noise 0.1 degC; 2 h; PID with 6 dB", tmp_path, *["no"] * 3)
    draft.validate()
    assert draft.spec().sample_time <= late / 10


@pytest.mark.parametrize("step", [0.1, 0.5, 3.0])
def test_every_level_of_a_converter_is_a_multiple_of_its_step(step, tmp_path):
    spec = compose(ENGINEER | {"converter": f"steps of {step} %"}, "x", tmp_path).spec()
    converter = spec.signal.quantisation
    assert 2 * converter.range / 2**converter.bits == pytest.approx(step)
    assert converter.range >= 45.0


def test_a_drift_is_equally_fast_for_every_colour_of_the_noise(tmp_path):
    """The long-run steps of (1 + c q^-1)/(1 - a q^-1) e deviate by (1 + c)/(1 - a) times as much as e."""
    steps = []
    for colour in ("white", "fades in 20 s", "fades in 60 s"):
        noise = compose(ENGINEER | {"noise": f"0.2 degC, {colour}, drifting"}, "x", tmp_path).spec().noise
        pole = -noise.D[1] if len(noise.D) > 1 else 0.0
        steps.append((1.0 + noise.C[1]) / (1.0 - pole) * np.sqrt(noise.variance))
        assert noise.drift
    assert steps == pytest.approx([0.2 * 0.2] * 3, rel=1e-4)


def test_a_log_in_which_the_input_moves_is_no_record_at_rest(tmp_path):
    for moves in (0.0, 1.0):
        rows = np.c_[np.arange(100) % 2 * moves, np.random.default_rng(1).standard_normal(100)]
        np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="u,y", comments="")
        if moves:
            with pytest.raises(SpecError, match="moves: name its plant"):
                compose(ENGINEER | {"noise": "as in log.csv"}, "x", tmp_path)
        else:
            compose(ENGINEER | {"noise": "as in log.csv"}, "x", tmp_path)


def test_positions_are_held_at_least_as_long_as_stated(tmp_path):
    spec = compose(ENGINEER | {"hold": "57 s", "return": "yes"}, "x", tmp_path).spec()
    assert (spec.signal.hold - 1) * spec.sample_time < 57 <= spec.signal.hold * spec.sample_time
    assert (spec.signal.type, spec.signal.at("return")) == ("binary", True)
