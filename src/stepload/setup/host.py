"""Is this computer fit to run: disk, scheduling, wall clock."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from stepload.engine.realtime import REALTIME_PRIORITY
from stepload.plan.model import Plan
from stepload.setup.check_line import CheckLine, Mark, graded, without_number

BLOCK_BYTES = 1 << 18
BLOCKS = 24
ROW_BYTES = 120
"""Upper bound of a sample or a tick in the record."""
SLOW_SYNC_S = 0.5
LONG_RUN_S = 600.0
WALL_STEP_S = 5e-3
LATE_SHARE_WARN, LATE_SHARE_FAIL = 0.01, 0.05


def bytes_per_s(plan: Plan) -> float:
    """Upper bound of what a run of this plan writes."""
    rig = plan.rig
    rows_per_s = rig.force.rate_hz + 2.0 * rig.arm.rate_hz
    if rig.displacement is not None:
        rows_per_s += rig.displacement.rate_hz
    if rig.second_force.sensor is not None:
        rows_per_s += rig.second_force.sensor.rate_hz
    return ROW_BYTES * rows_per_s


def check_disk(plan: Plan) -> Iterator[CheckLine]:
    """Can the record be written and synced as fast as it comes, and does it fit?"""
    directory = plan.record.directory
    existing = next(path for path in (directory, *directory.absolute().parents) if path.is_dir())
    needed = bytes_per_s(plan)
    try:
        times_s = _sync_times_s(existing)
    except OSError as error:
        yield without_number("disk", Mark.FAIL, f"{existing} cannot be written: {error.strerror}",
                             "name another record.directory")  # fmt: skip
        return
    speed = BLOCK_BYTES / float(np.mean(times_s))
    yield CheckLine(
        "disk speed", Mark.OK if speed > 10.0 * needed else Mark.WARN if speed > 2.0 * needed
        else Mark.FAIL, speed / needed, 10.0, "",
        f"times the {needed / 1e6:.2f} MB/s that a run writes at most: {speed / 1e6:.1f} MB/s "
        f"written and synced in {existing}",
        "name a record.directory on a faster disk",
    )  # fmt: skip
    yield graded(
        "disk sync", max(times_s), "s", warn=SLOW_SYNC_S, fail=8.0 * SLOW_SYNC_S,
        message=f"longest fdatasync of {BLOCK_BYTES >> 10} kB; what a power cut may cost grows "
        "with it",
        remedy="a local disk rather than a network drive",
    )  # fmt: skip
    free = shutil.disk_usage(existing).free
    room = free / (needed * LONG_RUN_S)
    yield CheckLine(
        "disk space", Mark.OK if room > 10.0 else Mark.WARN if room > 2.0 else Mark.FAIL, room,
        10.0, "", f"runs of {LONG_RUN_S / 60.0:.0f} minutes fit into {free / 1e9:.1f} GB",
        "make room, or name another record.directory",
    )  # fmt: skip


def _sync_times_s(directory: Path) -> list[float]:
    block = os.urandom(BLOCK_BYTES)
    times_s = []
    with tempfile.TemporaryFile(dir=directory) as file:
        for _ in range(BLOCKS):
            started_s = time.perf_counter()
            file.write(block)
            file.flush()
            os.fdatasync(file.fileno())
            times_s.append(time.perf_counter() - started_s)
    return times_s


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


def check_wall_clock(step_s: float) -> CheckLine:
    """Did the wall clock step meanwhile? Records do not use it, but file names do."""
    return graded(
        "wall clock", abs(step_s), "s", warn=WALL_STEP_S, fail=float("inf"),
        message="moved against the monotonic clock while watching; runs are timed by the latter",
        remedy="let chrony or ntpd slew instead of step",
    )  # fmt: skip
