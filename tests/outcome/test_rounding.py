"""What is rounded to one side holds there, and is near."""

from fractions import Fraction

import pytest
from hypothesis import given, strategies as st

from inputdesign_cli.outcome.shares import rounded_down, rounded_up

SIZES = st.floats(1e-30, 1e30) | st.floats(-1e30, -1e-30) | st.just(0.0)


@given(value=SIZES, digits=st.integers(2, 9))
def test_what_is_rounded_is_on_its_side_and_near(value, digits):
    down, up = (Fraction(rounded(value, digits)) for rounded in (rounded_down, rounded_up))
    slack = abs(Fraction(value)) / 10**11
    assert down - slack <= Fraction(value) <= up + slack
    assert up - down <= abs(Fraction(value)) / 10 ** (digits - 1) + slack


@pytest.mark.parametrize(("value", "down", "up"), [(3.14159265, "3.141", "3.142"), (0.5, "0.5", "0.5")])
def test_numbers_that_have_their_digits_keep_them(value, down, up):
    assert (rounded_down(value, 4), rounded_up(value, 4)) == (down, up)
