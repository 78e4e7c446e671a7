"""Parts of the fault campaign: draws, mishaps, ablations, results, the bound, resuming."""

from __future__ import annotations

import json
import math
import random
from dataclasses import replace
from pathlib import Path

import pytest
from long_ones import long

from stepload.errors import BadInputError, RefusedError
from stepload.jobs.store import Store
from stepload.plan.load import load_plan
from stepload.rig.world import WorldFault
from stepload_verify.campaign import campaign as campaigns
from stepload_verify.campaign import mishaps
from stepload_verify.campaign.ablation import LAYERS, Ablation
from stepload_verify.campaign.campaign import FILES, jobs_for
from stepload_verify.campaign.mishaps import (
    BLIND,
    COMMON,
    COMPONENTS,
    ERRORS,
    FIRST_DAY,
    ONLY_CHANNEL,
    Incident,
)
from stepload_verify.campaign.replay import replay, timeline, wrong_rows
from stepload_verify.campaign.result import KILLED, REFUSED, Result
from stepload_verify.campaign.scenario import (
    HEAVIER,
    HELD_BACK,
    PLATE_MOVES,
    Scenario,
    draw,
    hazard_of,
    kinds_from,
    scenario_of,
)
from stepload_verify.campaign.single import run_scenario
from stepload_verify.campaign.summary import groups, rate_bound, summary
from stepload_verify.campaign.truth import MISTAKES, RIGID_STOP, Anomaly
from stepload_verify.campaign.work import NOT_DECIDING, Work, fingerprint
from stepload_verify.campaign.work import healthy as healthy_plan

TEMPLATE = load_plan(Path(__file__).parents[3] / "procedures" / "campaign.yaml")
ALL = kinds_from("all")


def healthy() -> Scenario:
    """A run without a fault on a rig with two channels that presses at some speed."""
    drawn = (draw(TEMPLATE, 1, "one", index, ()) for index in range(6))
    return next(s for s in drawn if s.limits.guarded_speed_m_s > 2e-4)


def with_kind(kind: str, seed: int = 1, base: Scenario | None = None) -> Scenario:
    """A run with a fault of this kind on the same rig."""
    base = base or healthy()
    chance = random.Random(seed)
    return scenario_of("one", 0, base.preflight, None, (kind,), (chance,), chance)


def result(**changes: object) -> Result:
    values: dict[str, object] = {
        "series": "one", "index": 0, "rig_class": "one axis, two channels", "healthy": False,
        "wrong": ("force_nan",), "beside": (), "top_n": 50.0,
        "hazard": "", "rule": "R4", "message": "", "phase": "LOAD", "status": "stopped",
        "stop_s": 1.0, "detection_s": 0.01, "end_s": 2.0, "peak_n": 50.0, "elastic_limit_n": 100.0,
    }  # fmt: skip
    return Result(**(values | changes))  # type: ignore[arg-type]


def test_a_run_depends_on_seed_series_and_index_alone() -> None:
    assert draw(TEMPLATE, 3, "one", 17, ALL) == draw(TEMPLATE, 3, "one", 17, ALL)
    others = [draw(TEMPLATE, 4, "one", 17, ALL), draw(TEMPLATE, 3, "one", 18, ALL)]
    assert draw(TEMPLATE, 3, "one", 17, ALL) not in others
    first, again = (list(map(Work(TEMPLATE, 3, ALL).run, jobs_for(4, ("one",))[2:])) for _ in "12")
    assert first == again


def test_a_run_has_one_fault_or_a_pair_that_its_rig_can_have() -> None:
    seen: set[str] = set()
    channels = set()
    for index in range(20):
        for count in (1, 2):
            scenario = draw(TEMPLATE, 9, ("one", "six")[index % 2], index, ALL, count)
            assert len(scenario.wrong) == count
            assert not scenario.healthy
            seen |= set(scenario.wrong)
            channels.add(scenario.rig_class)
    assert len(seen) > 25
    assert len(channels) == 4
    assert jobs_for(5, ("one", "six"))[-1].index == 2


@pytest.mark.parametrize("kind", COMMON)
def test_one_cause_reaches_both_channels_at_once(kind: str) -> None:
    faults = with_kind(kind).faults
    assert len(faults) >= 2
    assert len({(fault.start_s, fault.duration_s) for fault in faults}) == 1
    assert faults[0].kind.startswith("force_")
    assert not any(fault.kind.startswith("force_") for fault in faults[1:])


def test_an_error_in_common_is_one_that_the_plan_states() -> None:
    for seed in range(20):
        one, other = with_kind("common_gain", seed), with_kind("common_drift", seed)
        stated = one.plan.rig.common_force_error
        assert {abs(fault.magnitude - 1.0) <= stated for fault in one.faults} == {True}
        assert abs(other.faults[0].magnitude) <= other.plan.rig.force.drift_n_per_s
        assert one.hazard in ("", HELD_BACK)
        assert other.hazard == ""


