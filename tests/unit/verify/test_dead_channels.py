"""What a dead channel shows, and what a whole run comes to when all of them die."""

from __future__ import annotations

import pytest

from stepload.envelope import pressing
from stepload.envelope.leash import ANSWER_SHARE
from stepload_verify.trials.dead_channels import Case, Death, Dying, believed, run


def shown(death: Death, *, dies_at: int = 100, noise_n: float = 0.0) -> list[float]:
    """Readings, 10 ms apart, of a force that grows by 1 N with each."""
    now = [0]
    channel = Dying(lambda: now[0] >= dies_at, death, noise_n, 0.01, 1)
    read = []
    for now[0] in range(300):
        read.append(channel.read(float(now[0])))
    return read


def test_a_channel_shows_the_force_until_it_dies_and_stands_then() -> None:
    read = shown(Death())
    assert read[:101] == [float(each) for each in range(101)]
    assert set(read[101:]) == {100.0}


def test_a_dead_channel_drifts_fades_or_has_been_late_from_the_beginning() -> None:
    assert shown(Death(drift_n_per_s=2.0))[-1] == pytest.approx(100.0 + 2.0 * 1.99, abs=0.05)
    fading = shown(Death(fade_s=0.5))
    assert fading[101] == pytest.approx(101.0, abs=0.05)
    assert fading[-1] == pytest.approx(148.0, abs=2.0)
    late = shown(Death(filter_s=0.1))
    assert late[90] == pytest.approx(80.0, abs=1.0)
    assert late[-1] == pytest.approx(90.0, abs=1.0)


def test_its_noise_keeps_its_size_and_gets_the_colour_that_is_asked_for() -> None:
    import numpy as np

    white, coloured = (
        np.array(shown(Death(coloured_s=tau), dies_at=0, noise_n=0.5)[1:]) for tau in (0.0, 0.05)
    )
    for noise in (white, coloured):
        assert noise.std() == pytest.approx(0.5, rel=0.25)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.15
    assert np.corrcoef(coloured[1:], coloured[:-1])[0, 1] > 0.65


def test_channels_that_die_behind_slow_noise_and_drift_do_not_lead_the_arm_on() -> None:
    found = run(Case("stiff", "rigid", "noise of 0.1 s, drift of 50 mN/s", 0))
    assert found.allowed == 1.0
    assert found.share_of_f_lim < 1.0
    assert found.ended in ("R6", "not_open")


def test_channels_that_die_and_drift_lead_no_arm_on_that_stands() -> None:
    """7 times F_lim without the look at the drift."""
    found = run(Case("UR, softer", "rigid", "drift of 0.2 N/s", 0))
    assert found.allowed == 2.0
    assert found.share_of_f_lim < 1.0


@pytest.mark.parametrize(
    ("share", "held"), [(0.15, False), pytest.param(ANSWER_SHARE, True, marks=pytest.mark.long)]
)
def test_a_channel_that_lost_its_gain_beside_a_dead_one_is_no_payload_that_answers(
    share: float, held: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pressing, "ANSWER_SHARE", share)
    believed.cache_clear()
    found = run(Case("UR, hard", "as planned", "a tenth of its gain", 0))
    believed.cache_clear()
    assert (found.share_of_limit < 0.5) == held


def test_a_dead_channel_may_rise_in_steps_sway_wander_or_keep_a_part_of_its_gain() -> None:
    steps = shown(Death(step_n=1.0))
    assert [steps[100], steps[-1]] == [pytest.approx(100.0, abs=1.0), pytest.approx(101.0, abs=1.0)]
    assert len({round(each, 6) for each in steps[101:]}) == 2
    assert max(shown(Death(sway_n=2.0))[100:]) == pytest.approx(101.9, abs=0.2)
    assert len(set(shown(Death(walk_n=0.1))[100:])) == 200
    assert shown(Death(gain=0.1))[-1] == pytest.approx(100.0 + 0.1 * 199.0, abs=0.2)
