"""Read files only if they are plain files: a pipe or a device may never end."""

from __future__ import annotations

import errno
import os
import stat


def read_regular(path: str | os.PathLike[str], most: int = -1) -> bytes:
    """Return the bytes of a plain file, at most `most`; refuse a pipe or a device without waiting for it.

    Raises:
        OSError: it cannot be read; `IsADirectoryError` for a folder, and with errno EINVAL for a pipe, a
            socket or a device.
        ValueError: the path holds characters that the operating system cannot name.
    """
    with open(path, "rb", opener=_without_waiting) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(errno.EINVAL, "it is a pipe or a device, not a file", os.fspath(path))
        return file.read(most)


def _without_waiting(name: str, flags: int) -> int:
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))  # no pipes among files on Windows
