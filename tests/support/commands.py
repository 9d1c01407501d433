"""The command as a user calls it, in this process."""

import sys

import pytest

from inputdesign_cli.cli import main


def caller(monkeypatch, capsys=None):
    """Runs `idesign` with arguments: its exit code, and stdout and stderr where these are captured."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["idesign", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr() if capsys else ("", "")
        return ended.value.code or 0, out, err

    return call
