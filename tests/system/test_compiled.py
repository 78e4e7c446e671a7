"""The hot modules as machine code do what their Python source does, to the last bit."""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from real_runs import ENVIRONMENT, QUICK

import stepload
from stepload.compiled import LIST, PLACE, PURE, use
from stepload.record.reader import read_recording

ROOT = Path(__file__).parents[2]
CAMPAIGN = ROOT / "procedures" / "campaign.yaml"

compiled = pytest.mark.skipif(
    not (ROOT / PLACE / LIST).exists(), reason="nothing is compiled: `make compiled`"
)


def command(*words: object, pure: bool) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "stepload", *map(str, words)], capture_output=True, text=True,
        env={**ENVIRONMENT, PURE: "1" if pure else ""}, check=False,
    )  # fmt: skip


def test_these_tests_run_what_the_makefile_says() -> None:
    assert bool(stepload.compiled_modules) == (not os.environ[PURE] and (ROOT / PLACE).exists())


@pytest.mark.long
@compiled
def test_a_run_is_recorded_alike(tmp_path: Path) -> None:
    plan = tmp_path / "plan.yaml"
    plan.write_text(QUICK)
    records = []
    for pure in (True, False):
        out = tmp_path / str(pure)
        done = command("run", plan, "--dry-run", "--quiet", "--out", out, pure=pure)
        assert done.returncode == 0, done.stderr
        records.append(read_recording(out / "run.mcap"))
    one, other = records
    assert (one.metadata["engine"], other.metadata["engine"]) == ("python", "compiled")
    for rows, others in ((one.force, other.force), (one.arm, other.arm), (one.ticks, other.ticks)):
        for column, its in zip(rows, others, strict=True):
            assert column.tobytes() == its.tobytes()
    happened, its = ([(event.time_s, event.kind) for event in each.events] for each in (one, other))
    assert happened == its


@compiled
@pytest.mark.parametrize(
    ("axes", "faults", "count"),
    [
        ("one", "all", 2),
        pytest.param("one", "all", 4, marks=pytest.mark.long),
        pytest.param("six", "all", 3, marks=pytest.mark.long),
        pytest.param("one", "all", 8, marks=pytest.mark.long),
        pytest.param("six", "all", 8, marks=pytest.mark.long),
        pytest.param("one", "exception", 30, marks=pytest.mark.long),
    ],
)
def test_a_campaign_comes_to_the_same_rows(
    tmp_path: Path, axes: str, faults: str, count: int
) -> None:
    rows = []
    for pure in (True, False):
        out = tmp_path / str(pure)
        words = ["--runs", count, "--seed", 3, "--faults", faults, "--axes", axes, "--out", out]
        words += ["--processes", 1] if count < 5 else []
        done = command("campaign", CAMPAIGN, *words, pure=pure)
        assert done.returncode == 0, done.stderr
        rows.append(sorted((out / "runs.jsonl").read_text().splitlines()))
    assert rows[0] == rows[1]


@compiled
def test_ctrl_c_reaches_a_run_that_never_leaves_machine_code(tmp_path: Path) -> None:
    out = tmp_path / "run"
    process = subprocess.Popen(
        [sys.executable, "-m", "stepload", "run", str(ROOT / "procedures" / "plastic-sphere.yaml"),
         "--dry-run", "--quiet", "--out", str(out)],
        env={**ENVIRONMENT, PURE: ""}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    part = out / "run.mcap.part"
    deadline = time.monotonic() + 60.0
    while not (part.exists() and part.stat().st_size > 100_000) and time.monotonic() < deadline:
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    assert process.wait(120) == 130
    found = json.loads((out / "results.json").read_text())
    assert found["status"] == "interrupted"


@compiled
@pytest.mark.parametrize(
    "as_given",
    [
        pytest.param("tuple(rows)", marks=pytest.mark.long),
        "[r._replace(wrench=w(r)) for r in rows]",
    ],
)
def test_a_driver_of_other_types_than_it_promises_ends_the_run(
    tmp_path: Path, as_given: str
) -> None:
    """Made safe and said, as any exception of a driver or of the tick; never left pressing."""
    code = f"""
import sys, numpy
from stepload_drivers.sim.sensors import WorldForceSensor
drain = WorldForceSensor.drain
def w(row): return tuple(map(numpy.float32, row.wrench))
def given(sensor):
    rows = drain(sensor)
    return {as_given} if rows and rows[-1].receive_time_s > 3.0 else rows
WorldForceSensor.drain = given
from stepload.cli.main import main
main()
"""
    plan = tmp_path / "plan.yaml"
    plan.write_text(QUICK)
    done = subprocess.run(
        [sys.executable, "-c", code, "run", str(plan), "--dry-run", "--quiet", "--out",
         str(tmp_path / "run")],
        env={**ENVIRONMENT, PURE: ""}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 4, done.stderr
    found = json.loads((tmp_path / "run" / "results.json").read_text())
    assert found["status"] == "stopped"
    assert "object expected" in found["why_it_ended"]
    action = found["safing"][-2]
    assert (action["name"], action["error"]) == ("arm stop", "")


def test_two_that_compile_at_once_leave_one_of_both(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("compile_hot", ROOT / "compile_hot.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    place = tmp_path / "place" / "here"
    for name in ("one", "other"):
        made = tmp_path / name / "made"
        made.mkdir(parents=True)
        (made / "by").write_text(name)
        module._put(made, place)
        assert (place / "by").read_text() == name
    late = tmp_path / "late" / "made"
    (late.with_name("former") / "full").mkdir(parents=True)  # so the other cannot be moved away
    late.mkdir()
    module._put(late, place)
    assert (place / "by").read_text() == "other"


@compiled
@pytest.mark.parametrize(
    "change", ["time", "size", "gone", "list", "null", "[]", "{}", "cut", "lost"]
)
def test_machine_code_of_another_source_or_not_whole_is_not_used(
    tmp_path: Path, change: str
) -> None:
    """A file that was cut short, by a full disk or a power cut, ends Python with a bus error."""
    place = tmp_path / PLACE
    place.mkdir(parents=True)
    code = place / "a.so"
    code.write_bytes(b"code")
    source = tmp_path / "a.py"
    source.write_text("A = 1\n")
    told = source.stat()
    listed = {
        "sources": {"a.py": [told.st_size, told.st_mtime_ns]},
        "modules": {"stepload_nowhere": "a.so"},
        "sizes": {"a.so": 4},
    }
    (place / LIST).write_text(json.dumps(listed))
    before = list(sys.meta_path)
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv(PURE, raising=False)
        assert use(tmp_path) == 1
        sys.meta_path[:] = before
        if change == "time":
            os.utime(source, ns=(told.st_atime_ns, told.st_mtime_ns + 1))
        elif change == "size":
            source.write_text("A = 11\n")
            os.utime(source, ns=(told.st_atime_ns, told.st_mtime_ns))
        elif change == "gone":
            source.unlink()
        elif change == "cut":
            code.write_bytes(b"cod")
        elif change == "lost":
            code.unlink()
        else:
            (place / LIST).write_text("{" if change == "list" else change)
        assert use(tmp_path) == 0
    assert sys.meta_path == before
