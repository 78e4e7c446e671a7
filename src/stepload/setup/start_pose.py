"""The start pose to which the arm was led, and the proof that the way behind it is free."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from stepload.errors import RefusedError
from stepload.identification.fit import FloatArray
from stepload.plan.tree import resolve
from stepload.setup.bench import (
    FORCE,
    Bench,
    Setup,
    listen,
    refuse_faults,
    refuse_flagged,
    say_hazards,
)
from stepload.setup.state import Found
from stepload.setup.yaml_keys import Value, quoted

OFF_THE_TOOL_RAD = math.radians(5.0)
SPEED_M_S = 4e-3
LONGEST_BACK_M = 0.02
REST_S, AT_REST_S = 1.0, 0.3
LEAST_STOP_N, NOISE_TIMES = 5.0, 10.0
LATE_M = 2e-3
AT_START_M, AT_START_RAD = 5e-4, math.radians(1.0)
POSE = "pose"
BACK_AGAIN_M = 2e-4


def start(setup: Setup) -> Found:
    """Where the arm was led; its tool must point along the approach direction."""
    values = setup.state.values
    setup.tell(
        "the pose decides how stiff the arm is, and a calibration holds in its own pose only:"
        " `stepload pose` ranks the poses of an arm; leave with Ctrl+C to ask it first"
    )
    setup.tell(
        "lead the arm by hand (local control, freedrive) to the start pose: above the plate, the"
        " tool pointing at it, a few millimetres of free air between; then give it back to the"
        " program (remote control)"
    )
    setup.answers.consent("led_to_start")
    with setup.opened(values, False) as bench:
        pose = listen(bench, AT_REST_S).arm[-1].pose
        told = bench.arm.configuration()
    approach = _approach(values)
    tool = _turn(pose)[:, 2]
    if approach is None:
        setup.tell("this driver has no approach direction to compare with the tool")
    elif not (off_rad := _angle_rad(tool, approach)) <= OFF_THE_TOOL_RAD:
        shown = ", ".join(f"{part:.3f}" for part in tool)
        raise RefusedError(
            f"the approach direction is {math.degrees(off_rad):.0f} degrees off the z axis of the"
            f" tool, at most {math.degrees(OFF_THE_TOOL_RAD):.0f} are taken",
            hint=f"lead the tool along the approach; or, where the pose is right: --approach"
            f" '[{shown}]' --redo arm",
        )
    else:
        setup.tell(
            f"the approach direction {list(approach)}, base frame, is the tool's within"
            f" {math.degrees(off_rad):.1f} degrees"
        )
    setup.answers.consent("towards_plate")
    notes = [f"start pose (TCP, base frame; m and rad): {_numbers(pose)}"]
    if told is not None and told.joints_rad is not None:
        notes.append(f"start pose (joints, rad): {_numbers(told.joints_rad)}")
    return Found({}, notes, {POSE: " ".join(map(repr, pose))})


def stands_at_start(setup: Setup) -> None:
    """Refuse to go on from elsewhere than where the arm was led: the plate is as far from there.

    Raises:
        RefusedError: it stands elsewhere.
    """
    led = tuple(map(float, setup.state.done["start"].facts[POSE].split()))
    with setup.opened(setup.state.values, False) as bench:
        pose = listen(bench, AT_REST_S).arm[-1].pose
    off_m = math.dist(pose[:3], led[:3])
    off_rad = _arccos(0.5 * (float(np.sum(_turn(pose) * _turn(led))) - 1.0))
    if not (off_m <= AT_START_M and off_rad <= AT_START_RAD):
        raise RefusedError(
            f"the arm stands {1e3 * off_m:.2f} mm and {math.degrees(off_rad):.1f} degrees from"
            f" the start pose it was led to, at most {1e3 * AT_START_M:g} mm and"
            f" {math.degrees(AT_START_RAD):.0f} degrees are taken",
            hint="--redo start, with the arm led to its start pose",
        )


def _turn(pose: Sequence[float]) -> FloatArray:
    """Rotation matrix (3, 3) of a pose's rotation vector: tool coordinates to those of the base."""
    return Rotation.from_rotvec(np.array(pose[3:], dtype=float)).as_matrix()


