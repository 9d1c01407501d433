"""`python -m inputdesign_cli` is the same command as `idesign`."""

from inputdesign_cli.cli import main

if __name__ == "__main__":
    main()
