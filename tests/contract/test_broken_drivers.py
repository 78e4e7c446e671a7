"""Every broken driver is refused by the check that is meant for it, with the reason."""

import math
from dataclasses import replace

import broken
import pytest
from virtual import SIX_AXES, SPEC, Virtual

from stepload.rig.contract import CHECKS, CheckStatus, run_check, run_trial
from stepload.rig.contract_arm import check_motion, check_shift
from stepload.rig.contract_life import check_lost_link, check_stale
from stepload.rig.contract_samples import check_frozen, check_samples, equal_readings_limit
from stepload.rig.faults import FaultCode

FORCE = [
    ("swallows_unknown_options", "options", "unknown option 'no_such_option'"),
    ("works_in_the_constructor", "unopened", "only `open` may"),
    ("has_samples_before_open", "unopened", "drain() before open() gave samples"),
    ("open_exceeds_its_deadline", "open", "open(5.0) took 10.0 s"),
    ("leaks_when_open_fails", "failing_open", "left open after a failed open"),
    ("close_leaks_a_thread", "close", "left open after close(): ['thread left behind"),
    ("opens_only_once", "reopen", "the second open() after close() failed"),
    ("safe_always_refuses", "safe", "the first safe() of a sound device failed"),
    ("safe_works_once", "safe", "the second safe() of a sound device failed"),
    ("safe_crashes_before_open", "safe", "AttributeError"),
    ("repeats_a_sample", "samples", "repeated or out of order"),
    ("loses_unnoticed", "samples", "lost samples, health only 0"),
    ("faults_by_itself", "samples", "a fault while watching: corrupt"),
    ("miscounts", "samples", "samples delivered, health counts"),
    ("gives_plain_tuples", "samples", "drain() gave tuple, not ForceSample"),
    ("gives_one_axis_only", "samples", "a wrench of 1 values"),
    ("receive_time_goes_back", "samples", "receive time went back"),
    ("passes_nan_on", "samples", "not finite has status 0"),
    ("stamps_at_drain", "stamps", "when they are drained, not when they arrive"),
    ("stamps_in_the_future", "stamps", "s in the future"),
    ("drain_waits_for_data", "drain", "it waits"),
    ("frozen_force", "frozen", "equal to the last bit"),
    ("force_in_millinewton", "load", "1e+03 times as much"),
    ("ignores_the_zero", "bias", "still reads"),
    ("never_stale", "stale", "never stale"),
    ("goes_on_repeating", "stale", "old values in the place of missing ones"),
    ("forgets_its_fault", "stale", "not latched"),
    ("safe_crashes_without_link", "lost_link", "safe() after the link was lost raised OSError"),
    ("safe_blocks_without_link", "lost_link", "safe() after the link was lost took 30.0 s"),
    ("close_crashes_without_link", "lost_link", "close() after the link was lost raised OSError"),
]
GAUGE = [
    ("gauge_in_millimetres", "load", "1e+03 times as much"),
    ("stamps_at_drain", "stamps", "when they are drained"),
]
ARM = [
    ("swallows_unknown_options", "options", "unknown option"),
    ("close_leaks_a_thread", "close", "thread left behind"),
    ("stamps_at_drain", "stamps", "when they are drained"),
    ("stamps_in_the_future", "stamps", "s in the future"),
    ("drain_waits_for_data", "drain", "it waits"),
    ("gives_a_pose_of_three", "samples", "a pose of 3 values"),
    ("has_no_force_but_says_so", "samples", "not finite has status 0"),
    ("never_stale", "stale", "never stale"),
    ("goes_on_repeating", "stale", "old values in the place of missing ones"),
    ("safe_works_once", "safe", "the second safe()"),
    ("safe_crashes_without_link", "lost_link", "raised OSError"),
    ("safe_blocks_without_link", "lost_link", "took 30.0 s"),
    ("command_blocks_without_link", "lost_link", "command() after the link was lost took"),
    ("moves_after_open", "rest", "first second after the first open() the arm went 1."),
    ("moves_before_open_returns", "rest", "after close() and a second open() the arm stands 1.5"),
    ("close_leaves_a_target", "rest", "0.9"),
    ("takes_nan", "targets", "command(nan) was accepted"),
    ("moves_on_a_refused_target", "targets", "after refused targets"),
    ("retracts_forth", "targets", "retract(-0.001 m) was accepted"),
    ("tells_nothing_of_where_it_is_held", "motion", "held at rest: nan mm"),
    ("frozen_position", "motion", "the measured position is frozen"),
    ("reversed_position", "motion", "the measured position has the wrong sign"),
    ("stops_short", "motion", "target: 0.8000 mm, expected 1.0000 mm"),
    ("does_not_hold", "motion", "position held"),
    ("retract_does_nothing", "motion", "retracted"),
    ("retracts_too_fast", "motion", "retract() at 10 mm/s went at"),
    ("safe_does_nothing", "stop", "safe() does not stop the arm"),
    ("safe_waits_for_the_target", "stop", "0.000 mm of it after safe() had returned"),
]
SHIFTED = [
    ("shift_takes_nan", "a shift of (nan, 0.0) m was accepted"),
    ("shift_is_not_bounded", "a shift of (0.02, 0.0) m was accepted"),
    ("ignores_the_shift", "it is ignored, or in another unit"),
    ("shift_in_another_frame", "no right-handed frame"),
    ("shift_moves_the_axis", "the position along the approach went"),
    ("retract_drops_the_shift", "it must keep the shift"),
]
WRENCH = [
    ("tells_its_wrench_in_another_frame", "the wrench is not in the pressing frame"),
]

