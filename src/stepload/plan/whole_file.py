"""Files that are there whole, old or new, whatever happens and whoever writes at the same time."""

from __future__ import annotations

import errno
import fcntl
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path


def replace_file(path: Path, data: bytes) -> None:
    """Write `data` to `path` through a temporary file in the same directory; the mode is kept.

    What a link of that name points to is replaced, not the link.

    Raises:
        OSError: it could not be written, or is read-only; what was there before still is.
    """
    path = path.resolve()
    with suppress(FileNotFoundError):
        if not path.stat().st_mode & 0o222:
            raise PermissionError(errno.EACCES, "it is read-only", str(path))
    write_whole(path, data)


def write_whole(path: Path, data: bytes) -> None:
    """As `replace_file`; a link of that name is itself replaced, and so is a read-only file.

    Raises:
        OSError: it could not be written; what was there before still is.
    """
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o666)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        with suppress(FileNotFoundError):
            shutil.copymode(path, part)
        os.replace(part, path)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise
    with suppress(OSError):  # a file system that cannot
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


@contextmanager
def alone_in(*folders: Path) -> Iterator[None]:
    """Lock these folders; others who want to lock one of them wait meanwhile."""
    with ExitStack() as stack:
        for folder in sorted({each.resolve() for each in folders}):
            with suppress(OSError):  # a file system without locks
                descriptor = os.open(folder, os.O_RDONLY)
                stack.callback(os.close, descriptor)
                fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
