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


def test_what_was_disabled_stays_disabled() -> None:
    gc.disable()
    try:
        with realtime_conditions(virtual=True):
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_what_was_frozen_before_stays_frozen_and_nothing_is_added() -> None:
    frozen = gc.get_freeze_count()
    with realtime_conditions(virtual=True):
        made = [[] for _ in range(1000)]
    assert len(made) == 1000
    assert 0 < gc.get_freeze_count() <= frozen  # the session's (conftest.py)
    assert any(made is found for found in gc.get_objects())


def test_it_is_left_as_it_was_after_an_error() -> None:
    with pytest.raises(KeyError), realtime_conditions(virtual=True):
        raise KeyError
    assert gc.isenabled()
