"""The simulation behind `compare`: few of the trials of `stepload_verify.trials.compare`."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.identification.difference import Agreement, difference
from stepload_verify.trials import compare
from stepload_verify.trials.compare import World, _groups, tally

TRIALS = 40


def test_equal_payloads_agree() -> None:
    found = tally(World("equal"), TRIALS, seed=1)
    assert found.agree >= 0.92
    assert found.covered >= 0.92
    assert found.smallest < 0.04


@pytest.mark.long
@pytest.mark.parametrize("ratio", [1.05, 1.0 / 1.05])
def test_five_percent_are_told_apart_on_one_rig(ratio: float) -> None:
    found = tally(World("5 %", ratio), TRIALS, seed=2)
    assert found.differ >= 0.95
    assert found.covered >= 0.92


@pytest.mark.long
def test_the_smallest_detectable_difference_is_found_in_four_of_five() -> None:
    seen = tally(World("equal"), 20, seed=3).smallest
    found = tally(World("smallest", 1.0 + seen), 2 * TRIALS, seed=4)
    assert 0.65 < found.differ < 0.98


@pytest.mark.long
def test_errors_of_two_rigs_do_not_cancel() -> None:
    """Taken as one rig, equal payloads on two rigs would be called different every other time."""
    world, rng = World("two rigs", rigs=2), np.random.default_rng(5)
    said, believed_one = [], []
    for _ in range(TRIALS):
        first, second = _groups(world, rng)
        said.append(difference(first, second, tolerance=0.2))
        wrong = [each._replace(origin=first[0].origin) for each in second]
        believed_one.append(difference(first, wrong, tolerance=0.2))
    wrongly = [each.verdict is Agreement.DIFFER for each in said]
    assert np.mean(wrongly) <= 0.1
    assert np.median([each.smallest_detectable for each in said]) > 0.08
    assert np.mean([each.verdict is Agreement.DIFFER for each in believed_one]) > 0.3


@pytest.mark.long
def test_five_percent_at_another_place_cannot_be_told_where_five_percent_matter() -> None:
    world = World("away", 1.05, apart_m=0.5e-3, tolerance=0.05)
    found = tally(world, TRIALS, seed=6)
    assert found.agree == 0.0
    assert found.covered >= 0.92


@pytest.mark.long
def test_a_pose_without_a_name_is_no_excuse_for_agreement_or_difference() -> None:
    found = tally(World("unnamed", 1.05, pose=""), TRIALS, seed=7)
    assert found.agree <= 0.05
    assert found.cannot_tell >= 0.5


@pytest.mark.long
def test_the_trial_prints_a_line_for_every_world(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["compare", "2"])
    compare.main()
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(compare.WORLDS) + 3
