"""Versions, computer and plugins: what a bug report needs."""

from __future__ import annotations

import os
import platform
import re
import resource
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
        "kernel": platform.release(),
        "preempt_rt": "PREEMPT_RT" in platform.version(),
        "priority_limit": _limit(resource.RLIMIT_RTPRIO),
        "priority_wanted": REALTIME_PRIORITY,
        "locked_memory_limit_bytes": _limit(resource.RLIMIT_MEMLOCK),
    }
    verbs = {
        point.dist.name: point.dist.version
        for point in entry_points(group=ENTRY_POINTS)
        if point.dist
    }
    place = Path(stepload.__file__).parent
    out.line(f"stepload {stepload.__version__} in {place}")
    out.line(f"{platform.python_implementation()} {platform.python_version()}")
    out.line(f"{platform.platform()}, {real_time['cpus']} CPUs")
    memory, kernel = real_time["locked_memory_limit_bytes"], real_time["preempt_rt"]
    out.line(
        f"real-time priority up to {_shown(real_time['priority_limit'])} "
        f"({REALTIME_PRIORITY} wanted), kernel {'with' if kernel else 'without'} PREEMPT_RT"
    )
    out.line(f"locked memory up to {_shown(memory)} bytes")
    listed = ", ".join(f"{name} {found}" for name, found in (packages | verbs).items())
    out.line(wrapped(f"packages: {listed}", 2))
    rows = [
        (p.group.removeprefix("stepload."), p.name, p.distribution, p.version, p.problem or "ready")
        for p in plugins
    ]
    out.table("Drivers and worlds", ("kind", "name", "from", "version", "state"), rows)
    out.result({
        "stepload": stepload.__version__, "path": place, "python": platform.python_version(),
        "platform": platform.platform(), "real_time": real_time, "packages": packages,
        "verbs": verbs, "drivers": plugins,
    })  # fmt: skip


def _packages() -> dict[str, str]:
    """Versions of the packages that stepload is built on, as far as they are installed."""
    found = {}
    for need in requires("stepload") or ():
        extra = re.search(r"extra == ['\"](\w+)", need)
        if extra and extra[1] not in EXTRAS:
            continue
        name = re.split(r"[^\w.-]", need, maxsplit=1)[0]
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            if not extra:
                found[name] = "missing"
    return found


def _limit(which: int) -> int | None:
    """The limit of this process; None: unlimited."""
    soft = resource.getrlimit(which)[0]
    return None if soft == resource.RLIM_INFINITY else soft


def _shown(limit: object) -> str:
    return "unlimited" if limit is None else str(limit)
