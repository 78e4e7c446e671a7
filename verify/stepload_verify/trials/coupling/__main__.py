"""Bias and coverage with one number and with three, of arms that friction at the contact stiffens.

    python -m stepload_verify.trials.coupling [--poses 20] [--seed 1]

Every cell has `--poses` tool-down poses of an arm (joint stiffnesses assumed), or as many machines
with a coupling drawn at random. Each is calibrated by the product from a block, dry and greased,
and presses a payload that sticks (friction 0.6) or slides (0.1). Four ways to read the same run:

    before    K_s from the dry block alone, as versions before three numbers did
    one axis  the same K_s, a force sensor that measures nothing across the axis
    one       the same K_s, with the share that it was measured at
    three     from the dry and the greased block

The chord is held against the payload's own law along the plate's normal.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from math import radians

import numpy as np

from stepload.errors import SteploadError
from stepload.identification.conditions import Conditions
from stepload.identification.lateral_coupling import Across
from stepload.identification.quantity import Quantity
from stepload.results.analyse import identify_payload
from stepload.results.calibration import from_system_runs
from stepload.results.press_data import PressData
from stepload_verify.trials.coupling.measure import (
    Bench,
    as_before,
    conditions,
    pressed,
    read,
    saved,
)
from stepload_verify.trials.coupling.world import Contact, FloatArray, rotation
from stepload_verify.trials.pose_stiffness import compliances, tool_down

BLOCK_N_PER_M, DRY, GREASED = 2e8, (0.2, 0.5), (0.05, 0.12)
READINGS = ("before", "one axis", "one", "three")
STICKS, SLIDES = 0.6, 0.1


@dataclass(frozen=True, slots=True)
class Setting:
    """An arm and a payload of this secant at this force."""

    arm: str
    secant_n_per_m: float
    top_n: float

    def bench(self, tilt_rad: float, rng: np.random.Generator) -> Bench:
        """The arm in a pose of its own, its sensor turned by `tilt_rad` at the most."""
        turned = rotation(rng.uniform(0.0, 2.0 * np.pi), tilt_rad * rng.uniform())
        if self.arm == "machine":
            return Bench(_machine(rng), turned, self.top_n, False, 3e-7, 1e-6, 3e-7, 0.3)
        joints = next(islice(_usable(self.arm, rng), 1))
        compliance = compliances(self.arm, joints)[0]
        return Bench(compliance, turned, self.top_n, True, 2e-6, 5e-6, 4e-6, 0.1)


def _usable(arm: str, rng: np.random.Generator) -> Iterator[FloatArray]:
    """Poses with K_s from 4e4 to 2e5 N/m."""
    for joints in tool_down(arm, rng):
        if 4e4 < 1.0 / compliances(arm, joints)[0][2, 2] < 2e5:
            yield joints


def _machine(rng: np.random.Generator) -> FloatArray:
    """K_s 3.49e6 N/m, 2e6 N/m sideways, coupled by 0.02 to 0.2."""
    along, side = 1.0 / 3.49e6, 1.0 / 2e6
    turn, coupled = rng.uniform(0.0, 2.0 * np.pi), along * rng.uniform(0.02, 0.2)
    x, y = coupled * np.cos(turn), coupled * np.sin(turn)
    return np.array([[side, 0.0, x], [0.0, side, y], [x, y, along]])


SETTINGS = (
    Setting("UR10e", 3e4, 50.0),
    Setting("UR5e", 1e5, 50.0),
    Setting("machine", 5e6, 300.0),
)


@dataclass(frozen=True, slots=True)
class Found:
    """One reading of one run: relative error and half width of the chord, verdict and coverage."""

    error: float
    half_width: float
    identified: bool
    covered: bool


def found(data: PressData, told: Conditions, contact: Contact) -> Found | None:
    """The chord of a run against the truth; None where the program states none."""
    try:
        result = identify_payload(*read(data, told))
    except SteploadError:
        return None
    chord = result.headline
    if chord is None:
        return None
    return chord_found(chord, contact)


def chord_found(chord: Quantity, contact: Contact) -> Found:
    """A chord against what the payload's own law says between the same forces."""
    truth = _true(chord, contact)
    low, high = chord.interval_n_per_m
    return Found(
        chord.value_n_per_m / truth - 1.0, (high - low) / (2.0 * chord.value_n_per_m),
        chord.verdict.value == "identified", low <= truth <= high,
    )  # fmt: skip


