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

_FORCE = {
    "group": "stepload.force_sensors", "key": "force", "Sensor": "ForceSensor",
    "Sample": "ForceSample", "unit": "N", "u": "n", "shown": "N", "factor": "1.0",
    "range": "1000.0", "field": "wrench", "frozen": "1.0",
    "row": "wrench = (0.0, 0.0, value, 0.0, 0.0, 0.0)\n"
    "        return ForceSample(self._sequence, math.nan, time_s, status, wrench, math.nan)",
    "load": "10.0", "load_shown": "LOAD", "axis": "+fz", "noise": "0.01", "step": "0.001",
    "proof": "--load '9.81 N' --load-axis=+fz",
}  # fmt: skip
_DISPLACEMENT = _FORCE | {
    "group": "stepload.displacement_sensors", "key": "displacement",
    "Sensor": "DisplacementSensor", "Sample": "DisplacementSample", "unit": "m", "u": "m",
    "shown": "mm", "factor": "1e-3", "range": "25e-3", "field": "displacement_m",
    "frozen": "math.inf",
    "row": "return DisplacementSample(self._sequence, math.nan, time_s, status, value)",
    "load": "1e-3", "load_shown": "1e3 * LOAD",
    "axis": "", "noise": "1e-5", "step": "1e-6", "proof": "--load '1 mm'",
}  # fmt: skip
KINDS = {
    "arm": {"group": "stepload.arms", "key": "arm", "proof": "--move '2 mm'"},
    "force": _FORCE,
    "displacement": _DISPLACEMENT,
}
"""What the templates of each kind of device fill in."""
FILES = {
    "pyproject.toml": "pyproject.toml",
    "README.md": "README.md",
    "{name}/__init__.py": "",
    "{name}/driver.py": "{template}.py",
    "{name}/emulator.py": "{template}_emulator.py",
    "tests/test_contract.py": "{template}_test.py",
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
    _check(name)
    words = {
        "name": name,
        "dashed": name.replace("_", "-"),
        "Class": "".join(part.capitalize() for part in name.split("_")),
        **KINDS[kind],
    }
    template = "arm" if kind == "arm" else "sensor"
    texts = resources.files("stepload.setup") / "templates"
    written = []
    for path, source in FILES.items():
        file = directory / path.format(name=name)
        file.parent.mkdir(parents=True, exist_ok=True)
        text = (
            (texts / f"{source.format(template=template)}.txt").read_text("utf-8") if source else ""
        )
        file.write_text(Template(text).substitute(words), "utf-8")
        written.append(file)
    return written


def _check(name: str) -> None:
    if not re.fullmatch(r"[a-z][a-z0-9_]{1,23}", name) or name.endswith("_"):
        raise BadInputError(
            f"{name!r} is no name of a driver",
            hint="2 to 24 small letters, digits and _, a letter first, such as acme_cell",
        )
    taken = keyword.iskeyword(name) or name in sys.stdlib_module_names or find_spec(name)
    if taken:
        raise BadInputError(
            f"{name!r} is the name of a Python module already",
            hint=f"take another, such as lab_{name}",
        )
