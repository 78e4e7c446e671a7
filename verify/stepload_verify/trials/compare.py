"""How often is a comparison right? Groups of runs on simulated rigs of the STVF kind.

Quasi-static: a payload F = K δ^1.5 is pressed to 300 N through a system whose believed K_s is 1 %
off, with a force gain 0.5 % off and a smooth error of travel of 0.54 µm that belongs to the place
of the travel; a tenth of its variance does not repeat. Every run has its own noise (0.2 µm, 0.7 N),
quanta (2 µm, 1.5 N) and surface (± 1 µm). Of every run the chord of its loading goes through
`stepload.identification.difference`.

Required: the interval covers the true ratio in at least 93 of 100 (of 1,000 trials the count has a
standard deviation of 0.7), equal payloads are called different in at most 7 of 100, and a payload
that is stiffer by the smallest detectable difference is told apart in at least 75 of 100. Exempt is
one repeat in all (2 runs against 1) of a payload whose own scatter no budget knows of: one repeat
cannot show it.
Run: python -m stepload_verify.trials.compare [trials]
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stepload.identification.conditions import Conditions, Sources
from stepload.identification.difference import Agreement, Difference, Measured, difference
from stepload.identification.fit import FloatArray
from stepload.identification.loops import Track
from stepload.identification.origin import REPEATS, Origin
from stepload.identification.run_data import RunData
from stepload.identification.verdict import judge

N = 1.5
K = 6.57e8
TOP_N, TOUCH_N = 300.0, 4.0
CHORD_N = 30.0, 290.0
POINTS, TIME_S = 400, 30.0
REACH_M = 50.0 * (1.0 / 3.49e6 + 60e-6 / 300.0)
SOURCES = Sources(
    3.49e6,
    system_stiffness_sigma_n_per_m=3.49e4,
    smooth_error_m=0.54e-6,
    smooth_length_n=50.0,
    force_noise_n=0.7,
    force_resolution_n=1.5,
    position_noise_m=0.2e-6,
    position_resolution_m=2e-6,
    gain_sigma=0.005,
)
_WAVES = 40


@dataclass(frozen=True, slots=True)
class SimulatedRig:
    """One rig with its true errors, which its runs do not know.

    `waves` (3, W) are amplitude, wave number and phase of its smooth error over the travel.
    """

    name: str
    stiffness_n_per_m: float
    gain: float
    waves: FloatArray

    def travel_error_m(self, place_m: FloatArray) -> FloatArray:
        """Smooth error (N,) at these places of the travel."""
        return _of_waves(self.waves, place_m)


def _draw_waves(rng: np.random.Generator, sigma_m: float) -> FloatArray:
    """Waves that make a random error with the squared-exponential correlation over the travel."""
    return np.stack(
        [
            np.full(_WAVES, sigma_m * math.sqrt(2.0 / _WAVES)),
            rng.standard_normal(_WAVES) / REACH_M,
            rng.uniform(0.0, 2.0 * np.pi, _WAVES),
        ]
    )


def _of_waves(waves: FloatArray, place_m: FloatArray) -> FloatArray:
    amplitude, number, phase = waves
    return np.asarray(np.cos(np.outer(place_m, number) + phase) @ amplitude)


def draw_rig(name: str, rng: np.random.Generator) -> SimulatedRig:
    """Draw a rig whose errors have the sizes that its runs state.

    K_s was measured with the same force sensor, so that its gain cancels in F/K_s.
    """
    believed = SOURCES.system_stiffness_n_per_m
    assert believed is not None
    relative = SOURCES.system_stiffness_sigma_n_per_m / believed
    gain = 1.0 + SOURCES.gain_sigma * rng.standard_normal()
    return SimulatedRig(
        name=name,
        stiffness_n_per_m=believed / (gain * (1.0 + relative * rng.standard_normal())),
        gain=gain,
        waves=_draw_waves(rng, math.sqrt(REPEATS) * SOURCES.smooth_error_m),
    )


def press(
    rig: SimulatedRig,
    k: float,
    rng: np.random.Generator,
    *,
    surface_m: float = 5e-3,
    pose: str = "bench",
    unknown_sigma: float = 0.0,
    own_travel: float | None = None,
) -> Measured:
    """One run: the chord of its loading with its budget.

    Args:
        rig: the rig that presses.
        k: K of the payload's law.
        rng: draws what differs from run to run.
        surface_m: where the surface is; each run adds 1 µm (sd).
        pose: name of the pose in the plan; "" where it has none.
        unknown_sigma: relative standard deviation of the payload from run to run, which no budget
            knows of.
        own_travel: size of a smooth error drawn for this run alone, over the stated one; None: the
            rig's smooth error.
    """
    k = k * math.exp(N * unknown_sigma * rng.standard_normal())
    force = np.linspace(0.0, TOP_N, POINTS + 1)[1:]
    surface_m = surface_m + 1e-6 * rng.standard_normal()
    place = surface_m + (force / k) ** (1.0 / N) + force / rig.stiffness_n_per_m
    own = _draw_waves(rng, math.sqrt(1.0 - REPEATS) * SOURCES.smooth_error_m)
    travel_error = rig.travel_error_m(place) + _of_waves(own, place)
    if own_travel is not None:
        waves = _draw_waves(rng, own_travel * SOURCES.smooth_error_m)
        travel_error = _of_waves(waves, place)
    seen = place + travel_error
    travel = _rounded(seen + SOURCES.position_noise_m * rng.standard_normal(POINTS),
                      SOURCES.position_resolution_m)  # fmt: skip
    read = _rounded(rig.gain * force + SOURCES.force_noise_n * rng.standard_normal(POINTS),
                    SOURCES.force_resolution_n)  # fmt: skip
    touch = int(np.argmax(read >= TOUCH_N))
    travel, read = travel[touch:], read[touch:]
    assert SOURCES.system_stiffness_n_per_m is not None
    held = np.zeros(read.size, dtype=np.intp)
    loading = Track(np.linspace(0.0, TIME_S, POINTS)[touch:], read, travel - travel[0], held)
    told = Conditions(SOURCES, TOP_N, TOUCH_N, SOURCES.position_resolution_m)
    run = RunData([(1, loading, None)], told, between_n=CHORD_N)
    figure = judge(run, laws=False).headline
    assert figure is not None
    return Measured(
        run=rig.name,
        figure=figure,
        origin=Origin(
            rig=rig.name,
            arm=f"axis of {rig.name}",
            force_sensor=f"sensor of {rig.name}",
            axis="+fz",
            pose=pose,
            kinematics="" if own_travel is None else f"draw {waves[2, 0]}",
            calibration=rig.name,
            stiffness_n_per_m=(
                SOURCES.system_stiffness_n_per_m,
                SOURCES.system_stiffness_sigma_n_per_m,
            ),
            surface_m=float(travel[0]),
            reach_m=REACH_M,
        ),
    )


def _rounded(values: FloatArray, quantum: float) -> FloatArray:
    return np.asarray(np.round(values / quantum) * quantum)


@dataclass(frozen=True, slots=True)
class World:
    """The conditions under which two groups of runs are made.

    Attributes:
        says: the world in words.
        ratio: true stiffness of the second group's payload over that of the first's.
        runs: how many runs each group has.
        rigs: 1, or 2 for a rig of its own for each group.
        apart_m: how far the second surface is from the first.
        pose: name of the pose in the plans.
        unknown_sigma: spread of the payload from run to run that no budget knows of.
        own_travel: size of the smooth error over the stated one where it is each run's own.
        tolerance: the difference that matters.
    """

    says: str
    ratio: float = 1.0
    runs: tuple[int, int] = (3, 3)
    rigs: int = 1
    apart_m: float = 0.0
    pose: str = "bench"
    unknown_sigma: float = 0.0
    own_travel: float | None = None
    tolerance: float = 0.2


WORLDS = (
    World("equal payloads"),
    World("5 % stiffer", 1.05),
    World("5 % softer", 1.0 / 1.05),
    World("equal, 1 run against 1", runs=(1, 1)),
    World("5 % stiffer, 1 against 1", 1.05, runs=(1, 1)),
    World("equal, 2 against 1", runs=(2, 1)),
    World("equal, surface 0.5 mm away", apart_m=0.5e-3),
    World("5 % stiffer, 0.5 mm away", 1.05, apart_m=0.5e-3),
    World("equal, surface 15 µm away", apart_m=15e-6),
    World("twice as stiff", 2.0),
    World("equal, two rigs", rigs=2),
    World("5 % stiffer, two rigs", 1.05, rigs=2),
    World("equal, pose not named", pose=""),
    World("5 % stiffer, pose not named", 1.05, pose=""),
    World("equal, runs scatter by 2 %", unknown_sigma=0.02),
    World("5 % stiffer, scatter of 2 %", 1.05, unknown_sigma=0.02),
    World("equal, 2 against 1, scatter of 2 %", runs=(2, 1), unknown_sigma=0.02),
    World("equal, own travel errors", own_travel=1.0),
    World("equal, a third as large as stated", own_travel=0.35),
    World("5 % stiffer, a third as large", 1.05, own_travel=0.35),
    World("equal, asked for 1 %", tolerance=0.01),
)


def compared(world: World, rng: np.random.Generator) -> Difference:
    """One comparison in a world, on rigs drawn anew."""
    first, second = _groups(world, rng)
    return difference(first, second, tolerance=world.tolerance)


def _groups(world: World, rng: np.random.Generator) -> tuple[list[Measured], list[Measured]]:
    rigs = [draw_rig(f"rig {i + 1}", rng) for i in range(world.rigs)]

    def group(count: int, rig: SimulatedRig, ratio: float, surface_m: float) -> list[Measured]:
        return [
            press(
                rig, K * ratio**N, rng, surface_m=surface_m, pose=world.pose,
                unknown_sigma=world.unknown_sigma, own_travel=world.own_travel,
            )
            for _ in range(count)
        ]  # fmt: skip

    one, other = world.runs
    return (
        group(one, rigs[0], 1.0, 5e-3),
        group(other, rigs[-1], world.ratio, 5e-3 + world.apart_m),
    )


@dataclass(frozen=True, slots=True)
class Tally:
    """Shares of the verdicts of many comparisons, and medians of the stated widths."""

    agree: float
    differ: float
    cannot_tell: float
    covered: float
    half_width: float
    smallest: float


def tally(world: World, trials: int, seed: int) -> Tally:
    """Compare `trials` times in one world."""
    rng = np.random.default_rng(seed)
    found = [compared(world, rng) for _ in range(trials)]
    return tally_of(found, world.ratio)


def tally_of(found: Sequence[Difference], ratio: float) -> Tally:
    """Count the verdicts of comparisons whose true ratio is `ratio`."""
    said = [each.verdict for each in found]
    inside = [each.interval[0] <= ratio - 1.0 <= each.interval[1] for each in found]
    return Tally(
        agree=said.count(Agreement.AGREE) / len(said),
        differ=said.count(Agreement.DIFFER) / len(said),
        cannot_tell=said.count(Agreement.CANNOT_TELL) / len(said),
        covered=float(np.mean(inside)),
        half_width=float(np.median([each.half_width for each in found])),
        smallest=float(np.median([each.smallest_detectable for each in found])),
    )


def main() -> None:
    """Print a line for every world, and one for a difference as small as can be seen."""
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    print(f"{trials} comparisons in each world; 3 runs against 3 where nothing else is said")
    print(f"{'world':36s} agree differ cannot  covered  half width  could show (medians)")
    seen = 0.0
    for seed, world in enumerate(WORLDS):
        found = tally(world, trials, seed)
        seen = seen or found.smallest
        _print(world.says, found)
    least = replace(WORLDS[0], says=f"{seen:.1%} stiffer: the smallest", ratio=1.0 + seen)
    _print(least.says, tally(least, trials, len(WORLDS)))


def _print(says: str, found: Tally) -> None:
    print(
        f"{says:36s} {found.agree:5.3f}  {found.differ:5.3f}  {found.cannot_tell:5.3f}    "
        f"{found.covered:5.3f}     ±{found.half_width:6.2%}     {found.smallest:6.2%}"
    )


if __name__ == "__main__":
    main()
