"""A lab's own simulator: chosen, checked, held to the contract, pressed in below F_c."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from itertools import count
from pathlib import Path
from types import ModuleType

import pytest
from real_runs import in_process

from stepload.errors import BadInputError
from stepload.rig import plugins
from stepload.rig.contract import CheckStatus
from stepload.rig.contract_world import run_world
from stepload.rig.mount import Mount
from stepload.rig.world import DEFAULT_SPEC, load_world
from stepload_drivers.sim.world import open_world
from stepload_verify.campaign.result import Job
from stepload_verify.campaign.servo_world import ServoOptions, ServoPlant, servo
from stepload_verify.campaign.work import Work

PAGE = Path(__file__).parents[2] / "docs" / "worlds.md"
(EXAMPLE,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)


@pytest.fixture(scope="module")
def two_springs():
    """The module on the page."""
    module = ModuleType("ourlab_worlds")
    exec(EXAMPLE, module.__dict__)
    return module


@pytest.fixture
def installed_worlds(monkeypatch, two_springs):
    """That of the page and the servo, as installed packages offer them."""
    monkeypatch.setitem(sys.modules, "ourlab_worlds", two_springs)
    own = EntryPoints((
        EntryPoint("two_springs", "ourlab_worlds:two_springs", plugins.WORLDS),
        EntryPoint("servo", "stepload_verify.campaign.servo_world:servo", plugins.WORLDS),
        EntryPoint("broken", "ourlab_worlds:nothing", plugins.WORLDS),
    ))  # fmt: skip

    def found(group):
        there = [each for each in entry_points(group=group) if each.name != "servo"]
        return EntryPoints((*there, *own.select(group=group)))

    monkeypatch.setattr(plugins, "installed", found)


def broken(results):
    return {each.name for each in results if each.status is CheckStatus.FAILED}


@pytest.mark.parametrize("name", ["sim", "servo", "page"])
def test_a_world_keeps_the_contract(name, two_springs):
    world = {"sim": open_world, "servo": servo, "page": two_springs.two_springs}[name]
    results = run_world(world, {})
    assert broken(results) == set()
    assert {"arm.stop", "force.samples", "clock", "rates", "seed", "press", "faults"} <= {
        each.name for each in results
    }


SEEDS = count()


def changed(**fields):
    return lambda spec: open_world(replace(spec, **fields))


@pytest.mark.parametrize(
    ("world", "checks"),
    [
        (changed(force_axis="-fz"), {"press"}),
        (changed(surface_m=1e-3), {"press"}),
        (changed(surface_m=4e-3), {"press"}),
        (changed(force_rate_hz=500.0), {"rates"}),
        (changed(faults=()), {"faults"}),
        (lambda spec: open_world(replace(spec, seed=next(SEEDS))), {"seed"}),
    ],
)
def test_a_world_that_is_no_such_rig_is_told_so(world, checks):
    assert broken(run_world(world, {})) == checks


def test_what_a_world_leaves_out_is_refused(two_springs):
    for wrong in (
        {"softness": 0.1},
        {"mount": Mount(((1e-7, 0.0, 0.0), (0.0, 1e-7, 0.0), (0.0, 0.0, 1e-7)))},
        {"payload": replace(DEFAULT_SPEC.payload, law="rough")},
        {"payload": replace(DEFAULT_SPEC.payload, creep=0.1)},
    ):
        with pytest.raises(BadInputError):
            two_springs.two_springs(replace(DEFAULT_SPEC, **wrong))


def test_the_servo_overshoots_and_its_play_shows():
    """Other physics than `sim`: a step is passed by exp(−πζ/√(1−ζ²)), a way back loses the play."""
    options = ServoOptions(damping_ratio=0.5, play_m=50e-6)
    plant = ServoPlant(DEFAULT_SPEC, step_s=1e-3, options=options)
    plant.command(0.0, 100e-6)
    ways = []
    for _ in range(200):
        plant.step()
        ways.append(plant.drive_m)
    assert max(ways) + 25e-6 == pytest.approx(100e-6 * 1.163, rel=0.02)
    assert ways[-1] == max(ways)  # held by the play
    plant.command(plant.time_s, 80e-6)
    for _ in range(200):
        plant.step()
    assert plant.drive_m == pytest.approx(ways[-1], abs=1e-9)


def test_no_fault_passes_the_elastic_limit_on_another_physics(installed_worlds):
    from stepload.plan.load import load_plan
    from stepload_verify.campaign.scenario import kinds_from

    plan = load_plan(Path(__file__).parents[2] / "procedures" / "campaign.yaml")
    work = Work(plan, 1, kinds_from("all"), world="servo")
    rows = [work.run(Job("one", index)) for index in (1, 8)]
    assert [row.rule for row in rows if row.hazard == "" and row.peak_ratio > 1.0] == []
    assert {row.rule for row in rows} - {""}


@pytest.mark.usefixtures("installed_worlds")
def test_a_dry_run_in_a_labs_world(tmp_path):
    in_process("plans", "copy", "campaign", str(tmp_path))
    plan = tmp_path / "campaign.yaml"
    text = plan.read_text()
    run = in_process("run", str(plan), "--dry-run", "--world", "two_springs")
    assert run.returncode == 2  # its payload is rough, and the world knows none
    assert "law" in run.stderr
    plan.write_text(text.replace("simulation:\n", "simulation:\n    world: two_springs\n"))
    assert in_process("run", str(plan), "--dry-run").returncode == 2
    plan.write_text(text)
    out = tmp_path / "run"
    run = in_process("run", str(plan), "--dry-run", "--world", "servo", "--out", str(out))
    assert run.returncode == 0, run.stderr
    results = json.loads((out / "results.json").read_text())
    assert results["simulated"] is True
    from stepload.record.reader import read_recording

    assert read_recording(out / "run.mcap").metadata["world"] == "servo"
    resumed = in_process("run", str(plan), "--dry-run", "--resume", str(out))
    assert resumed.returncode == 2
    assert "servo" in resumed.stderr


@pytest.mark.usefixtures("installed_worlds")
@pytest.mark.parametrize(
    ("told", "column"),
    [
        ("world: nowhere", 42),
        ("world: servo, world_options: {damping: 1}", 65),
        ("world: servo, world_options: {play: 5 N}", 71),
        ("world_options: {play: 5 um}", 51),
        ("world: broken", 42),
    ],
)
def test_a_world_and_its_options_are_checked_with_the_plan(tmp_path, told, column):
    in_process("plans", "copy", "plastic-sphere", str(tmp_path))
    plan = tmp_path / "plastic-sphere.yaml"
    rig = f"rig: {{profile: stvf, simulation: {{{told}}}}}"
    plan.write_text(plan.read_text().replace("rig: stvf", rig))
    found = in_process("preflight", str(plan))
    assert found.returncode == 2
    assert f"{plan.name}:5:{column}: " in found.stderr


@pytest.mark.usefixtures("installed_worlds")
def test_a_world_is_of_a_dry_run_and_must_be_installed(tmp_path):
    in_process("plans", "copy", "plastic-sphere", str(tmp_path))
    plan = str(tmp_path / "plastic-sphere.yaml")
    assert in_process("run", plan, "--world", "servo").returncode == 2
    assert in_process("run", plan, "--dry-run", "--world", "nowhere").returncode == 2
    listed = json.loads(in_process("drivers", "--json").stdout)["drivers"]
    states = {each["name"]: bool(each["problem"]) for each in listed if "worlds" in each["group"]}
    assert states == {"sim": False, "servo": False, "two_springs": False, "broken": True}
    assert load_world("servo") is servo