@pytest.mark.parametrize("kind", FIRST_DAY)
def test_what_a_data_sheet_states_wrongly_is_so_from_the_beginning(kind: str) -> None:
    [fault] = with_kind(kind).faults
    assert (fault.start_s, fault.duration_s) == (0.0, mishaps.FOR_GOOD_S)


@pytest.mark.parametrize("kind", MISTAKES)
def test_a_mistake_of_the_plan_changes_the_truth(kind: str) -> None:
    base = healthy()
    changed = with_kind(kind, 3, base)
    [mistake] = [one for one in changed.anomalies if one.kind == kind]
    plain = replace(changed.plan.procedure)
    if kind.startswith("surface"):
        beyond = changed.truth.surface_m - plain.surface_distance_m
        assert beyond == pytest.approx(mistake.value)
        assert abs(beyond) >= plain.surface_uncertainty_m
    else:
        assert not 0.95 < mistake.value < 1.05


def test_a_plan_of_a_lab_is_a_healthy_run_and_seldom_refused() -> None:
    found = [healthy_plan(1, series, index) for series in ("six", "one") for index in range(25)]
    refused = [row for row in found if isinstance(row, Result)]
    runs = [row for row in found if isinstance(row, Scenario)]
    assert 1 <= len(refused) <= 3
    assert {row.status for row in refused} == {REFUSED}
    assert {row.rule for row in refused} <= {"unidentifiable", "top_force_above_safe_limit"}
    assert not any(row.false_trip for row in refused)
    for run in runs:
        assert run.healthy
        assert (run.truth.mount is not None) <= (run.series == "six")
        assert run.preflight.duration_s > 10.0


def test_a_healthy_run_has_nothing_wrong_and_completes() -> None:
    scenario = healthy()
    assert scenario.healthy
    found, outcome = run_scenario(scenario)
    assert outcome is not None
    assert (found.status, found.rule, found.false_trip) == ("completed", "", False)
    assert 0.2 * scenario.plan.procedure.top_force_n < found.peak_n < found.elastic_limit_n


@pytest.mark.parametrize("component", COMPONENTS)
def test_an_exception_in_any_component_leaves_the_arm_safe(component: str) -> None:
    error = random.Random(component).choice(sorted(ERRORS))
    scenario = healthy()
    times = mishaps.Times(0.5, 1.5)
    incident = Incident("exception", times.touch_s, f"{component} {error}")
    found, outcome = run_scenario(replace(scenario, wrong=("x",), incidents=(incident,)))
    assert outcome is not None
    assert found.peak_ratio < 1.0
    arm = [action for action in outcome.safing if action.name == "arm stop"]
    assert [action.sent for action in arm] == [True]


def test_a_killed_program_sends_nothing_more() -> None:
    scenario = healthy()
    killed = Incident("killed", 0.4, "")
    found, outcome = run_scenario(replace(scenario, wrong=("x",), incidents=(killed,)))
    assert outcome is not None
    assert found.status == KILLED
    assert found.stop_s == pytest.approx(2.4, abs=0.01)
    assert found.peak_n == 0.0


def test_channels_that_lie_are_a_hazard_and_one_of_two_is_none() -> None:
    drawn = [draw(TEMPLATE, 1, "one", i, ()).plan for i in range(8)]
    arm = next(p for p in drawn if p.rig.second_force.source.value == "arm")
    alone = next(p for p in drawn if p.rig.second_force.source.value == "none")
    low, stuck = WorldFault("force_gain", 1.0, 9.0, 0.5), WorldFault("arm_force_bias", 1.0, 9.0, -5)
    assert hazard_of((), [low, stuck], arm, ()) == BLIND
    assert hazard_of((), [low], arm, ()) == ""
    assert hazard_of((), [low], alone, ()) == ONLY_CHANNEL
    assert hazard_of(("common_gain",), [low], alone, ()) == ""
    high = WorldFault("arm_force_gain", 1.0, 9.0, 1.5)
    assert hazard_of((), [low, high], arm, ()) == ""


def test_named_hazards_follow_from_what_is_wrong_alone() -> None:
    plan = healthy().plan
    late, plate = (WorldFault(kind, 1.0, 9.0, 0.1) for kind in ("command_latency", "plate_moves"))
    stop, heavy = Anomaly(RIGID_STOP, 0.5), Anomaly("mass_wrong", 2.0)
    assert hazard_of((), [plate], plan, ()) == PLATE_MOVES
    assert hazard_of((), [late], plan, [stop]) == HELD_BACK
    assert hazard_of((), [late], plan, ()) == ""
    assert hazard_of((), [], plan, [stop, heavy]) == HEAVIER
    assert hazard_of((), [], plan, [stop, Anomaly("mass_wrong", 0.5)]) == ""


