"""What the cycles of a run cannot show is told from its data."""

from __future__ import annotations

import math

import numpy as np
from evaluated_runs import an_envelope, evaluated
from evaluated_runs import pressed as pressed_run

from stepload.record.lag import Lag
from stepload.record.reader import Event
from stepload.record.rows import Phase
from stepload.results.press_data import PressData
from stepload.results.reasons import levels, unseen
from stepload.results.run_document import run_document
from stepload.results.run_results import run_data


def pressed(*branches: tuple[Phase, int, float]) -> PressData:
    """A run of branches (phase, cycle, highest force), ten samples each."""
    phase = np.repeat([int(b[0]) for b in branches], 10)
    cycle = np.repeat([b[1] for b in branches], 10)
    force = np.concatenate([np.linspace(0.1, 1.0, 10) * b[2] for b in branches])
    time = np.arange(phase.size, dtype=float)
    lag = Lag(math.nan, math.inf, "none")
    return PressData(
        time_s=time, force_n=force, travel_m=force * 1e-6, phase=phase, cycle=cycle, touches=(),
        noise_n=0.1, zero_shift_n=0.0, lag=lag, lag_corrected_s=0.0, clocks=(), gauge=False,
    )  # fmt: skip


UP, DOWN = Phase.LOAD, Phase.UNLOAD


def test_one_loading_says_what_it_cannot_show() -> None:
    assert "nothing in this run hints" in unseen(pressed((UP, 1, 300.0)))
    assert "gap between loading" in unseen(pressed((UP, 1, 300.0), (DOWN, 1, 300.0)))


def test_a_second_loading_counts_once_it_comes_near_the_force_of_the_first() -> None:
    first = ((UP, 1, 300.0), (DOWN, 1, 300.0))
    assert unseen(pressed(*first, (UP, 2, 300.0))) == ""
    assert unseen(pressed(*first, (UP, 2, 271.0))) == ""
    assert unseen(pressed(*first, (UP, 2, 250.0))).startswith("one loading only")


def test_two_loadings_without_unloading_cannot_tell_creep() -> None:
    assert "creep cannot be told" in unseen(pressed((UP, 1, 300.0), (UP, 2, 300.0)))


def test_a_run_without_a_load_step_says_nothing() -> None:
    assert unseen(pressed((DOWN, 1, 10.0))) == ""


def test_levels_that_were_missed_are_told() -> None:
    held = Event(0.0, "held", {})
    assert levels([held, held]) == ()
    told = levels([held, held, Event(0.0, "level_missed", {}), held])
    assert told[0].startswith("1 of 3 levels were not reached")


def test_a_program_is_told_every_reason_of_the_page() -> None:
    data, events = pressed_run(6)
    tilt = Event(1.0, "tilt", {"angle_rad": 0.01, "sigma_rad": 1e-3, "limit_rad": 0.02})
    nulled = Event(2.0, "nulled", {"before_n": 3.0, "after_n": 0.5, "why": "grown"})
    run = evaluated(an_envelope(), (data, (*events, tilt, nulled)), resumed="went on")
    reasons = run_data(run)["reasons"]
    assert reasons == list(run_document(run).reasons)
    text = "\n".join(reasons)
    for part in (
        "the plate is tilted by 0.57",
        "nulling took", "procedure.nulling.sensor_turn", "went on",
    ):  # fmt: skip
        assert part in text
    lost = evaluated(an_envelope(), None)
    assert run_data(lost)["reasons"][0] == "there is nothing to identify"
