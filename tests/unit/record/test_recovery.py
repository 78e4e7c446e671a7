"""Repair keeps all that is whole, as judged by the reference stream reader, and nothing else."""

from __future__ import annotations

import os
import struct
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

from stepload.errors import BadInputError
from stepload.record import recovery
from stepload.record.container import Appender
from stepload.record.reader import read_recording
from stepload.record.recovery import find_unfinished, recover


def streamed(path: Path) -> Counter[str]:
    """Messages per topic that the reference reader delivers before it fails."""
    topics: dict[int, str] = {}
    seen: Counter[str] = Counter()
    with path.open("rb") as file:
        try:
            for record in StreamReader(file, validate_crcs=True).records:
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                elif isinstance(record, Message):
                    seen[topics[record.channel_id]] += 1
        except (McapError, ValueError, OSError, AssertionError):
            pass
        except Exception as error:
            if "zstd" not in type(error).__module__ and "struct" not in type(error).__module__:
                raise
    return seen


def indexed(path: Path) -> Counter[str]:
    """Messages per topic that the reference reader finds through summary and indexes."""
    with path.open("rb") as file:
        return Counter(c.topic for _, c, _ in make_reader(file, validate_crcs=True).iter_messages())


def test_cut_at_every_kibibyte(write_record: Callable[..., Path], tmp_path: Path) -> None:
    whole = write_record(chunks=6).read_bytes()
    cut_file = tmp_path / "cut.mcap.part"
    found = []
    for size in [*range(1024, len(whole), 1024), len(whole) - 1]:
        cut_file.write_bytes(whole[:size])
        expected = streamed(cut_file)
        recovered = recover(cut_file)
        assert Counter(recovered.counts) == expected == indexed(recovered.path), size
        found.append(sum(expected.values()))
        recovered.path.unlink()
    assert found == sorted(found)
    assert found[-1] == sum(streamed(write_record(chunks=6)).values()) > found[0]


@pytest.mark.parametrize("tail", [b"\x00" * 5000, b"\xff" * 5000, b"\x05" * 7])
def test_a_filled_tail_is_cut(
    write_record: Callable[..., Path], tmp_path: Path, tail: bytes
) -> None:
    good = write_record(finished=False).read_bytes()
    path = tmp_path / "tail.mcap.part"
    path.write_bytes(good + tail)
    recovered = recover(path)
    assert recovered.cut_bytes == len(tail)
    assert recovered.counts["/force"] == 400
    got = read_recording(recovered.path)
    assert got.partial
    np.testing.assert_array_equal(got.force.sequence, np.arange(400))