def _arccos(cosine: float) -> float:
    return math.acos(float(np.clip(cosine, -1.0, 1.0)))


def _angle_rad(tool: FloatArray, approach: Sequence[float]) -> float:
    """Angle between the z axis of the tool, a unit vector, and the approach, in the base frame."""
    direction = np.array(approach, dtype=float)
    return _arccos(float(tool @ direction / np.linalg.norm(direction)))


def _approach(values: dict[str, Value]) -> tuple[float, ...] | None:
    text = values.get("arm.options.approach", Value("", "")).text.strip("[]")
    return tuple(float(resolve(part.strip()) or 0.0) for part in text.split(",")) if text else None


def _numbers(numbers: tuple[float, ...]) -> str:
    return f"[{', '.join(f'{number:.5f}' for number in numbers)}]"


def way(setup: Setup) -> Found:
    """The arm backs away slowly and comes back, watched by its force channel: the way is free.

    It never goes further than where it was led to. The person has confirmed the hazards.
    """
    say_hazards(setup, "before the arm moves for the first time:")
    reader = setup.answers.text("hazards_read_by")
    back_m = setup.answers.quantity("back", "m")
    if back_m > LONGEST_BACK_M:
        raise RefusedError(
            f"--back {1e3 * back_m:g} mm: at most {1e3 * LONGEST_BACK_M:g} mm are tried unseen",
            hint="lead the arm nearer",
        )
    setup.answers.consent("may_back")
    with setup.opened(setup.state.values, True) as bench:
        most_n = back_and_forth(bench, back_m)
    note = f"free way: {1e3 * back_m:g} mm back and again to the start, force within {most_n:.1f} N"
    setup.tell(note)
    return Found(
        {
            "hazards_read_by": Value(quoted(reader), setup.you),
            "hazards_read_on": Value(setup.today.isoformat(), setup.you),
        },
        (note,),
    )


def back_and_forth(bench: Bench, back_m: float) -> float:
    """Move back by `back_m` and return; the largest change of force on the way, in N.

    Raises:
        RefusedError: something was in the way, or the arm did not follow; it was stopped.
        DeviceError: a device failed; the caller stops the arm.
    """
    received = listen(bench, REST_S)
    rest_n = received.forces_n(FORCE)
    mean_n = rest_n.mean(axis=0)
    stop_n = max(LEAST_STOP_N, NOISE_TIMES * float(rest_n.std(axis=0).max()))
    start_m = received.arm[-1].position_m
    seconds = back_m / SPEED_M_S
    clock, largest_n = bench.clock, 0.0
    began_s = clock.now_s()
    position_m = start_m
    while (time_s := clock.now_s() - began_s) < 2.0 * seconds + AT_REST_S:
        away_m = back_m - abs(back_m - SPEED_M_S * min(time_s, 2.0 * seconds))
        bench.arm.command(start_m - away_m)
        clock.sleep_until(clock.now_s() + bench.arm.period_s)
        for sample in bench.arm.drain():
            position_m = sample.position_m
        samples = bench.sensors[FORCE].drain()
        refuse_faults(bench)
        refuse_flagged(FORCE, samples)
        felt = [sample.wrench[:3] for sample in samples]
        if felt:
            largest_n = max(largest_n, float(np.abs(np.mean(felt, axis=0) - mean_n).max()))
        late_m = abs(position_m - (start_m - away_m))
        if largest_n > stop_n or late_m > LATE_M:
            bench.arm.safe(REST_S)
            raise RefusedError(
                f"stopped {1e3 * (start_m - position_m):.1f} mm behind the start: the force changed"
                f" by {largest_n:.1f} N (limit {stop_n:.1f} N), the arm is {1e3 * late_m:.1f} mm"
                f" from where it was sent (limit {1e3 * LATE_M:g} mm)",
                hint="is something in the way, does a cable pull, did the start pose touch?",
            )
    position_m = listen(bench, AT_REST_S).arm[-1].position_m  # not one from before a stall
    if abs(position_m - start_m) > BACK_AGAIN_M:
        raise RefusedError(
            f"the arm stands {1e3 * (position_m - start_m):+.2f} mm from its start after the way"
            " back and forth",
            hint="see the pendant; does the arm follow?",
        )
    return largest_n
