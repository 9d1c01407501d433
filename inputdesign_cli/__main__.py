"""`python -m inputdesign_cli` and `idesign`: an interrupt while modules are imported is orderly too."""

import sys

INTERRUPTED = 130  # as in `errors`, which may not have been imported yet


def main() -> None:
    """The `idesign` command."""
    try:
        from inputdesign_cli.cli import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
