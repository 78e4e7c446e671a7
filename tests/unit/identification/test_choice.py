"""What a choice of laws changes, and what it cannot make true."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from pressed_runs import World, press, told

from stepload.contact.power_law import LAW_NAMES
from stepload.identification import verdict
from stepload.identification.budget import middle
from stepload.identification.fit import FloatArray
from stepload.identification.smooth import smooth_lengths
from stepload.identification.verdict import Judgement, judge

TOUCH = "secant_from_touch"
WITHOUT_LAW = {"chord", "unloading_chord", "reloading_chord", "tangent"}


def chosen(world: World, *words: str) -> Judgement:
    return judge(told(press(world), laws=words))


def two_springs(force_n: FloatArray) -> FloatArray:
    return np.asarray(force_n / 12e6 + np.minimum(force_n, 90.0) / 5e6)


def test_a_law_that_was_chosen_and_fits_narrows_the_secant_and_says_so() -> None:
    free, hertz = judge(press(World())), chosen(World(), "hertz")
    assert hertz.headline == free.headline
    assert hertz.quantities[TOUCH].verdict == "identified"
    assert hertz.quantities[TOUCH].half_width < free.quantities[TOUCH].half_width
    truth = 300.0 / World().law(np.array([300.0]))[0]
    low, high = hertz.quantities[TOUCH].interval_n_per_m
    assert low <= truth <= high
    note = hertz.notes[-1]
    assert note.startswith("law chosen: power law, Hertz (n = 1.5)")
    assert [row.name for row in hertz.laws if row.counts] == [LAW_NAMES["hertz"]]
    assert LAW_NAMES["hertz"] not in [row.name for row in free.laws if row.counts]


@pytest.mark.parametrize("word", ["cone", "hertz", "stop", "hertz-linear"])
def test_a_law_that_was_chosen_and_does_not_fit_is_not_identified(word: str) -> None:
    world = World(law=two_springs)
    found = chosen(world, word)
    assert found.headline == judge(press(world)).headline
    law_figures = [each for kind, each in found.quantities.items() if kind not in WITHOUT_LAW]
    assert law_figures or word == "hertz-linear"  # which cannot be fitted at all
    assert all(each.verdict != "identified" for each in law_figures)


def test_the_law_that_is_true_may_be_chosen_where_the_power_law_does_not_fit() -> None:
    world = World(law=two_springs)
    free = judge(press(world))
    assert free.exponent is not None
    assert free.exponent.verdict != "identified"
    found = chosen(world, "two-springs")
    assert found.quantities[TOUCH].value_n_per_m == free.quantities[TOUCH].value_n_per_m
    assert found.quantities[TOUCH].verdict == "identified", found.quantities[TOUCH].why
    low, high = found.quantities[TOUCH].interval_n_per_m
    assert low <= 300.0 / two_springs(np.array([300.0]))[0] <= high


def test_an_exponent_that_was_assumed_is_not_a_finding() -> None:
    assert chosen(World(), "hertz").exponent is None
    both = chosen(World(), "power", "hertz").exponent
    assert both is not None
    assert both.interval[0] <= 1.5 <= both.interval[1]


def test_a_choice_that_cannot_be_fitted_with_the_length_that_stands_for_all_counts_with_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    run = press(World())
    run = told(run, smooth_length_n=None, laws=("hertz",))
    assert TOUCH in judge(run).quantities
    whole, requested = verdict.chosen_fits, itertools.count()
    here = middle(len(smooth_lengths(None, 300.0)))
    monkeypatch.setattr(
        verdict, "chosen_fits", lambda *given: {} if next(requested) == here else whole(*given)
    )
    assert set(judge(run).quantities) == WITHOUT_LAW
