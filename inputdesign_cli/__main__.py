"""`python -m inputdesign_cli` and `idesign`: an interrupt while modules are imported is orderly too."""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

INTERRUPTED = 130  # as in `errors`, which may not have been imported yet
_AGAIN = 0.05  # seconds
# New objects before cycles among them are looked for: a command makes about as many in all, most of them by
# its imports.
_YOUNG = 500_000


def main() -> None:
    """Run the `idesign` command."""
    sys.unraisablehook = _send_again
    # The backend of a notebook from which the command is started need not exist here.
    os.environ["MPLBACKEND"] = "agg"
    gc.set_threshold(_YOUNG, 10, 10)
    atexit.register(gc.freeze)  # what is left at the end need not be looked through
    try:
        from inputdesign_cli.compute.interruptions import bare_interruptions

        with bare_interruptions():
            from inputdesign_cli.cli import main as run

            run()
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # once is enough
        sys.stderr.write("interrupted\n")
        sys.exit(INTERRUPTED)


def _send_again(lost: UnraisableHookArgs) -> None:
    """Send an interruption again that was raised in a finalizer, where Python drops it.

    The handler of `compute.interruptions` sees to that; before it stands, Ctrl-C is sent once more.
    """
    if not issubclass(lost.exc_type, KeyboardInterrupt | SystemExit):
        sys.__unraisablehook__(lost)
    elif signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        again = threading.Timer(_AGAIN, os.kill, [os.getpid(), signal.SIGINT])
        again.daemon = True
        again.start()


if __name__ == "__main__":
    main()
