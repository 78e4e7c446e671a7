"""A driver of one's own as a project: package, emulator and contract test, from templates."""

from __future__ import annotations

import keyword
import re
import sys
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from string import Template

from stepload.errors import BadInputError

KINDS = {
    "arm": {"group": "stepload.arms", "proof": "--move '2 mm'"},
    "force": {"group": "stepload.force_sensors", "proof": "--load '9.81 N' --load-axis=+fz"},
}
"""Entry-point group of each kind of device, and what proves more on the device itself."""
FILES = {
    "pyproject.toml": "pyproject.toml",
    "README.md": "README.md",
    "{name}/__init__.py": "",
    "{name}/driver.py": "{kind}.py",
    "{name}/emulator.py": "{kind}_emulator.py",
    "tests/test_contract.py": "{kind}_test.py",
}
"""The files of a project, and the template of each; "": it is empty."""


def write_project(name: str, kind: str, directory: Path) -> list[Path]:
    """The files of the new project, which are written into `directory`, a new one.

    Args:
        kind: one of `KINDS`.

    Raises:
        BadInputError: the name is none that a package may have or is taken, or the directory
            exists or cannot be made.
    """
    if directory.exists() or directory.is_symlink():
        raise BadInputError(f"{directory} exists", hint="name a new directory with --out")
    if not re.fullmatch(r"[a-z][a-z0-9_]{1,23}", name) or name.endswith("_"):
        raise BadInputError(
            f"{name!r} is no name of a driver",
            hint="2 to 24 small letters, digits and _, a letter first, such as acme_cell",
        )
    if keyword.iskeyword(name) or name in sys.stdlib_module_names or find_spec(name):
        raise BadInputError(
            f"{name!r} is the name of a Python module already",
            hint=f"take another, such as lab_{name}",
        )
    words = {
        "name": name, "key": kind, "dashed": name.replace("_", "-"),
        "Class": "".join(part.capitalize() for part in name.split("_")), **KINDS[kind],
    }  # fmt: skip
    texts = resources.files("stepload.setup") / "templates"
    written = []
    for path, source in FILES.items():
        file = directory / path.format(name=name)
        file.parent.mkdir(parents=True, exist_ok=True)
        text = (texts / f"{source.format(kind=kind)}.txt").read_text("utf-8") if source else ""
        file.write_text(Template(text).substitute(words), "utf-8")
        written.append(file)
    return written
