"""A chosen name for a pseudo-terminal, whose own name is known only once it is open."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from stepload.errors import BadInputError


@contextmanager
def port_link(path: Path, address: str) -> Iterator[None]:
    """`path` leads to `address` inside `with`; a link left behind by a dead emulator is replaced.

    Raises:
        BadInputError: there is something at `path` already, or it cannot be made.
    """
    if not address.startswith("/dev/"):
        raise BadInputError(
            f"--link {path}: the emulator has no port but the address {address}",
            hint="leave --link out and use the address",
        )
    if path.is_symlink() and not path.exists():
        path.unlink()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.symlink_to(address)
    except FileExistsError as error:
        raise BadInputError(
            f"--link {path}: is there already",
            hint="end the emulator that uses it, or take another name",
        ) from error
    except OSError as error:
        raise BadInputError(f"--link {path}: {error}", hint="take another name") from error
    try:
        yield
    finally:
        if path.is_symlink() and str(path.readlink()) == address:
            path.unlink()
