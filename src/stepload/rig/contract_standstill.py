"""The check that nothing moves an arm but its commands: it stands still over an open and a close.

It moves no arm, and is done without leave to. What an arm does before the first `open` is back
cannot be seen there; that it does it again at the second one, can.
"""

from __future__ import annotations

import itertools
import math
import statistics
from contextlib import closing

from stepload.rig.contract_trial import (
    MIN_SAMPLES,
    POLL_S,
    ContractViolation,
    SkippedCheck,
    Trial,
    drain,
    require,
)
from stepload.rig.device import Arm
from stepload.rig.samples import ArmSample

Place = tuple[float, ...]
"""Place of the TCP in m, and position along the approach: one of them may begin anew at `open`."""

WATCH_S = 1.0
CLOSED_S = 0.5
STILL_M = 1e-4
"""No arm that stands comes back less exactly; noise and resolution are added."""
SIGMAS = 6.0
SIGMA_OF_STEP = 1.05
"""Standard deviation over the median step from one sample to the next, of normal noise."""


def check_rest(trial: Trial) -> str:
    """Neither `open` nor `close` moves an arm: it stands where it stood, and goes on standing."""
    arm = trial.make()
    if not isinstance(arm, Arm):
        raise SkippedCheck("only arms move")
    with closing(arm):
        arm.open(trial.open_timeout_s)
        first = _watched(arm, trial)
        limit_m = _limit_m(first, trial)
        _require_still("the first open()", first, limit_m)
        arm.close()
        trial.wait(CLOSED_S)
        arm.open(trial.open_timeout_s)
        second = _watched(arm, trial)
        _require_still("the second open()", second, limit_m)
    went_m = _apart_m(_mean(second), _mean(first))
    require(
        went_m <= limit_m,
        f"after close() and a second open() the arm stands {went_m * 1e3:.3f} mm from where it "
        f"stood before, {_because(limit_m)}: one of the two moves it, and nobody commanded that",
    )
    return f"{went_m * 1e3:.3f} mm apart after close() and open() (limit {limit_m * 1e3:.3f} mm)"


def _watched(arm: Arm, trial: Trial) -> list[Place]:
    """Where the arm is during the first second after an open."""
    samples = drain(arm)
    end_s = trial.now_s() + max(WATCH_S, MIN_SAMPLES * arm.period_s)
    while trial.now_s() < end_s:
        trial.wait(POLL_S)
        samples += drain(arm)
        if fault := arm.fault():
            raise ContractViolation(f"a fault at rest: {fault.code}: {fault.message}")
    require(len(samples) >= MIN_SAMPLES, f"only {len(samples)} samples at rest")
    return [(*s.pose[:3], s.position_m) for s in samples if isinstance(s, ArmSample)]


def _limit_m(places: list[Place], trial: Trial) -> float:
    """How far readings of an arm at rest may be apart. A slow move does not look like noise."""
    noise_m = trial.noise
    if noise_m is None:
        steps = [
            [abs(new - old) for old, new in itertools.pairwise(axis)]
            for axis in zip(*places, strict=True)
        ]
        noise_m = SIGMA_OF_STEP * max(statistics.median(axis) for axis in steps)
    return STILL_M + SIGMAS * noise_m + trial.resolution


def _require_still(since: str, places: list[Place], limit_m: float) -> None:
    begin = _mean(places[:MIN_SAMPLES])
    went_m = max(_apart_m(place, begin) for place in places)
    require(
        went_m <= limit_m,
        f"in the first second after {since} the arm went {went_m * 1e3:.3f} mm, "
        f"{_because(limit_m)}: open() moves it before anything supervises it",
    )


def _because(limit_m: float) -> str:
    return f"{limit_m * 1e3:.3f} mm is what noise and resolution explain"


def _mean(places: list[Place]) -> Place:
    return tuple(math.fsum(axis) / len(places) for axis in zip(*places, strict=True))


def _apart_m(one: Place, other: Place) -> float:
    return max(math.dist(one[:3], other[:3]), abs(one[3] - other[3]))
