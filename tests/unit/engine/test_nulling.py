"""Force across the approach is taken off by going sideways: stable, bounded, ended when wrong."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np
import pytest
from course_feed import Stage

from stepload.engine.nulling import Nulling as Nuller
from stepload.engine.nulling import nulled
from stepload.engine.watch import ForceWatch
from stepload.feasibility.aligning import NullingLaw
from stepload.rig.samples import ForceSample

LAW = NullingLaw(1e5, 0.2, 3e-4, 1e-3, 3.0, 0.3, 2.0, 0.0)
STEP_S = 0.002


def test_the_speed_is_force_over_stiffness_and_time_constant() -> None:
    x_m, y_m = nulled((0.0, 0.0), (2.0, -1.0), LAW, STEP_S)
    assert (x_m, y_m) == pytest.approx((-2e-4 * 1e-3, 1e-4 * 1e-3))


def test_what_is_below_the_noise_is_left_alone() -> None:
    assert nulled((1e-5, 2e-5), (0.2, 0.2), LAW, STEP_S) == (1e-5, 2e-5)


def test_it_is_never_faster_or_further_than_allowed() -> None:
    x_m, y_m = nulled((0.0, 0.0), (300.0, 400.0), LAW, STEP_S)
    assert math.hypot(x_m, y_m) == pytest.approx(1e-3 * STEP_S)
    shift = (-2.999e-4, 0.0)
    for _ in range(1000):
        shift = nulled(shift, (50.0, 5.0), LAW, STEP_S)
        assert math.hypot(*shift) <= LAW.largest_m * (1.0 + 1e-12)


def closed_loop(stiffness: float, delay_s: float, time_constant_s: float = 0.2) -> np.ndarray:
    """Force across over 4 s on a spring, with a delay and a servo lag of 10 ms, from 5 N on."""
    law = replace(LAW, time_constant_s=time_constant_s, dead_n=0.0, fastest_m_s=1.0, largest_m=1.0)
    late = deque([0.0] * round(delay_s / STEP_S))
    shift, at_m, forces = (0.0, 0.0), 0.0, []
    for _ in range(2000):
        force_n = 5.0 + stiffness * at_m
        forces.append(force_n)
        shift = nulled(shift, (force_n, 0.0), law, STEP_S)
        late.append(shift[0])
        at_m += (1.0 - math.exp(-STEP_S / 0.01)) * (late.popleft() - at_m)
    return np.array(forces)


@pytest.mark.parametrize("times", [0.3, 1.0, 3.0])
def test_it_is_stable_up_to_three_times_the_believed_stiffness(times: float) -> None:
    forces = np.abs(closed_loop(times * LAW.stiffness_n_per_m, 0.02))
    assert forces.max() <= 5.0 + 1e-9
    assert forces[-500:].max() < 5.0 * math.exp(-times * 3.0 / 0.2) + 0.05
    second = round(1.0 / STEP_S)
    assert all(forces[i + second] <= forces[i] + 1e-9 for i in range(len(forces) - second))


def test_a_force_that_grows_ends_it_at_once_and_for_the_run() -> None:
    """On a spring, with the sensor the wrong way round."""
    stage = Stage()
    course, sup = stage.course, stage.sup
    sup.smooth_n, sup.force.load_across_n = 10.0, (5.0, 0.0)
    part = Nuller(course, LAW)
    stage.begin(part.null())
    sizes = []
    for _ in range(1000):
        sup.force.load_across_n = (5.0 - 1e5 * course.shift_m[0], 0.0)
        sizes.append(sup.force.load_across_n[0])
        stage.ticks()
        if stage.then:
            break
    assert stage.find("nulled")["why"] == "grown"
    assert max(sizes) < 6.0
    stage.begin(part.null())
    assert len(stage.then) == 2


@pytest.mark.parametrize(
    ("axis", "places"), [("+fz", (0, 1)), ("+fx", (1, 2)), ("+fy", (2, 0)), ("-fz", (0, 1))]
)
def test_the_axes_across_follow_the_pressing_axis_in_order(
    axis: str, places: tuple[int, int]
) -> None:
    watch = ForceWatch(
        "force", axis, full_scale_n=1e3, stale_s=1.0, identical_counts=0, clock_s=1.0
    )
    wrench = [0.0] * 6
    sign = -1.0 if axis[0] == "-" else 1.0
    wrench[places[0]], wrench[places[1]] = 2.0 * sign, 3.0 * sign
    watch.take([ForceSample(1, 0.0, 0.0, 0, tuple(wrench), 20.0)], 0.0)  # type: ignore[arg-type]
    assert watch.load_across_n == (2.0, 3.0)
