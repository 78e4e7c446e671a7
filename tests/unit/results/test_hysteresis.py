"""The results beside the law, from a run whose truth was put in."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import Missing
from stepload.estimators.sources import Sources
from stepload.evidence.identification import Identification
from stepload.record.lag import Lag
from stepload.record.plain import json_text
from stepload.record.rows import Phase
from stepload.results import hysteresis
from stepload.results.analyse import identify_payload
from stepload.results.hysteresis import (
    Hysteresis,
    hysteresis_data,
    hysteresis_of,
    hysteresis_table,
)
from stepload.results.press_data import PressData

K, N, K_S = 6.57e8, 1.5, 3.49e6
LEVELS = (50.0, 100.0, 150.0, 200.0, 250.0, 300.0)
CONDITIONS = Conditions(
    Sources(
        K_S, 0.001 * K_S, 1e-8, force_noise_n=0.1, position_noise_m=2e-8,
        position_resolution_m=1e-7, lag_sigma_s=1e-3,
    ),
    300.0, 3.0, 1e-7,
)  # fmt: skip


def run(*, cycles=2, down=True, creep=0.0, hold=2.0, loop=0.0) -> PressData:
    """Steps at 200 Hz: the force is held, the deformation creeps by a share of each hold's δ."""
    rng, step = np.random.default_rng(2), 5e-3
    parts, now = [], 0.0

    def add(forces, phase, cycle, crept=0.0, wider=0.0):
        nonlocal now
        forces = np.asarray(forces)
        deep = (forces / K) ** (1 / N) * (1.0 + crept)
        deep = deep + wider * (300.0 / K) ** (1 / N) * 4 * forces * (300.0 - forces) / 300.0**2
        times = now + step * np.arange(forces.size)
        now = float(times[-1]) + step
        parts.append((times, forces, deep, np.full(forces.size, int(phase)),
                      np.full(forces.size, cycle)))  # fmt: skip

    for cycle in range(1, cycles + 1):
        before = 3.0
        for level in LEVELS:
            add(np.linspace(before, level, 200), Phase.LOAD, cycle)
            grows = creep * (1.0 - np.exp(-np.arange(0.0, hold, step) / 0.8))
            add(np.full(int(hold / step), level), Phase.HOLD, cycle, crept=grows)
            before = level
        for level in reversed(LEVELS[:-1]) if down else ():
            add(np.linspace(before, level, 200), Phase.UNLOAD, cycle, wider=loop)
            add(np.full(int(hold / step), level), Phase.UNLOAD_HOLD, cycle, wider=loop)
            before = level
        add(np.zeros(200), Phase.RETRACT, cycle)
    time, force, deep, phase, cycle = (np.concatenate(part) for part in zip(*parts, strict=True))
    travel = deep + force / K_S + rng.normal(0.0, 2e-8, force.size)
    read = force + rng.normal(0.0, 0.1, force.size)
    return PressData(
        time, read, np.round(travel / 1e-7) * 1e-7, phase, cycle, (), 0.1, 0.0,
        Lag(0.0, 1e-3, "given"), 0.0, (), gauge=False,
    )  # fmt: skip


def identified(data: PressData) -> Identification:
    return identify_payload(data, CONDITIONS)


@pytest.fixture(scope="module")
def whole() -> PressData:
    return run(loop=0.03)


@pytest.fixture(scope="module")
def law(whole) -> Identification:
    return identified(whole)


@pytest.fixture(scope="module")
def every(whole, law) -> Hysteresis:
    """All of them of a sphere; to be read only."""
    return hysteresis_of(whole, law)


@pytest.fixture
def no_creep(monkeypatch):
    """Without the result that takes longest, where others are looked at."""
    monkeypatch.setattr(hysteresis, "_relaxation", lambda *_: Missing("left out"))


def test_a_run_of_two_cycles_has_them_all(every):
    found = every
    assert [c.cycle for c in found.loss.cycles] == [1, 2]
    assert all(c.resolved and c.share == pytest.approx(0.05, rel=0.5) for c in found.loss.cycles)
    assert abs(found.loss.change) < 3 * found.loss.change_sigma + 1e-3
    assert len(found.relaxation.holds) == 22
    assert sum(each.loading for each in found.relaxation.holds) == 12
    assert not found.relaxation.resolved


def test_the_table_of_the_system_is_taken_out_where_there_is_one(whole, every, no_creep):
    """Soft joints below 100 N: F/K_s alone leaves them in the deformation."""
    rows = np.arange(10.0, 301.0, 10.0)

    def joints(force):
        return 8e-6 * -np.expm1(-np.abs(force) / 40.0)

    table = {
        "deflection_force_n": tuple(rows.tolist()),
        "deflection_m": tuple((rows / K_S + joints(rows)).tolist()),
        "deflection_sigma_m": (1e-8,) * rows.size,
    }
    soft = replace(whole, travel_m=whole.travel_m + joints(whole.force_n))
    known = replace(CONDITIONS, sources=replace(CONDITIONS.sources, **table))
    expected = every
    found = hysteresis_of(soft, identify_payload(soft, known))
    for one, other in zip(found.loss.cycles, expected.loss.cycles, strict=True):
        assert one.stored_j == pytest.approx(other.stored_j, rel=0.01)


def test_creep_in_the_holds_is_seen():
    data = run(creep=0.1)
    found = hysteresis_of(data, identified(data)).relaxation
    assert found.resolved
    assert all(each.resolved for each in found.holds if each.loading and each.force_n > 90.0)
    # 1 − exp(−t/τ) over the hold after the skip.
    assert found.holds[5].relative == pytest.approx(0.06, abs=0.025)


def test_json_says_null_and_why(every):
    made = hysteresis_data(every)
    assert set(made) == {"missing", "relaxation", "loss"}
    assert made["missing"] == {}
    assert json.loads(json_text(made))["loss"]["cycles"][0]["stored_j"] > 0.0
    one_way = run(cycles=1, down=False, hold=0.3)
    made = hysteresis_data(hysteresis_of(one_way, identified(one_way)))
    for name in ("relaxation", "loss"):
        assert made[name] is None
        assert made["missing"][name]
    assert "unload: true" in made["missing"]["loss"]


def test_every_result_or_its_reason_is_on_the_page(every):
    one_way = run(cycles=1, down=False, hold=0.3)
    for found in (every, hysteresis_of(one_way, identified(one_way))):
        rows = hysteresis_table(found).rows
        assert len(rows) == 2
        assert all(len(row) == 3 and row[2] for row in rows)
    assert [row[1] for row in rows] == ["–", "–"]


def test_a_record_cut_anywhere_is_told_and_raises_nothing(whole, law):
    for stop in (0, 1, 5, 50, 300, 900, 4000, 9000, whole.time_s.size):
        part = replace(
            whole,
            **{
                name: getattr(whole, name)[:stop]
                for name in ("time_s", "force_n", "travel_m", "phase", "cycle")
            },
        )
        made = hysteresis_data(hysteresis_of(part, law))
        for name in ("relaxation", "loss"):
            assert (made[name] is None) == (name in made["missing"])
