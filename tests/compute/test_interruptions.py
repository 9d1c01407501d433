"""An end that another error hides is that end."""

import signal
import time

import pytest

from inputdesign_cli.compute import interruptions
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


def test_an_import_that_lasts_too_long_is_interrupted(tmp_path, monkeypatch):
    """As that of a module which runs a command."""
    name = "inputdesign_cli.compute.interruptions"
    (tmp_path / "lasting.py").write_text(
        f"import sys\nfrom {name} import interrupt\ninterrupt(1, sys._getframe())\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(interruptions, "_PATIENCE", 0.0)
    with pytest.raises(SystemExit) as raised, bare_interruptions():
        __import__("lasting")
    assert raised.value.code == 129


class Dropping:
    """A key that is interrupted while it is compared, and drops that."""

    def __hash__(self):
        return 1

    def __eq__(self, _):
        try:
            interrupt(signal.SIGTERM, None)
        except SystemExit:
            return True


def dropping(tidied):
    with bare_interruptions():
        try:
            assert {Dropping(): 1}[Dropping()] == 1
            time.sleep(20)
        finally:
            try:
                raise ValueError("while it tidies up")
            except ValueError:
                time.sleep(0.3)
            tidied.append(True)


def test_an_end_that_is_dropped_comes_again_and_one_that_tidies_up_is_left_alone():
    tidied = []
    with pytest.raises(SystemExit) as raised:
        dropping(tidied)
    assert (raised.value.code, tidied) == (143, [True])
    time.sleep(0.2)
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
