"""What a system such as Windows lacks is not needed: neither to design nor to keep two writers apart."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.processes import running

SPECS = Path(__file__).parents[2] / "specs"

# Names that Python on Windows does not have.
BARE = """
import os, signal, sys
for name in ("fcntl", "resource", "pwd", "grp", "termios", "pty", "tty", "posix_ipc"):
    sys.modules[name] = None
for name in ("SIGHUP", "SIGALRM", "SIGKILL", "SIGUSR1", "SIGUSR2", "SIGPIPE", "SIGCHLD", "SIGQUIT", "SIGSTOP",
             "SIGCONT", "setitimer", "alarm", "pause", "ITIMER_REAL", "pthread_sigmask"):
    delattr(signal, name)
for name in ("fork", "forkpty", "getuid", "geteuid", "getgid", "getegid", "killpg", "setsid", "mkfifo",
             "sched_getaffinity", "O_NONBLOCK", "O_NOFOLLOW", "O_DIRECTORY", "O_CLOEXEC", "fchmod", "chown"):
    delattr(os, name)
from inputdesign_cli.__main__ import main
"""
DESIGN = BARE + "sys.argv[0] = 'idesign'\nmain()\n"
HOLD = (
    BARE
    + """
from pathlib import Path
from inputdesign_cli.outcome.replacing import workplace
with workplace(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""
)
WRITE = (
    BARE
    + """
from pathlib import Path
from inputdesign_cli.errors import OutputError
from inputdesign_cli.outcome import replacing
replacing._PATIENCE = 0.2
try:
    with replacing.workplace(Path(sys.argv[1])):
        print("free")
except OutputError as error:
    print(error.diagnostics[0].code)
"""
)


def python(program: str, *arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        cwd=cwd, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


@pytest.mark.slow
def test_a_spec_is_solved_twice_into_one_directory(tmp_path):
    for _ in range(2):
        done = python(
            DESIGN, "solve", SPECS / "first_order.yaml", "-o", tmp_path / "run", "--no-figures", cwd=tmp_path
        )
        assert done.returncode == 0, done.stderr
    assert "result.json" in os.listdir(tmp_path / "run")
    assert os.listdir(tmp_path) == ["run"]


def test_two_writers_of_one_directory_exclude_each_other(tmp_path):
    target = tmp_path / "run"
    command = [sys.executable, "-c", HOLD, str(target)]
    with running(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        assert python(WRITE, target, cwd=tmp_path).stdout == "output-busy\n"
        holder.communicate("")
        assert python(WRITE, target, cwd=tmp_path).stdout == "free\n"