def test_a_rotten_chunk_does_not_cost_the_ones_behind_it(write_record: Callable[..., Path]) -> None:
    path = write_record()
    data = bytearray(path.read_bytes())
    at = data.index(b"zstd", 3 * len(data) // 8) + 200
    data[at] ^= 0x10
    path.write_bytes(data)
    assert "byte" in read_recording(path).damage
    recovered = recover(path)
    assert recovered.path.name == "run.recovered.mcap"
    assert recovered.damage
    assert 200 < recovered.cut_bytes < len(data) / 4
    assert recovered.counts["/force"] == 350
    assert path.exists()
    assert sum(indexed(recovered.path).values()) == sum(recovered.counts.values())


def test_a_rotten_chunk_of_an_unfinished_record_is_all_that_is_cut(
    write_record: Callable[..., Path],
) -> None:
    path = write_record("run.mcap.part", finished=False)
    data = bytearray(path.read_bytes())
    name_at = data.index(b"zstd", len(data) // 2)
    opcode, length = struct.unpack_from("<BQ", data, name_at - 41)
    assert opcode == 6
    data[name_at + 200] ^= 0x10
    path.write_bytes(data)
    recovered = recover(path)
    assert recovered.cut_bytes == 9 + length
    assert recovered.counts["/force"] == 350


def test_a_whole_record_survives_repair_unchanged(write_record: Callable[..., Path]) -> None:
    path = write_record()
    recovered = recover(path)
    before, after = read_recording(path), read_recording(recovered.path)
    assert recovered.cut_bytes == 0
    assert not recovered.damage
    assert not before.partial
    assert after.partial
    np.testing.assert_array_equal(before.force.wrench, after.force.wrench)
    assert before.events == after.events
    assert before.results == after.results


def test_lost_indexes_are_made_again(
    write_record: Callable[..., Path], tmp_path: Path, check_indexes: Callable[[Path], None]
) -> None:
    data = write_record(finished=False).read_bytes()
    cut = tmp_path / "noindex.mcap.part"
    cut.write_bytes(data[: data.rindex(b"\x07")])
    recovered = recover(cut)
    assert indexed(recovered.path) == Counter(recovered.counts)
    check_indexes(recovered.path)


@pytest.mark.parametrize("kind", ["fifo", "hard link", "symbolic link", "left over"])
def test_what_stands_in_the_place_of_the_copy_is_not_written_through(
    write_record: Callable[..., Path], tmp_path: Path, kind: str
) -> None:
    part = write_record("run.mcap.part", chunks=2, finished=False)
    place, outside = tmp_path / "run.mcap.recovering", tmp_path / "outside"
    outside.write_bytes(b"mine")
    if kind == "fifo":
        os.mkfifo(place)
    elif kind == "hard link":
        place.hardlink_to(outside)
    elif kind == "symbolic link":
        place.symlink_to(outside)
    else:
        place.write_bytes(b"half of a copy")
    assert sum(recover(part).counts.values()) > 0
    assert outside.read_bytes() == b"mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["outside", "run.mcap"]


def test_unfinished_records_are_looked_for_here_and_not_behind_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs, elsewhere = tmp_path / "runs", tmp_path / "elsewhere"
    for directory in (runs / "a", runs / "b", elsewhere):
        directory.mkdir(parents=True)
        (directory / "run.mcap.part").write_bytes(b"")
    (runs / "l").symlink_to(elsewhere)
    (runs / "f").mkdir()
    os.mkfifo(runs / "f" / "run.mcap.part")

    plain = Path.open

    def locked(path: Path, mode: str) -> Any:
        if path.parent.name == "a":
            raise PermissionError(13, "Permission denied")
        return plain(path, mode)

    monkeypatch.setattr(Path, "open", locked)
    found = {path.parent.name for path in find_unfinished(runs)}
    assert found == {"a", "b"}


def test_a_damaged_attachment_is_left_out(write_record: Callable[..., Path]) -> None:
    path = write_record()
    path.write_bytes(path.read_bytes().replace(b'"k": 1.5', b'"k": 1.6'))
    damaged = read_recording(path)
    assert "checksum of an attachment" in damaged.damage
    assert damaged.results is None
    recovered = recover(path)
    assert "checksum of an attachment" in recovered.damage
    got = read_recording(recovered.path)
    assert set(got.attachments) == {"plan.yaml"}
    assert len(got.force.sequence) == 400


def test_a_copy_that_does_not_read_back_is_not_given_its_name(
    write_record: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    part = write_record("run.mcap.part", finished=False)
    monkeypatch.setattr(recovery, "count_messages", lambda path: {"/force": 399})
    with pytest.raises(BadInputError, match="read back"):
        recover(part)
    assert part.exists()
    assert not part.with_suffix("").exists()


@pytest.mark.parametrize("where", [0.3, 0.5, 0.7])
def test_a_byte_that_the_disk_changed_under_a_repair_is_seen(
    write_record: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, where: float
) -> None:
    part = write_record("run.mcap.part", finished=False, chunks=12)
    plain = Appender.finish

    def finish(out: Appender) -> None:
        at = round(where * out.good)
        plain(out)
        file = part.with_name("run.mcap.recovering")
        data = bytearray(file.read_bytes())
        data[at] ^= 1
        file.write_bytes(data)

    monkeypatch.setattr(Appender, "finish", finish)
    with pytest.raises(BadInputError):
        recover(part)
    assert part.exists()
    assert not part.with_suffix("").exists()


def test_the_copy_s_name_is_on_the_disk_when_a_repair_is_done(
    write_record: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    part = write_record("run.mcap.part", finished=False)
    synced = []
    monkeypatch.setattr(
        recovery,
        "sync_directory",
        lambda path: synced.append(sorted(p.name for p in path.iterdir())),
    )
    recover(part)
    assert synced == [["run.mcap"]]
