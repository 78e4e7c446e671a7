"""Any bytes are a plan or a PlanError, in bounded time; nothing blocks, nothing is executed."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stepload.plan.load import load_plan
from stepload.plan.problems import PlanError

WritePlan = Callable[..., Path]
PLANS = sorted((Path(__file__).parents[3] / "procedures").glob("*.yaml"))

HOSTILE = [
    "&a ", "*a", "<<: ", "!!python/object/apply:os.system [id]", "[", "{", "]", "}", "? ", "- ",
    "\t", "\r", "\x00", "\x1b[2J", "\u2028", "\ufeff", "---\n", "...\n", "%YAML 1.1\n", "|\n",
    ">\n", "'", '"', ": ", "#", "~", ".nan", ".inf", "-.inf", "1e999", "1e999 N", "0x1F", "0o17",
    "9" * 50, "-1 N", "0 N", "1e-320 m", "NaN N", "true", "null", "../../etc/passwd", "/dev/zero",
    "50 %", "💥", "\ud7ff", "\\", "a: " * 30, "[" * 60, "{a: " * 60,
]  # fmt: skip

SLOW = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


def plan_or_error(path: Path, content: bytes) -> None:
    payloads = path.with_name("payloads")
    if not payloads.exists():
        payloads.symlink_to(PLANS[0].with_name("payloads"))
    path.write_bytes(content)
    try:
        assert load_plan(path).procedure.levels_n
    except PlanError as error:
        lines = content.count(b"\n") + content.count(b"\r") + content.count(b"\xe2\x80") + 2
        for problem in error.problems:
            assert problem.message
            assert 0 <= problem.line <= max(lines, 100)
        shown = str(error)
        assert all(c.isprintable() or c == "\n" for c in shown), repr(shown)


@SLOW
@given(st.text(max_size=200))
def test_any_text(tmp_path: Path, text: str) -> None:
    plan_or_error(tmp_path / "plan.yaml", text.encode("utf-8", "surrogatepass"))


@SLOW
@given(st.binary(max_size=100))
def test_any_bytes(tmp_path: Path, content: bytes) -> None:
    plan_or_error(tmp_path / "plan.yaml", content)


@SLOW
@given(st.data())
def test_mutated_plans(tmp_path: Path, data: st.DataObject) -> None:
    text = data.draw(st.sampled_from(PLANS)).read_text(encoding="utf-8")
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(text)))
        length = data.draw(st.integers(0, 12))
        insert = data.draw(st.sampled_from(HOSTILE) | st.text(max_size=6))
        text = text[:start] + insert + text[start + length :]
    plan_or_error(tmp_path / "plan.yaml", text.encode("utf-8", "surrogatepass"))


@SLOW
@given(st.data())
def test_any_value_at_any_key(tmp_path: Path, data: st.DataObject) -> None:
    lines = data.draw(st.sampled_from(PLANS)).read_text(encoding="utf-8").splitlines()
    keyed = [index for index, line in enumerate(lines) if ":" in line and line[:1] != "#"]
    index = data.draw(st.sampled_from(keyed))
    value = data.draw(st.sampled_from(HOSTILE) | st.floats().map(lambda x: f"{x!r} N"))
    lines[index] = lines[index].split(":")[0] + ": " + value
    plan_or_error(tmp_path / "plan.yaml", "\n".join(lines).encode("utf-8", "surrogatepass"))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"# nothing\n",
        b"[" * 900_000,
        b"{a: " * 200_000,
        b"- " * 500_000,
        b"a: '" + b"x" * 1_000_000 + b"'",
        b"a: " + b"9" * 1_000_000,
        b"\n".join(b"k%d: 1" % i for i in range(40_000)),
        b"a: &a [x,x,x,x]\n" + b"".join(b"b%d: &b%d [*a,*a,*a]\n" % (i, i) for i in range(500)),
        b"\xff\xfe" + "stepload: 1".encode("utf-16-le"),
        b"x" * ((1 << 20) + 1),
    ],
    ids=lambda content: f"{content[:8]!r} {len(content)}",
)
def test_heavy_files_are_refused_with_few_words(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "plan.yaml"
    path.write_bytes(content)
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    assert len(str(caught.value)) < 20_000


def test_a_pipe_as_a_plan_does_not_block(tmp_path: Path) -> None:
    path = tmp_path / "pipe.yaml"
    os.mkfifo(path)
    with pytest.raises(PlanError, match="not a regular file"):
        load_plan(path)


def test_files_that_name_each_other_are_no_loop(write_plan: WritePlan, tmp_path: Path) -> None:
    path = write_plan(("payload: ball.yaml", "payload: plan.yaml"))
    with pytest.raises(PlanError, match="not a payload file"):
        load_plan(path)


def test_a_tag_executes_nothing(write_plan: WritePlan, tmp_path: Path) -> None:
    witness = tmp_path / "witness"
    path = write_plan(("rig: stvf", f"rig: !!python/object/apply:os.mkdir ['{witness}']"))
    with pytest.raises(PlanError, match="plain data"):
        load_plan(path)
    assert not witness.exists()


@pytest.mark.parametrize("line", ['"\\ud800": 1', 'name: "\\ud800"'])
def test_half_a_character_is_refused_at_its_line(tmp_path: Path, line: str) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text(f"stepload: 1\n{line}\n")
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    assert 2 in [problem.line for problem in caught.value.problems]
