"""Whether something can be written, found out before the work whose result it is to hold."""

from __future__ import annotations

import tempfile
from pathlib import Path

from stepload.errors import BadInputError


def check_new(option: str, path: Path) -> None:
    """Refuse to overwrite a file that exists.

    Args:
        option: of the command line, for the message.
        path: a file that is to be made.

    Raises:
        BadInputError: it is there, or its directory is not.
    """
    if path.is_symlink() or path.exists():
        raise BadInputError(f"{path} is there already", hint=f"name another file with {option}")
    if not path.absolute().parent.is_dir():
        raise BadInputError(f"{path}: there is no such directory", hint="make it first")


def check_room(option: str, path: Path) -> None:
    """Try to write a nameless file into the nearest directory of `path` that exists.

    Args:
        option: of the command line, for the message.
        path: a file or directory that is to be made.

    Raises:
        BadInputError: nothing can be written there.
    """
    place = path.absolute()
    while not place.is_dir():
        if place.exists():
            raise BadInputError(f"{option} {path}: {place} is a file", hint="name another place")
        place = place.parent
    try:
        with tempfile.TemporaryFile(dir=place):
            pass
    except OSError as error:
        raise BadInputError(
            f"{option} {path}: cannot write to {place}: {error.strerror}",
            hint="name a place where files may be made",
        ) from error
