"""Tests that must run in real time, on a host that may stall.

`@pytest.mark.realtime(tolerates_s=0.02)` says that a test runs against the wall clock and what
stall of the host it cannot survive. Such a test that fails is run again if, and only if, the meter
saw a longer stall while it ran, at most `RERUNS` times. Then it is reported as inconclusive, with
the stalls' lengths, and counted in the last line; it neither passes nor fails the session. A test
without the mark is never run again, and a failure without a measured stall is a failure.
While such a test runs, garbage is not collected, as in the loop of a run: among thousands of tests
one collection takes up to half a second, which is this process's own work and no stall of the host.
With `-p no:realtime` every failure is one.
Tests that survive a stall of `PATIENT_S` get the mark `patient`: they run beside each other. The
others compute next to nothing, and run beside each other after those.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from _pytest.runner import runtestprotocol
from stall_meter import StallMeter, longest_s

RERUNS = 3
PATIENT_S = 0.02
"""One real-time test beside another stalls it for less than that."""
STALLED = "stalled for"
"""A report's property: "rerun" or "inconclusive", then the longest stall of each attempt in s."""

_METER = pytest.StashKey[StallMeter]()


def meter_of(config: pytest.Config) -> StallMeter:
    """The session's meter, started when it is first asked for."""
    if _METER not in config.stash:
        config.stash[_METER] = StallMeter()
    return config.stash[_METER]


def pytest_configure(config: pytest.Config) -> None:
    told = f"real time that survives {PATIENT_S * 1e3:g} ms, beside another such test"
    config.addinivalue_line("markers", f"patient: {told}")


def pytest_unconfigure(config: pytest.Config) -> None:
    if _METER in config.stash:
        config.stash[_METER].close()


def tolerated_s(item: pytest.Item) -> float | None:
    """The stall that a test survives, in s; None where it does not run in real time."""
    marker = item.get_closest_marker("realtime")
    return None if marker is None else float(marker.kwargs["tolerates_s"])


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if (tolerated_s(item) or 0.0) >= PATIENT_S:
            item.add_marker("patient")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """Run a real-time test until it passes, fails without a stall, or was stalled too often."""
    survives_s = tolerated_s(item)
    if survives_s is None:
        return None
    meter = meter_of(item.config)
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    stalled_s: list[float] = []
    while True:
        began_s = time.monotonic()
        with _no_garbage_collection():
            reports = runtestprotocol(item, log=False, nextitem=nextitem)
        worst_s = longest_s(meter.between(began_s, time.monotonic()))
        failed = [report for report in reports if report.failed]
        if not failed or worst_s <= survives_s:
            break
        stalled_s.append(worst_s)
        again = len(stalled_s) <= RERUNS
        reports = [_excused(failed[0], "rerun" if again else "inconclusive", stalled_s)]
        if not again:
            break
        item.ihook.pytest_runtest_logreport(report=reports[0])
        item.user_properties.clear()
    for report in reports:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


@contextmanager
def _no_garbage_collection() -> Iterator[None]:
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _excused(report: pytest.TestReport, mark: str, stalled_s: list[float]) -> pytest.TestReport:
    """The failed report, so that it does not fail the session, with the stalls that explain it."""
    report.outcome = "skipped"
    report.user_properties.append((STALLED, [mark, *stalled_s]))
    return report


def _stalled(report: Any) -> list[Any] | None:
    """What `_excused` wrote into a report."""
    return dict(getattr(report, "user_properties", ())).get(STALLED)


@pytest.hookimpl(tryfirst=True)
def pytest_report_teststatus(report: pytest.TestReport) -> tuple[str, str, str] | None:
    if (told := _stalled(report)) is None:
        return None
    mark = str(told[0])
    return mark, mark[0].upper(), mark.upper()


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """One line for each failed attempt that a stall explains."""
    lines = list(_lines(terminalreporter.stats))
    if lines:
        terminalreporter.section("stalls of the host")
    for line in lines:
        terminalreporter.write_line(line)


def _lines(stats: dict[str, list[Any]]) -> Iterator[str]:
    for mark in ("rerun", "inconclusive"):
        for report in stats.get(mark, ()):
            lengths = ", ".join(f"{length_s * 1e3:.0f} ms" for length_s in _stalled(report)[1:])
            crash = getattr(report.longrepr, "reprcrash", None)
            why = str(crash.message if crash else report.longrepr).strip().partition("\n")[0]
            yield f"{mark}: {report.nodeid}: the host stalled for {lengths}; {why}"
