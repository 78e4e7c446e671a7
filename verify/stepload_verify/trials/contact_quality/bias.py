"""Press on many rigs, read each run in four ways, and check each result against the truth.

The rigs, the calibrations and the quasi-static press are those of `trials.coupling`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from stepload.errors import SteploadError
from stepload.estimators.conditions import Conditions
from stepload.evidence.answer import weigh
from stepload.evidence.askew import Askew
from stepload.results.calibration import from_system_runs
from stepload.results.press_data import PressData
from stepload.results.pressed import pressed as pressed_of
from stepload_verify.trials.coupling.__main__ import (
    BLOCK_N_PER_M,
    DRY,
    GREASED,
    SETTINGS,
    SLIDES,
    STICKS,
    Found,
    Setting,
    chord_found,
)
from stepload_verify.trials.coupling.measure import as_before, conditions, pressed, read, saved
from stepload_verify.trials.coupling.world import Contact, rotation

TILTS_DEG, MOUNTINGS_DEG = (0.0, 3.0), (0.0, 2.0)
WAYS = ("before", "before, one axis", "after, no lines", "after")
"""One K_s, read as by earlier versions; the same with a sensor of one axis; three numbers without
the gates and budget lines about the contact; three numbers with them."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One row of the table: results by way of reading, None where there is no result."""

    setting: Setting
    friction: float
    tilt_deg: float
    mounting_deg: float
    results: tuple[dict[str, Found | None], ...]


def cells(poses: int, seed: int, rigs: Sequence[str]) -> Iterator[Cell]:
    """Every row of these rigs, with `poses` trials each."""
    for number, setting in enumerate(SETTINGS):
        if setting.arm not in rigs:
            continue
        for friction in (STICKS, SLIDES):
            for tilt in TILTS_DEG:
                for mounting in MOUNTINGS_DEG:
                    rng = np.random.default_rng(
                        [seed, number, round(10 * friction), round(10 * tilt), round(mounting)]
                    )
                    yield Cell(
                        setting, friction, tilt, mounting,
                        tuple(_trial(setting, friction, tilt, mounting, rng) for _ in range(poses)),
                    )  # fmt: skip


def _trial(
    setting: Setting,
    friction: float,
    tilt_deg: float,
    mounting_deg: float,
    rng: np.random.Generator,
) -> dict[str, Found | None]:
    """Calibrate one rig and press: plate tilted by `tilt_deg`, sensor by up to `mounting_deg`."""
    bench, upright = setting.bench(radians(mounting_deg), rng), np.array([0.0, 0.0, 1.0])
    frictions = rng.uniform(*DRY), rng.uniform(*GREASED)
    runs = [
        saved(bench, Contact(BLOCK_N_PER_M, 1.0, frictions[number % 2], upright), number, rng)
        for number in range(4)
    ]
    k = setting.secant_n_per_m**1.5 / setting.top_n**0.5
    normal = rotation(rng.uniform(0.0, 2.0 * np.pi), radians(tilt_deg)) @ upright
    contact = Contact(k, 1.5, friction, normal)
    data = pressed(bench, contact, rng)
    found: dict[str, Found | None] = dict.fromkeys(WAYS)
    try:  # a rig that cannot be calibrated has no result
        one = as_before(conditions(bench, from_system_runs(runs[::2]).record))
        three = conditions(bench, from_system_runs(runs).record)
    except SteploadError:
        return found
    found["before"] = _weighed(data, one, contact, told=False)
    found["before, one axis"] = _weighed(replace(data, across_n=None), one, contact, told=False)
    found["after, no lines"] = _weighed(data, three, contact, told=False)
    found["after"] = _weighed(data, three, contact, told=True)
    return found


def _weighed(data: PressData, known: Conditions, contact: Contact, *, told: bool) -> Found | None:
    """The chord; `told` keeps the gates and budget lines about the contact."""
    try:
        run = pressed_of(*read(data, known))
        return chord_found(weigh(run if told else replace(run, askew=Askew())).headline, contact)
    except SteploadError:
        return None
