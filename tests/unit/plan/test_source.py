"""Files that a plan may be made of, and files that it may not."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pytest

from stepload.errors import printable
from stepload.plan.problems import MAX_PROBLEMS, PlanError, Problem
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


def test_only_regular_files_are_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert refusal(tmp_path / "pipe").message == "is not a regular file"
    assert refusal(tmp_path).message == "is not a regular file"
    assert refusal(Path("/dev/zero")).message == "is not a regular file"
    assert refusal(tmp_path / "nowhere").message == "no such file"
    assert refusal(tmp_path / "a\0b").message.startswith("cannot be opened")


def test_a_byte_that_is_not_utf_8_is_reported_at_its_place(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1\nb\xc3\xa4: \xff\n")
    problem = refusal(path)
    assert (problem.line, problem.column) == (2, 5)
    assert problem.message == "byte 0xff is not UTF-8"
    path.write_bytes(b"\xef\xbb\xbfa: 1\n")
    assert read_source(path).text == "a: 1\n"


def test_a_source_knows_its_digest_and_its_lines(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_bytes(b"a: 1\r\nb: 2\n")
    source = read_source(path, "a name")
    assert source.problem(2, 4, "no").source_line == "b: 2"
    assert source.problem(9, 1, "no").source_line == ""
    assert source.name == "a name"
    assert source.sha256 == hashlib.sha256(b"a: 1\r\nb: 2\n").hexdigest()


def test_nothing_that_steers_a_terminal_is_shown() -> None:
    assert printable("a\x1b[2Jb\u202e") == "a\\x1b[2Jb\\u202e"
    assert printable("x" * 61) == "x" * 57 + "..."
    assert printable("x" * 60) == "x" * 60
    shown = str(Problem("a\x1bb", 1, 3, "  \x1b!", "no", ""))
    assert "\x1b" not in shown


def test_a_long_line_is_shown_around_its_problem() -> None:
    line = "a" * 300 + "!" + "b" * 300
    _, shown, caret = str(Problem("f", 1, 301, line, "no", "")).splitlines()
    assert shown[caret.index("^")] == "!"
    assert len(shown) < 140


def test_many_problems_are_counted_and_fifty_shown() -> None:
    many = tuple(Problem("f", n, 1, "", f"problem {n}", "") for n in range(1, 54))
    text = str(PlanError(many))
    assert text.count(": problem ") == MAX_PROBLEMS == 50
    assert text.endswith("… and 3 more\n\n53 problems")
    assert str(PlanError(many[:1])).endswith("1 problem")
