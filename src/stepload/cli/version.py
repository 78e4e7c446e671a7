"""Versions, computer and plugins: what a bug report needs."""

from __future__ import annotations

import os
import platform
import re
import resource
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, entry_points, requires, version
from pathlib import Path

import stepload
from stepload.cli.verbs import ENTRY_POINTS
from stepload.engine.realtime import REALTIME_PRIORITY
from stepload.report.terminal import Output, wrapped
from stepload.rig.plugins import list_drivers

EXTRAS = ("live", "data", "ui", "fem")
"""Extras whose packages stepload uses where they are installed."""


def show_version(out: Output) -> None:
    """Show it; nothing of it names a person or a computer."""
    packages, plugins = _packages(), list_drivers()
    real_time = {
        "cpus": len(os.sched_getaffinity(0)),
        "preempt_rt": "PREEMPT_RT" in platform.version(),
        "priority_limit": resource.getrlimit(resource.RLIMIT_RTPRIO)[0],
        "priority_wanted": REALTIME_PRIORITY,
        "locked_memory_limit_bytes": resource.getrlimit(resource.RLIMIT_MEMLOCK)[0],
    }
    place, python = Path(stepload.__file__).parent, platform.python_version()
    out.line(f"stepload {stepload.__version__} in {place}")
    out.line(f"{platform.python_implementation()} {python}, {platform.platform()}")
    told = ", ".join(f"{k.replace('_', ' ')} {v}" for k, v in real_time.items())
    out.line(wrapped(f"real time (-1: no limit): {told}", 2))
    out.line(wrapped("packages: " + ", ".join(f"{k} {v}" for k, v in packages.items()), 2))
    rows = [
        (p.group.removeprefix("stepload."), p.name, p.distribution, p.version, p.problem or "ready")
        for p in plugins
    ]
    out.table("Drivers and worlds", ("kind", "name", "from", "version", "state"), rows)
    out.result({
        "stepload": stepload.__version__, "path": place, "python": python,
        "platform": platform.platform(), "real_time": real_time, "packages": packages,
        "drivers": plugins,
    })  # fmt: skip


def _packages() -> dict[str, str]:
    """Versions of what stepload is built on, where installed, and of packages that give verbs."""
    found = {}
    for need in requires("stepload") or ():
        extra = re.search(r"extra == ['\"](\w+)", need)
        if extra is None or extra[1] in EXTRAS:
            name = re.split(r"[^\w.-]", need, maxsplit=1)[0]
            with suppress(PackageNotFoundError):
                found[name] = version(name)
    points = [point.dist for point in entry_points(group=ENTRY_POINTS)]
    return found | {package.name: package.version for package in points if package}