def _true(chord: Quantity, contact: Contact) -> float:
    low_m, high_m = (
        float((f / contact.k) ** (1.0 / contact.n)) for f in (chord.from_n, chord.to_n)
    )
    return (chord.to_n - chord.from_n) / (high_m - low_m)


def trial(
    setting: Setting, mu: float, tilt_rad: float, sensor_rad: float, rng: np.random.Generator
) -> dict[str, Found | None]:
    """One arm in one pose: calibrated, pressed, and read in every way."""
    bench = setting.bench(sensor_rad, rng)
    upright = np.array([0.0, 0.0, 1.0])
    dry_mu, greased_mu = rng.uniform(*DRY), rng.uniform(*GREASED)
    runs = [
        saved(bench, Contact(BLOCK_N_PER_M, 1.0, mu_of_block, upright), number, rng)
        for number, mu_of_block in enumerate((dry_mu, greased_mu, dry_mu, greased_mu))
    ]
    dry = from_system_runs(runs[::2]).record
    both = from_system_runs(runs).record
    k = setting.secant_n_per_m**1.5 / setting.top_n**0.5
    normal = rotation(rng.uniform(0.0, 2.0 * np.pi), tilt_rad) @ upright
    contact = Contact(k, 1.5, mu, normal)
    data = pressed(bench, contact, rng)
    one = conditions(bench, dry)
    one = replace(one, across=Across(at_share=one.across.at_share))
    ways: dict[str, Callable[[], Found | None]] = {
        "before": lambda: found(data, as_before(one), contact),
        "one axis": lambda: found(_one_axis(data), one, contact),
        "one": lambda: found(data, one, contact),
        "three": lambda: found(data, conditions(bench, both), contact),
    }
    return {name: way() for name, way in ways.items()}


def _one_axis(data: PressData) -> PressData:
    return replace(data, across_n=None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    print("arm, secant, friction, tilt/sensor | reading: |bias| median/90 %, half width median,"
          " identified, of these true, all true")  # fmt: skip
    for number, setting in enumerate(SETTINGS):
        for mu in (STICKS, SLIDES):
            for tilt, sensor in ((0.0, 0.0), (3.0, 2.0)):
                rng = np.random.default_rng([asked.seed, number, round(10 * mu), round(tilt)])
                all_found = [
                    trial(setting, mu, radians(tilt), radians(sensor), rng)
                    for _ in range(asked.poses)
                ]
                name = f"{setting.arm} {setting.secant_n_per_m:.0e} N/m, friction {mu}"
                print(f"{name}, {tilt:.0f}/{sensor:.0f} deg", flush=True)
                for reading in READINGS:
                    print("   ", _line(reading, [each[reading] for each in all_found]), flush=True)


def _line(reading: str, results: list[Found | None]) -> str:
    got = [each for each in results if each is not None]
    if not got:
        return f"{reading:9} nothing"
    error = np.percentile([100 * abs(each.error) for each in got], (50, 90))
    half = float(np.median([100 * each.half_width for each in got]))
    said = [each for each in got if each.identified]
    true = sum(each.covered for each in said)
    every = sum(each.covered for each in got)
    return (
        f"{reading:9} {error[0]:5.1f}/{error[1]:5.1f} % ± {half:4.1f} %, identified "
        f"{len(said):3} true {true:3}; all {len(got):3} true {every:3}"
    )


if __name__ == "__main__":
    main()
