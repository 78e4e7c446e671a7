"""`import stepload`: what the commands do, as functions; a run as columns and objects."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from real_runs import in_process, leave_out_figures

import stepload
from stepload.errors import BadInputError, RefusedError
from stepload.record.rows import Phase

FIRST_UP = [(1, 100.0), (2, 200.0), (3, 300.0)]


@pytest.fixture(scope="module")
def run(cycles_run: Path) -> stepload.Run:
    return stepload.open(cycles_run)


def test_the_package_alone_loads_nothing() -> None:
    """What it costs is measured in bench/; here that nothing heavy comes with it."""
    code = "import sys, stepload; print(sorted({n.split('.')[0] for n in sys.modules}))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    for heavy in ("numpy", "scipy", "mcap", "rich", "typer", "ruamel", "matplotlib", "asyncio"):
        assert f"'{heavy}'" not in done.stdout


def test_every_name_it_offers_is_there() -> None:
    for name in stepload.__all__:
        assert getattr(stepload, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'opne'"):
        stepload.opne  # type: ignore[attr-defined]  # noqa: B018


def test_a_run_tells_what_it_was(run: stepload.Run) -> None:
    assert len(run.run_id) == 12
    assert run.simulated
    assert not run.partial
    assert run.started is not None
    assert run.started.tzinfo is not None
    assert run.plan.name == "cycles"
    assert run.plan.procedure.cycles == 2
    assert run.preflight["verdict"] in ("go", "warn")
    assert all(reason["code"] and reason["message"] for reason in run.preflight["reasons"])
    assert run.results is not None
    assert run.results["status"] == "completed"


def test_the_curve_is_tared_and_compensated(run: stepload.Run) -> None:
    curve = run.curve
    approach = curve.where(np.isin(curve["phase"], [Phase.GUARDED_APPROACH, Phase.FAST_APPROACH]))
    assert approach.rows > 100
    far = approach["travel_m"] < -1e-4
    assert abs(approach["force_n"][far].mean()) < 0.2  # the sensor's bias is 3 N
    stiffness = run.plan.rig.system_stiffness.stiffness_n_per_m
    held = curve.where((curve["step"] == 3) & (curve["cycle"] == 1))
    bent_m = held["travel_m"] - held["deformation_m"]
    assert np.median(held["force_n"] / bent_m) == pytest.approx(stiffness, rel=0.2)
    assert set(np.unique(curve["branch"])) == {-1, 0, 1}
    assert (np.diff(curve["time_s"]) > 0.0).all()


def test_levels_are_the_holds(run: stepload.Run) -> None:
    up = [(each.step, each.level_n) for each in run.levels if each.loading and each.cycle == 1]
    assert up == FIRST_UP
    for level in run.levels:
        assert level.force_n == pytest.approx(level.level_n, abs=5.0)
        held_s = level.end_s - level.start_s
        assert level.samples == pytest.approx(1000.0 * held_s, abs=5)
        inside = run.curve.between(level.start_s, level.end_s)
        assert inside["deformation_m"].mean() == pytest.approx(level.deformation_m, abs=1e-8)
    heights = [each.deformation_m for each in run.levels if each.loading and each.cycle == 1]
    assert heights == sorted(heights)


@pytest.mark.parametrize("to", ["to_pandas", "to_arrow"])
def test_tables_go_to_the_libraries_people_know(run: stepload.Run, to: str) -> None:
    pytest.importorskip(to[3:] if to != "to_arrow" else "pyarrow")
    frame = getattr(run.curve, to)()
    names = list(frame.column_names if to == "to_arrow" else frame.columns)
    assert names == list(run.curve)
    column = frame["force_n"].to_numpy()
    assert np.array_equal(column, run.curve["force_n"])
    phases = frame["phase"].to_pylist() if to == "to_arrow" else list(frame["phase"])
    assert phases[0] == "warm_up" or phases[0] in ("free_air", "tare")
    assert "hold" in phases


@pytest.mark.parametrize("what", ["nothing", "text", "directory"])
def test_what_is_no_run_is_said(tmp_path: Path, what: str) -> None:
    path = tmp_path / "run.mcap"
    if what == "text":
        path.write_text("no record")
    with pytest.raises(BadInputError):
        stepload.open(tmp_path if what == "directory" else path)


def test_a_plan_is_judged_and_run_without_a_word(
    quick_plan: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    leave_out_figures(monkeypatch)
    plan = stepload.load_plan(quick_plan)
    assert stepload.preflight(plan).force_limit_n > 300.0
    done = stepload.run(plan, dry_run=True, out=tmp_path / "run", seed=3)
    assert done.simulated
    assert done.path == tmp_path / "run" / "run.mcap"
    assert capfd.readouterr() == ("", "")
    with pytest.raises(RefusedError, match="rig"):
        stepload.run(plan, dry_run=False, out=tmp_path / "other")


def test_arrays_are_identified_as_a_file_is(run: stepload.Run, tmp_path: Path) -> None:
    loading = run.curve.where((run.curve["branch"] == 1) & (run.curve["cycle"] == 1))
    known = {"elastic_limit_n": 727.0, "force_noise_n": 0.7, "position_noise_m": 1e-6}
    found = stepload.identify(
        loading["force_n"], loading["deformation_m"], time_s=loading["time_s"], **known
    )
    path = tmp_path / "curve.csv"
    rows = zip(loading["time_s"], loading["deformation_m"], loading["force_n"], strict=True)
    text = "\n".join(",".join(map(repr, map(float, row))) for row in rows)
    path.write_text(f"time_s,displacement_m,force_n\n{text}\n")
    said = in_process(
        "identify", path, "--json", "--elastic-limit", "727 N", "--force-noise", "0.7 N",
        "--position-noise", "1 um",
    )  # fmt: skip
    told = __import__("json").loads(said.stdout)
    assert found.verdict == told["verdict"]
    headline = found.found.headline
    assert headline is not None
    assert headline.value_n_per_m == pytest.approx(told["headline"]["value_n_per_m"], rel=1e-9)
    assert found.notes