@pytest.mark.parametrize(
    "layer", [*list(LAYERS)[::5], *long(layer for number, layer in enumerate(LAYERS) if number % 5)]
)
def test_a_healthy_rig_completes_without_any_layer(layer: str) -> None:
    assert run_scenario(healthy(), Ablation(layer))[0].status == "completed"


@pytest.mark.parametrize(
    ("layer", "fault"),
    [("R3", "force_lost"), ("R4", "force_freeze"), ("R10", "force_sequence_repeat")],
)
def test_a_rule_that_is_switched_off_finds_nothing(layer: str, fault: str) -> None:
    scenario = healthy()
    truth = replace(scenario.truth, faults=(WorldFault(fault, 1.0, 60.0, 0.0),))
    faulted = replace(scenario, truth=truth, wrong=(fault,))
    assert run_scenario(faulted)[0].rule == layer
    assert run_scenario(faulted, Ablation(layer))[0].rule != layer


def test_the_bound_is_the_rule_of_three_and_clopper_pearson() -> None:
    assert rate_bound(0, 100_000) == pytest.approx(2.9957e-5, rel=1e-3)
    bound = rate_bound(2, 50)
    tail = sum(math.comb(50, i) * bound**i * (1.0 - bound) ** (50 - i) for i in range(3))
    assert tail == pytest.approx(0.05, rel=1e-6)
    assert rate_bound(3, 3) == rate_bound(0, 0) == 1.0


def test_the_summary_counts_what_is_claimed_and_the_rest_apart() -> None:
    sound = {"healthy": True, "wrong": ()}
    rows = [
        result(index=0), result(index=1, peak_n=120.0),
        result(index=2, rule="R6", **sound),
        result(index=3, rule="", status="completed", peak_n=80.0, levels_missed=2, **sound),
        result(index=4, peak_n=300.0, hazard="both_channels_alike"),
        result(index=5, rule="too_soft", status=REFUSED, **sound),
    ]  # fmt: skip
    found = summary(rows)
    assert (found["runs"], found["refused"], found["above_elastic_limit"]) == (4, 1, 1)
    assert found["max_peak_ratio"] == pytest.approx(1.2)
    assert found["max_j"] == pytest.approx(1.4)
    assert found["false_trip_rate"] == pytest.approx(0.5)
    assert (found["violations"], found["false_trip_runs"]) == (["one-1"], ["one-2"])
    assert (groups(rows)[0].missed, found["level_missed_runs"]) == (1, ["one-3"])
    apart = {g.name: g.above_elastic_limit for g in groups(rows) if g.name.startswith("apart")}
    assert apart == {"apart: both_channels_alike": 1}
    [fault] = found["faults"]
    counts = [fault[key] for key in ("runs", "above_elastic_limit", "hazards", "hazards_above")]
    assert counts == [2, 1, 1, 1]
    assert found["refusals"] == {"too_soft": 1}


def test_a_store_goes_on_only_with_its_own_campaign(tmp_path: Path) -> None:
    header: dict[str, object] = {"seed": 1}
    with Store(tmp_path, FILES, header, Result.from_line) as store:
        store.add([result(index=0), result(index=1)])
    with (tmp_path / FILES[1]).open("a") as file:
        file.write('{"series"')
    with Store(tmp_path, FILES, header, Result.from_line) as store:
        assert [row.index for row in store.rows] == [0, 1]
        store.add([result(index=2)])
    with Store(tmp_path, FILES, header, Result.from_line) as store:
        assert [row.index for row in store.rows] == [0, 1, 2]
    with pytest.raises(RefusedError, match="seed"):
        Store(tmp_path, FILES, {"seed": 2}, Result.from_line)
    (tmp_path / FILES[0]).write_text("{")
    with pytest.raises(BadInputError):
        Store(tmp_path, FILES, header, Result.from_line)


def test_results_belong_to_the_code_that_decided_them(monkeypatch: pytest.MonkeyPatch) -> None:
    room = Path(campaigns.__file__).parent
    assert all((room / name).is_file() for name in NOT_DECIDING)
    now = fingerprint()
    read = Path.read_bytes

    def changed(name: str) -> str:
        def changed_bytes(path: Path) -> bytes:
            return read(path) + (b"#" if path.name == name else b"")

        monkeypatch.setattr(Path, "read_bytes", changed_bytes)
        return fingerprint()

    assert changed("summary.py") == now
    deciding = ("plants.py", "supervisor.py", "world.py", "expected.py", "smooth.py")
    assert len({now, *map(changed, deciding)}) == 1 + len(deciding)


def test_a_replay_is_the_run_itself(tmp_path: Path) -> None:
    work = Work(TEMPLATE, 3, ALL)
    row = work.run(jobs_for(3, ("one",))[2])
    found = replay(work, "one-2")
    assert found.result == row
    assert list(wrong_rows(found.scenario))
    stamps = [float(cells[0]) for cells in timeline(found)]
    assert stamps == sorted(stamps)
    json.loads(row.to_line())
    with pytest.raises(BadInputError):
        replay(work, "17")