ROWS = [(kind, *row) for kind, rows in
        (("force", FORCE), ("displacement", GAUGE), ("arm", ARM)) for row in rows]  # fmt: skip


@pytest.fixture(autouse=True)
def _no_thread_stays():
    yield
    broken.end_leaked_threads()


def failed(which, name):
    results = run_trial(Virtual(which, getattr(broken, name)).trial())
    return {r.name: r.message for r in results if r.status is CheckStatus.FAILED}


@pytest.mark.parametrize(("which", "name", "check", "reason"), ROWS)
def test_a_broken_driver_is_refused_with_the_reason(which, name, check, reason):
    (meant,) = (each for each in CHECKS if each.__name__ == f"check_{check}")
    result = run_check(meant, Virtual(which, getattr(broken, name)).trial())
    assert (result.status, reason in result.message) == (CheckStatus.FAILED, True), result


@pytest.mark.parametrize(("name", "reason"), SHIFTED)
def test_an_arm_that_shifts_otherwise_than_it_says_is_refused(name, reason):
    trial = Virtual("arm", getattr(broken, name), spec=SIX_AXES).trial()
    assert reason in run_check(check_shift, trial).message


@pytest.mark.parametrize(("name", "reason"), WRENCH)
def test_an_arm_that_tells_another_wrench_than_it_says_is_refused(name, reason):
    trial = Virtual("arm", getattr(broken, name), spec=SIX_AXES).trial()
    assert reason in run_check(check_samples, trial).message


@pytest.mark.parametrize("spec", [SPEC, SIX_AXES], ids=["one axis", "six axes"])
@pytest.mark.parametrize("which", ["force", "displacement", "arm"])
def test_the_healthy_driver_passes_and_what_was_not_tried_is_said(which, spec):
    results = run_trial(Virtual(which, spec=spec).trial())
    assert [r for r in results if r.status is CheckStatus.FAILED] == []
    assert all(r.message for r in results if r.status is CheckStatus.SKIPPED)


def test_an_arm_on_a_leash_is_kept_alive_as_a_run_would():
    assert failed("arm", "on_a_leash") == {}


def test_an_arm_that_falls_silent_says_why():
    """A fault before the motion ends is told, not only that there are no samples."""

    def breaks(healthy):
        def command(self, position_m):
            self._stream.latch(FaultCode.PROGRAM_STOPPED, "for a reason", 0.0)
            healthy.command(self, position_m)

        def drain(self):
            return [] if healthy.fault(self) else healthy.drain(self)

        return type("Broken", (healthy,), {"command": command, "drain": drain})

    result = run_check(check_motion, Virtual("arm", breaks).trial())
    assert "no samples: program_stopped: sim arm: for a reason" in result.message


@pytest.mark.parametrize(
    ("noise", "resolution", "limit"),
    [(1.0, 1.0, 25), (1.0, 0.0, 25), (0.25, 1.0, 447), (0.0, 1.0, math.inf), (0.01, 1.0, math.inf)],
)
def test_how_many_equal_readings_a_living_sensor_may_show(noise, resolution, limit):
    """The chance of a row of N in the middle of a step, σ = q/4: erf(√2)^(N−1) < 1e-9."""
    assert equal_readings_limit(noise, resolution) == limit


def frozen_of(which, name, noise, resolution):
    trial = Virtual(which, getattr(broken, name, lambda healthy: healthy)).trial()
    return run_check(check_frozen, replace(trial, noise=noise, resolution=resolution))


def test_a_force_sensor_of_unknown_noise_may_not_freeze_and_the_assumption_is_said():
    result = frozen_of("force", "frozen_force", None, 0.0)
    assert result.status is CheckStatus.FAILED
    assert "assumed: noise as large as the resolution" in result.message


def test_a_sensor_that_may_repeat_itself_is_not_judged():
    assert frozen_of("force", "healthy", 1e-3, 0.05).status is CheckStatus.SKIPPED


def test_silence_that_comes_too_late_proves_nothing(monkeypatch):
    monkeypatch.setattr("stepload.rig.contract_life.UNDRAINED_S", -1.0)
    for check in (check_stale, check_lost_link):
        result = run_check(check, Virtual("force").trial())
        assert (result.status, "try again" in result.message) == (CheckStatus.SKIPPED, True)
