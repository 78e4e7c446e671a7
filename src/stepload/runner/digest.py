"""Digest of the source files that determine a result, for comparison between machines and days."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable
from functools import cache
from pathlib import Path


def code_digest(rooms: Iterable[Path], without: Collection[Path] = ()) -> str:
    """SHA-256 over the Python files of these directories and their names.

    Args:
        rooms: directories, searched recursively.
        without: files of them that are left out.
    """
    digest = hashlib.sha256()
    for room in rooms:
        for file in sorted(set(room.rglob("*.py")) - set(without)):
            digest.update(file.relative_to(room.parent).as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


@cache
def product_digest(*names: str) -> str:
    """The digest of these packages of stepload."""
    product = Path(__file__).parents[1]
    return code_digest(product / name for name in names)
