"""The loop collects no garbage, and leaves the collector as it was."""

from __future__ import annotations

import gc
import weakref

import pytest

from stepload.engine.realtime import realtime_conditions


def test_no_garbage_is_collected_inside() -> None:
    assert gc.isenabled()
    with realtime_conditions(virtual=True):
        assert not gc.isenabled()
    assert gc.isenabled()


def test_garbage_of_before_is_gone_inside() -> None:
    class Ring:
        def __init__(self) -> None:
            self.own = self

    gone = weakref.ref(Ring())
    with realtime_conditions(virtual=False):
        assert gone() is None


def test_it_is_left_as_it_was_after_an_error() -> None:
    with pytest.raises(KeyError), realtime_conditions(virtual=True):
        raise KeyError
    assert gc.isenabled()
