"""Is this computer fit to run: disk, scheduling, late ticks."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence

import numpy as np

from stepload.engine.realtime import REALTIME_PRIORITY
from stepload.plan.model import Plan
from stepload.setup.check_line import CheckLine, Mark, graded

ROW_BYTES = 120
"""Upper bound of a sample or a tick in the record."""
LONG_RUN_S = 600.0
LATE_SHARE_WARN, LATE_SHARE_FAIL = 0.01, 0.05


def bytes_per_s(plan: Plan) -> float:
    """Upper bound of what a run of this plan writes."""
    samples_per_s = sum(spec.rate_hz for spec in plan.rig.devices.values())
    return ROW_BYTES * (samples_per_s + plan.rig.arm.rate_hz)


def check_disk(plan: Plan) -> CheckLine:
    """Do some runs of this plan fit onto the disk of its records?"""
    directory = plan.record.directory
    existing = next(path for path in (directory, *directory.absolute().parents) if path.is_dir())
    free = shutil.disk_usage(existing).free
    room = free / (bytes_per_s(plan) * LONG_RUN_S)
    return CheckLine(
        "disk space", Mark.OK if room > 10.0 else Mark.WARN if room > 2.0 else Mark.FAIL, room,
        10.0, "", f"runs of {LONG_RUN_S / 60.0:.0f} minutes fit into {free / 1e9:.1f} GB",
        "make room, or name another record.directory",
    )  # fmt: skip


def check_priority() -> CheckLine:
    """May the loop have real-time priority?"""
    former = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(REALTIME_PRIORITY))
        os.sched_setscheduler(0, *former)
    except OSError:
        return CheckLine(
            "real-time priority", Mark.WARN, 0.0, float(REALTIME_PRIORITY), "",
            "not permitted: other programs may hold the loop up",
            f"allow it: a line `USER - rtprio {REALTIME_PRIORITY}` in /etc/security/limits.conf",
        )  # fmt: skip
    return CheckLine(
        "real-time priority", Mark.OK, float(REALTIME_PRIORITY), float(REALTIME_PRIORITY), "",
        "permitted, and used while a run lasts",
    )  # fmt: skip


def check_lateness(late_s: Sequence[float], period_s: float) -> Iterator[CheckLine]:
    """How late ticks begin, with the rig open and its data flowing."""
    late = np.array(late_s)
    share = float(np.mean(late > period_s))
    p50, p99 = np.percentile(late, (50.0, 99.0)).tolist()
    yield graded(
        "ticks late by a period", share, "%", warn=LATE_SHARE_WARN, fail=LATE_SHARE_FAIL,
        message=f"of {len(late)} ticks of {period_s * 1e3:g} ms; half begin within "
        f"{p50 * 1e6:.0f} µs, 99 % within {p99 * 1e6:.0f} µs, the last after "
        f"{late.max() * 1e3:.1f} ms",
        remedy="close other programs; give the loop real-time priority; take a faster computer",
    )  # fmt: skip
