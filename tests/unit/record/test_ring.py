"""Rings: no row lost, torn or overwritten in silence."""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stepload.record.ring import RINGS, Shared, capacities
from stepload.rig.samples import DisplacementSample

RATES_HZ = {"force": 60.0, "arm": 60.0, "displacement": 60.0, "tick": 60.0}


def never(_: Callable[[], bool]) -> bool:
    return False


@pytest.fixture
def shared() -> Iterator[Shared]:
    shared, fd = Shared.create(capacities(RATES_HZ))
    os.close(fd)
    yield shared
    shared.close()


def took(shared: Shared, name: str) -> Any:
    """What waits in a ring; its places are free then."""
    found = shared.take_events() if name == "events" else shared.take(name)
    shared.add_recorded(name, len(found))
    return found


def gauge(i: int) -> DisplacementSample:
    return DisplacementSample(i, float(i), 2.0 * i, 1, 3.0 * i)


def flat(row: Any) -> list[float]:
    return [x for field in row for x in (field if isinstance(field, tuple) else (field,))]


def words(rows: np.ndarray) -> list[list[float]]:
    return [flat(tuple(tuple(x) if np.ndim(x) else x for x in row)) for row in rows.tolist()]


@pytest.mark.parametrize("name", ["force", "arm", "displacement", "tick"])
def test_rows_pass_in_order_also_across_the_ring_s_end(
    shared: Shared, make: SimpleNamespace, name: str
) -> None:
    sample = {**vars(make), "displacement": gauge}[name]
    push, capacity = shared.producer(name, never), shared.capacity[name]
    sent, got = 0, []
    for size in (capacity, 700, 700, 1, capacity):
        for i in range(sent, sent + size):
            push(sample(i))
        sent += size
        got += words(took(shared, name))
    assert len(took(shared, name)) == shared.dropped(name) == 0
    np.testing.assert_array_equal(got, [flat(sample(i)) for i in range(sent)])


def test_a_full_ring_keeps_the_old_rows_and_counts_the_new(
    shared: Shared, make: SimpleNamespace
) -> None:
    push, capacity = shared.producer("force", never), shared.capacity["force"]
    for i in range(capacity + 3):
        push(make.force(i))
    assert shared.dropped("force") == 3
    assert took(shared, "force")["sequence"].tolist() == list(range(capacity))
    push(make.force(9))
    assert took(shared, "force")["sequence"].tolist() == [9]
    assert shared.dropped("force") == 3


def test_a_full_ring_waits_where_it_may(shared: Shared, make: SimpleNamespace) -> None:
    taken: list[int] = []

    def wait(has_room: Callable[[], bool]) -> bool:
        assert not has_room()
        taken.extend(took(shared, "force")["sequence"].tolist())
        return has_room()

    push, capacity = shared.producer("force", wait), shared.capacity["force"]
    for i in range(3 * capacity):
        push(make.force(i))
    taken.extend(took(shared, "force")["sequence"].tolist())
    assert taken == list(range(3 * capacity))
    assert shared.dropped("force") == 0


@pytest.mark.parametrize("name", ["force", "arm", "displacement", "tick"])
def test_a_row_that_cannot_be_packed_is_not_published(
    shared: Shared, make: SimpleNamespace, name: str
) -> None:
    push, sample = shared.producer(name, never), {**vars(make), "displacement": gauge}[name]
    push(sample(1))
    with pytest.raises(struct.error):
        push(("text", *sample(2)[1:]))
    assert len(took(shared, name)) == 1
    push(sample(3))
    assert len(took(shared, name)) == 1


def test_rows_count_as_waiting_until_they_are_on_the_disk(
    shared: Shared, make: SimpleNamespace
) -> None:
    push = shared.producer("force", never)
    for i in range(5):
        push(make.force(i))
    shared.take("force")
    assert shared.waiting("force") == 5
    shared.add_recorded("force", 2)
    shared.add_recorded("force", 1)
    assert shared.waiting("force") == 2
    assert shared.recorded("force") == 3
    assert [shared.recorded(name) for name in RINGS if name != "force"] == [0] * 5


def test_texts_pass_in_order_also_across_the_ring_s_end(shared: Shared) -> None:
    push = shared.event_producer(never)
    texts = [bytes([65 + i]) * (300_000 + i) for i in range(9)]
    got = []
    for i, text in enumerate(texts):
        push(float(i), text)
        if i % 3 == 2:
            got += took(shared, "events")
    assert got == [(float(i), text) for i, text in enumerate(texts)]
    assert took(shared, "events") == []
