"""Versions, computer and plugins: what a bug report needs."""

from __future__ import annotations

import platform
import re
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, entry_points, requires, version
from pathlib import Path

import stepload
from stepload.cli.verbs import ENTRY_POINTS
from stepload.report.terminal import Output, wrapped
from stepload.rig.plugins import list_drivers


def show_version(out: Output) -> None:
    """Show it; nothing of it names a person or a computer."""
    plugins, points = list_drivers(), entry_points(group=ENTRY_POINTS)
    packages = {point.dist.name: point.dist.version for point in points if point.dist}
    for need in requires("stepload") or ():
        name = re.split(r"[^\w.-]", need, maxsplit=1)[0]
        with suppress(PackageNotFoundError):
            packages[name] = version(name)
    about = {
        "stepload": stepload.__version__, "path": Path(stepload.__file__).parent,
        "python": platform.python_version(), "platform": platform.platform(),
    }  # fmt: skip
    out.line("\n".join(f"{key} {value}" for key, value in about.items()))
    told = ", ".join(f"{name} {of}" for name, of in sorted(packages.items()))
    out.line(wrapped(f"packages: {told}", 2))
    rows = [
        (p.group.removeprefix("stepload."), p.name, p.distribution, p.version, p.problem or "ready")
        for p in plugins
    ]
    out.table("Drivers and worlds", ("kind", "name", "from", "version", "state"), rows)
    out.result({**about, "packages": packages, "drivers": plugins})
