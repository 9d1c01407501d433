"""An end that another error hides is that end."""

import signal

import pytest

from inputdesign_cli.compute.interruptions import bare_interruptions, interrupt


def ended(number):
    """An end of which a compiled module makes an error of its own, which names it in words at most."""
    with bare_interruptions():
        try:
            interrupt(number, None)
        except BaseException:
            raise ImportError("failed to import") from None


@pytest.mark.parametrize(
    ("number", "end", "code"), [(signal.SIGINT, KeyboardInterrupt, ()), (signal.SIGHUP, SystemExit, (129,))]
)
def test_an_end_that_another_error_hides_is_itself(number, end, code):
    with pytest.raises(end) as raised:
        ended(number)
    assert raised.value.args == code


def failing():
    with bare_interruptions():
        raise ValueError("wrong")


def test_errors_without_an_end_stand():
    with pytest.raises(SystemExit):
        ended(signal.SIGTERM)
    with pytest.raises(ValueError, match="wrong"):
        failing()
