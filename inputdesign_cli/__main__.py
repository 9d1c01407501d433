"""`python -m inputdesign_cli` and `idesign`: Ctrl-C ends them cleanly, also during imports."""

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
_RESEND_AFTER = 0.05  # seconds
# Number of new objects that starts a garbage collection. A whole command makes about as many, mostly while it
# imports.
_GC_THRESHOLD = 500_000


def main() -> None:
    """Run the `idesign` command."""
    sys.unraisablehook = _send_again
    # A command started in a notebook inherits its backend, which may not be installed here.
    os.environ["MPLBACKEND"] = "agg"
    gc.set_threshold(_GC_THRESHOLD, 10, 10)
    atexit.register(gc.freeze)  # no garbage collection at exit
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

    The handler of `compute.interruptions` does so itself; before it is installed, SIGINT is sent again here.
    """
    if not issubclass(lost.exc_type, KeyboardInterrupt | SystemExit):
        sys.__unraisablehook__(lost)
    elif signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        again = threading.Timer(_RESEND_AFTER, os.kill, [os.getpid(), signal.SIGINT])
        again.daemon = True
        again.start()


if __name__ == "__main__":
    main()
