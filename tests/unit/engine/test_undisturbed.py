"""The loop collects no garbage, and leaves the collector as it was."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest

from stepload.engine.undisturbed import undisturbed


@pytest.fixture(autouse=True)
def _frozen_afterwards() -> Iterator[None]:
    """The session has frozen what there was (conftest.py), and goes on so."""
    gc.unfreeze()
    yield
    gc.freeze()


def test_no_garbage_is_collected_inside() -> None:
    assert gc.isenabled()
    with undisturbed(virtual=True):
        assert not gc.isenabled()
        assert gc.get_freeze_count() > 0
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0


def test_what_was_disabled_stays_disabled() -> None:
    gc.disable()
    try:
        with undisturbed(virtual=True):
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_what_was_frozen_before_stays_frozen_and_nothing_is_added() -> None:
    gc.freeze()
    frozen = gc.get_freeze_count()
    with undisturbed(virtual=True):
        made = [[] for _ in range(1000)]
    assert len(made) == 1000
    assert 0 < gc.get_freeze_count() <= frozen
    assert any(made is found for found in gc.get_objects())


def test_it_is_left_as_it_was_after_an_error() -> None:
    with pytest.raises(KeyError), undisturbed(virtual=True):
        raise KeyError
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0
