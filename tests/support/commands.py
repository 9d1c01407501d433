"""The command as a user calls it, in this process."""

import sys

import pytest

from inputdesign_cli.cli import main


def caller(monkeypatch, capsys):
    """Runs `idesign` with arguments: its exit code, stdout and stderr."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["idesign", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return ended.value.code or 0, out, err

    return call
