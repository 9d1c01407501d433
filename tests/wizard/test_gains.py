"""A gain has one form, whatever the order of its cause and its effect, and whichever words say its sign."""

import itertools

import pytest

from inputdesign_cli.wizard.gains import gains, in_one_form

CAUSES = {
    "opening the valve 5 %": 1,
    "when the valve opens by 5 %": 1,
    "with 5 % more steam": 1,
    "if I close the valve by 5 %": -1,
    "reducing the flow by 5 %": -1,
    "for 5 % less fuel": -1,
    "turning the heater down by 5 %": -1,
    "with the valve 5 % more closed": -1,
    "for a step of -5 %": -1,
    "opening the closed valve by 5 %": 1,
}
EFFECTS = {
    "the room warms by 2 K": 1,
    "the cooler gets 2 K warmer": 1,
    "the temperature drops by 2 K": -1,
    "it lowers the outlet by 2 K": -1,
    "the water becomes 2 K colder": -1,
    "it lets the temperature fall by 2 K": -1,
    "it makes the cooler rise by 2 K": 1,
}


@pytest.mark.parametrize(("cause", "effect"), list(itertools.product(CAUSES, EFFECTS)))
def test_the_sign_of_a_gain_is_the_product_of_the_signs_of_cause_and_effect(cause, effect):
    sign = "-" * (CAUSES[cause] != EFFECTS[effect])
    assert in_one_form(f"{cause} {effect}").endswith(f"gain {sign}2 K per 5 %")
    if cause.startswith(("when", "if")):
        found = in_one_form(f"{effect} {cause}, dead time 3 s")
        assert found.endswith(f"gain {sign}2 K per 5 %, dead time 3 s")


@pytest.mark.parametrize(
    ("said", "form"),
    [
        ("each extra kilowatt gives 12 degC", "gain 12 degC per 1 kilowatt"),
        ("2 degC for every 5 %", "gain 2 degC per 5 %"),
        ("1 % more caustic raises the pH by 0.2", "gain 0.2 per 1 %"),
        ("fills at 0.4 bar per minute for every 10 %", "rises by 0.4 bar per minute per 10 %"),
        ("1 V on the servo valve makes it move 25 mm per second", "rises by 25 mm per second per 1 V"),
        ("1 V more lets it move at 25 mm/s", "rises by 25 mm per s per 1 V"),
        ("5 Hz more make the belt 0.2 m/s faster", "gain 0.2 m/s per 5 Hz"),
        ("at 10 % more power it becomes some 30 degC hotter", "gain about 30 degC per 10 %"),
    ],
)
def test_every_wording_of_a_gain_has_one_form(said, form):
    assert in_one_form(said).endswith(form)
    assert in_one_form(f"blorgy {said}").startswith("blorgy ")


@pytest.mark.parametrize(
    "other",
    [
        "runs at 9 V, may move by 3 V",
        "heater at 40 %, may go 10 % up or down",
        "it must never get more than 15 K hotter when the valve opens 5 %",
        "noise 0.1 degC, the valve moves 5 %",
        "the motor turns at 150 rad/s with 9 V",
        "valve 35 to 45 %, the level rises in 3 min",
        "steps of 0.5 % take 2 s",
        "5 % more makes the cooler 2 K warmer",
        "opening the valve that is normally closed by 5 % raises the level by 2 cm",
        "the temperature rises to 70 degC when the valve opens to 45 %",
        "with 45 % it becomes 70 degC",
        "last year it rose and it rises by 5 K for 2 %",
        "the pressure must stay within 200 mbar when the valve moves 5 %",
    ],
)
def test_sizes_that_state_no_gain_are_left_as_they_are(other):
    assert in_one_form(other) == other


def test_a_size_that_is_not_called_a_change_is_reported_as_assumed():
    assert [one.assumed for one in gains("9 V gives 18 K; 2 V more gives 4 K")] == ["9 V", ""]
