"""`stepload design`: small designs, whole."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from real_runs import ROOT, in_process

from stepload.design import plan_design
from stepload.plan.load import load_plan

PAYLOADS = ROOT / "procedures" / "payloads"
SPHERE = PAYLOADS / "plastic-sphere.yaml"
SMALL = ("design", SPHERE, "stvf")


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A grid of few plans."""
    monkeypatch.setattr(plan_design, "STEPS", (4,))
    monkeypatch.setattr(plan_design, "HOLDS_S", (1.0, 5.0))


def test_a_plan_is_designed_written_and_promises_what_preflight_does(tmp_path: Path) -> None:
    (tmp_path / "plans").mkdir()
    one = in_process(*SMALL, "--json", "--out", "plans/a.yaml", cwd=tmp_path)
    assert one.returncode == 0, one.stderr
    said = json.loads(one.stdout)
    assert said["chosen"]["can"] == "yes"
    assert said["chosen"] in said["plans"]
    soon = [each for each in said["plans"] if each["duration_s"] <= said["time_s"]]
    narrowest = min(each["half_width"] for each in soon)
    assert said["chosen"]["half_width"] <= 1.02 * narrowest
    assert narrowest > max(each["half_width"] for each in said["narrowing"])
    assert said["largest_top_force_n"] == 300.0

    file = tmp_path / "plans" / "a.yaml"
    assert file.read_text() == said["plan"]
    assert "stepload design" in said["plan"]
    plan = load_plan(file).procedure
    assert plan.top_force_n == said["chosen"]["top_force_n"]
    assert plan.hold_s == said["chosen"]["hold_s"]
    assert plan.load_rate_n_per_s == pytest.approx(plan.step_n / said["chosen"]["ramp_s"])
    assert len(plan.levels_n) == said["chosen"]["steps"]
    looked = in_process("preflight", "plans/a.yaml", "--json", cwd=tmp_path)
    assert looked.returncode == 0, looked.stderr
    preflight = json.loads(looked.stdout)
    assert preflight["duration_s"] == pytest.approx(said["chosen"]["duration_s"])
    assert preflight["top_force_n"] <= preflight["largest_safe_force_n"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((PAYLOADS / "plastic-cone.yaml", "stvf"), "must not be pressed on STVF"),
        ((PAYLOADS / "aluminium-sphere.yaml", "stvf"), "preflight refuses it, or says"),
        ((SPHERE, "stvf", "--time", "40 s"), "takes only 40 s"),
    ],
)  # fmt: skip
def test_where_no_plan_will_do_none_is_written(
    tmp_path: Path, words: tuple[object, ...], told: str
) -> None:
    said = in_process("design", *words, cwd=tmp_path)
    assert said.returncode == 3, said.stderr
    assert told in said.stderr
    assert list(tmp_path.iterdir()) == []


def test_bad_options_are_told_before_anything_is_simulated(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("mine")
    for words, told in (
        (("--time", "3 m"), "--time"),
        (("--time", "0 s"), "not above 0"),
        (("--time", "5"), "has no unit"),
        (("--surface-distance", "-5 mm"), "--surface-distance"),
        (("--out", "mine.yaml"), "mine.yaml is there already"),
        (("--out", "none/new.yaml"), "no such directory"),
    ):
        said = in_process(*SMALL, *words, cwd=tmp_path)
        assert said.returncode == 2, words
        assert told in said.stderr
    for words in (("none.yaml", "stvf"), (SPHERE, "nothing")):
        assert in_process("design", *words, cwd=tmp_path).returncode == 2
    assert (tmp_path / "mine.yaml").read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 1
