"""Rows as lines and as Parquet: whole or not there, and nobody writes between."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import pytest

from stepload.errors import BadInputError, RefusedError
from stepload.jobs.store import Store


@dataclass(frozen=True)
class Kept:
    series: str
    index: int
    good: bool
    peak_n: float | None
    wrong: tuple[str, ...]

    def to_line(self) -> str:
        return json.dumps(asdict(self))

    @classmethod
    def from_line(cls, line: str) -> Kept:
        data = json.loads(line)
        return cls(**{**data, "wrong": tuple(data["wrong"])})


ROWS = [Kept("two", 0, True, None, ()), Kept("two", 1, False, 0.1 + 0.2, ("a", "b"))]


def store(directory: Path) -> Store[Kept]:
    return Store(directory, ("head.json", "rows.jsonl"), {"seed": 1}, Kept.from_line)


def test_two_commands_do_not_write_into_one_directory(tmp_path: Path) -> None:
    with store(tmp_path) as first:
        first.add(ROWS)
        with pytest.raises(RefusedError, match="another command"):
            store(tmp_path)
    with store(tmp_path) as later:
        assert later.rows == ROWS


def test_a_run_that_is_there_twice_counts_once_and_two_answers_are_refused(tmp_path: Path) -> None:
    with store(tmp_path) as first:
        first.add([*ROWS, *ROWS])
    with store(tmp_path) as later:
        assert later.rows == ROWS
        later.add([replace(ROWS[1], peak_n=0.0)])
    with pytest.raises(BadInputError, match=r"rows.jsonl:5: another two 1 than before"):
        store(tmp_path)


@pytest.mark.parametrize(("name", "data"), [("head.json", b"[1]"), ("rows.jsonl", b"\xff\n")])
def test_files_of_something_else_are_refused(tmp_path: Path, name: str, data: bytes) -> None:
    with store(tmp_path) as first:
        first.add(ROWS)
    (tmp_path / name).write_bytes(data)
    with pytest.raises(BadInputError, match=name):
        store(tmp_path)
