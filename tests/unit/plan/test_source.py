"""Files that a plan may be made of, and files that it may not."""

from __future__ import annotations

from pathlib import Path

import pytest

from stepload.errors import printable
from stepload.plan.problems import PlanError, Problem
from stepload.plan.source import MAX_BYTES, read_source


def refusal(path: Path) -> Problem:
    with pytest.raises(PlanError) as caught:
        read_source(path)
    (problem,) = caught.value.problems
    return problem


def test_a_file_of_a_mebibyte_is_read_and_no_larger_one(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_bytes(b"#" * (1 << 20))
    assert len(read_source(path).text) == MAX_BYTES == 1 << 20
    path.write_bytes(b"#" * ((1 << 20) + 1))
    assert refusal(path).message == "is larger than 1024 KiB"


def test_a_byte_that_is_not_utf_8_is_reported_at_its_place(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1\nb\xc3\xa4: \xff\n")
    problem = refusal(path)
    assert (problem.line, problem.column) == (2, 5)
    assert problem.message == "byte 0xff is not UTF-8"
    path.write_bytes(b"\xef\xbb\xbfa: 1\n")
    assert read_source(path).text == "a: 1\n"


def test_nothing_that_steers_a_terminal_is_shown() -> None:
    assert printable("a\x1b[2Jb\u202e") == "a\\x1b[2Jb\\u202e"
    assert printable("x" * 61) == "x" * 57 + "..."
    assert printable("x" * 60) == "x" * 60
    shown = str(Problem("a\x1bb", 1, 3, "  \x1b!", "no", ""))
    assert "\x1b" not in shown
