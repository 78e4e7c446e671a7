"""What a run shows of itself never holds it up: not where the terminal is held, nor gone."""

from __future__ import annotations

import threading

import pytest

from stepload.cli.progress import Seen, pen


def seen(share: float) -> Seen:
    return Seen(0.0, 0.0, share, "", "")


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
