"""Use of the hot modules as machine code, if the checkout has them for its present source.

`compile_hot.py` puts them beside the checkout's `src`, with a list of every source file that they
were made from. If one of those has changed since, if a compiled file is missing or not whole, or if
STEPLOAD_PURE is set, the Python source runs instead: slower, with the same results to the last bit.
"""

from __future__ import annotations

import json
import os
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, ModuleSpec
from importlib.util import spec_from_file_location
from pathlib import Path
from typing import Any

PURE = "STEPLOAD_PURE"
"""The environment's variable that leaves the compiled modules out."""

PLACE = Path(".compiled") / EXTENSION_SUFFIXES[0].strip(".").removesuffix(".so")
"""Directory below the checkout; its name states interpreter and machine."""

LIST = "sources.json"


def stamp_of(path: str) -> list[int]:
    """Size and modification time of a file, which change when it is written, as for `.pyc`."""
    told = os.stat(path)
    return [told.st_size, told.st_mtime_ns]


class _Finder(MetaPathFinder):
    """Import finder for the named modules at their places."""

    def __init__(self, files: dict[str, str]) -> None:
        self.files = files

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        file = self.files.get(name)
        if file is None:
            return None
        return spec_from_file_location(name, file, loader=ExtensionFileLoader(name, file))


def use(root: Path) -> int:
    """Let the compiled modules of this checkout be imported, all of them or none.

    Returns:
        How many there are; 0 where Python's source is used.
    """
    if os.environ.get(PURE):
        return 0
    place = root / PLACE
    try:
        with open(place / LIST, encoding="utf-8") as file:
            listed = json.load(file)
        for path, stamp in listed["sources"].items():
            if stamp_of(f"{root}/{path}") != stamp:
                return 0
        for path, size in listed["sizes"].items():  # one cut short ends Python with a bus error
            if os.stat(f"{place}/{path}").st_size != size:
                return 0
        modules = {name: f"{place}/{path}" for name, path in listed["modules"].items()}
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return 0
    sys.meta_path.insert(0, _Finder(modules))
    return len(modules)
