"""What a run shows of itself never holds it up: not where the terminal is held, nor gone."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import pytest

from stepload.cli.progress import Phases, Seen, pen
from stepload.record.rows import Phase


def seen(share: float) -> Seen:
    return Seen(0.0, share, "", "")


def test_a_held_terminal_holds_up_nobody_and_loses_no_line() -> None:
    held, shown = threading.Event(), []

    def show(item: Seen | str) -> None:
        assert held.wait(30.0)
        shown.append(item)

    with pen(show) as hand_over:
        hand_over("first")
        for share in (0.1, 0.2):
            hand_over(seen(share))
        hand_over("second")
        hand_over(seen(0.3))
        assert not shown  # and this line is reached
        held.set()
    assert [item for item in shown if isinstance(item, str)] == ["first", "second"]


@pytest.mark.parametrize("error", [BrokenPipeError, ValueError])
def test_a_terminal_that_is_gone_ends_the_showing_alone(error: type[Exception]) -> None:
    tried = []

    def show(item: Seen | str) -> None:
        tried.append(item)
        raise error("closed")

    with pen(show) as hand_over:
        hand_over("first")
        hand_over("second")
    assert tried == ["first"]


def test_of_looks_that_wait_the_newest_is_shown() -> None:
    began, held, shown = threading.Event(), threading.Event(), []

    def show(item: Seen | str) -> None:
        began.set()
        assert held.wait(30.0)
        shown.append(item)

    with pen(show) as hand_over:
        hand_over("line")
        assert began.wait(30.0)
        for share in (0.1, 0.2, 0.3):
            hand_over(seen(share))
        hand_over("end")
        held.set()
    assert shown == ["line", "end"]


def test_each_phase_is_one_line_when_it_is_over() -> None:
    phases = Phases()
    course: list[tuple[Phase, int, float]] = [
        (Phase.WARM_UP, 1, 0.0), (Phase.TARE, 1, 0.0), (Phase.FAST_APPROACH, 1, 0.0),
        (Phase.DWELL, 1, 4.0), (Phase.GUARDED_APPROACH, 1, 0.0), (Phase.LOAD, 1, 50.0),
        (Phase.HOLD, 1, 100.0), (Phase.UNLOAD, 1, 50.0), (Phase.RETRACT, 1, 0.0),
        (Phase.POST_TARE, 1, 0.0), (Phase.FAST_APPROACH, 2, 0.0), (Phase.LOAD, 2, 80.0),
        (Phase.RETRACT, 2, 0.0), (Phase.POST_TARE, 2, 0.0), (Phase.FAST_APPROACH, 2, 0.0),
        (Phase.RETRACT, 2, 0.0), (Phase.DONE, 2, 0.0),
    ]  # fmt: skip
    lines = []
    for second, (phase, cycle, force_n) in enumerate(course):
        row: Any = SimpleNamespace(phase=int(phase), cycle=cycle, force_n=force_n)
        if line := phases.over(row, 30.0 * second):
            lines.append(line.split())
    assert lines == [
        ["tare,", "free", "air", "1:00"], ["touch", "2:30"], ["cycle", "1", "4:00", "100.0", "N"],
        ["retract,", "tare", "5:00"], ["touch", "5:30"], ["cycle", "2", "6:00", "80.0", "N"],
        ["retract,", "tare", "8:00"],
    ]  # fmt: skip
