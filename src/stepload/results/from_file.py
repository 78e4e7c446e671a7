"""Identification from a file: a record of ours, or a curve from elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError, DomainError
from stepload.identify.conditions import Conditions
from stepload.identify.curve_parts import (
    first_loading,
    first_touch,
    free_air_force,
    quantum,
    white_noise,
)
from stepload.identify.identification import Identification, identify
from stepload.identify.inverse_law import joint
from stepload.identify.leftover import smooth_leftover
from stepload.identify.selection import Selected, select
from stepload.identify.sources import Sources
from stepload.identify.system import SystemStiffnessFit, fit_system_stiffness
from stepload.record.curves import Curve, read_curve
from stepload.record.untrusted import untrusted
from stepload.results.analyse import identify_payload, identify_system
from stepload.results.saved import saved_run

FloatArray = NDArray[np.float64]

SECANT_FORCE_N = 300.0
TOUCH_SHARE = 0.01
"""A curve's touch is where the force passes this share of its peak, at least six times noise."""
TOUCH_NOISE = 6.0


@dataclass(frozen=True, slots=True)
class Wishes:
    """What the caller states beside the file; None: what the file says, or a stated default."""

    system_stiffness_n_per_m: float | None = None
    system_stiffness_sigma_n_per_m: float | None = None
    smooth_error_m: float | None = None
    secant_force_n: float | None = None
    elastic_limit_n: float | None = None


def _wished(conditions: Conditions, wishes: Wishes) -> Conditions:
    sources = conditions.sources
    if wishes.system_stiffness_n_per_m is not None:
        sources = replace(sources, system_stiffness_n_per_m=wishes.system_stiffness_n_per_m)
    if wishes.system_stiffness_sigma_n_per_m is not None:
        sources = replace(
            sources, system_stiffness_sigma_n_per_m=wishes.system_stiffness_sigma_n_per_m
        )
    if wishes.smooth_error_m is not None:
        sources = replace(sources, smooth_error_m=wishes.smooth_error_m)
    return replace(
        conditions,
        sources=sources,
        secant_force_n=wishes.secant_force_n or conditions.secant_force_n,
        elastic_limit_n=wishes.elastic_limit_n or conditions.elastic_limit_n,
    )


def _is_record(path: Path) -> bool:
    return path.is_dir() or path.suffix.lower() in (".mcap", ".part")


def identify_file(path: Path, wishes: Wishes) -> tuple[Identification, tuple[str, ...]]:
    """Identify a payload from a record (.mcap) or a CSV curve; also what had to be assumed.

    Raises:
        BadInputError: the file is not what it should be, or has nothing to identify.
    """
    with untrusted(path):
        if not _is_record(path):
            return _identify_curve(read_curve(path), wishes)
        run = saved_run(path)
        notes = ("the record is partial",) if run.partial else ()
        return identify_payload(run.data, _wished(run.conditions, wishes)), notes


def system_of_file(path: Path) -> SystemStiffnessFit:
    """System stiffness from a record or a CSV curve with positions.

    Raises:
        BadInputError: the file is not what it should be, or has nothing to identify.
    """
    with untrusted(path):
        if _is_record(path):
            run = saved_run(path)
            return identify_system(run.data, run.conditions)
        curve = read_curve(path)
        if curve.position_m is None or curve.time_s is None:
            raise BadInputError(
                f"{path}: system stiffness needs the columns time_s, position_m, force_n"
            )
        return fit_system_stiffness(
            curve.time_s, curve.position_m, curve.force_n, resolution_m=quantum(curve.position_m)
        )


def _identify_curve(curve: Curve, wishes: Wishes) -> tuple[Identification, tuple[str, ...]]:
    compensated = curve.displacement_m is not None
    travel_m = curve.displacement_m if curve.displacement_m is not None else curve.position_m
    assert travel_m is not None
    if compensated and wishes.system_stiffness_n_per_m is not None:
        raise BadInputError(
            "--system-stiffness with a column displacement_m: that column is the payload's "
            "deformation, K_s is out of it already",
            hint="call the column position_m if it is the travel of the arm",
        )
    if not compensated and wishes.system_stiffness_n_per_m is None:
        raise BadInputError(
            "a column position_m holds the deflection of the system too",
            hint='give --system-stiffness "3.49e6 N/m", or a column displacement_m',
        )
    notes = []
    loading = first_loading(curve.force_n)
    if loading.stop < len(curve.force_n):
        notes.append(
            f"first loading only: the first {loading.stop} of {len(curve.force_n)} samples"
        )
    force_n, travel_m = curve.force_n[loading], travel_m[loading]
    noise_n, noise_m = white_noise(force_n), white_noise(travel_m)
    touch_n, first = 0.0, 0
    if not compensated:
        touch_n = max(TOUCH_SHARE * float(np.ptp(force_n)), TOUCH_NOISE * noise_n)
        if (tare_n := free_air_force(travel_m, force_n, touch_n)) is not None:
            force_n = force_n - tare_n
            if abs(tare_n) > touch_n:
                notes.append(f"the force in free air is {tare_n:.3g} N: taken out")
        first = first_touch(force_n, touch_n)
        if first == 0:
            touch_n = max(touch_n, float(force_n[0]))
            notes.append(
                f"the data begin in contact, at {force_n[0]:.3g} N: the zero is that of the fit"
            )
        else:
            notes.append(f"touch taken where the force passes {touch_n:.3g} N")
        travel_m = travel_m - travel_m[first]
    if not compensated and not wishes.system_stiffness_sigma_n_per_m:
        notes.append("σ(K_s) not given (--system-stiffness-sigma): the interval leaves it out")
    quantum_m = quantum(travel_m)
    secant_n = SECANT_FORCE_N
    if force_n.max() < secant_n:
        secant_n = float(force_n.max())
        if not wishes.secant_force_n:
            notes.append(f"secant at the peak force of {secant_n:.4g} N")
    force_n, travel_m = force_n[first:], travel_m[first:]
    conditions = _wished(
        Conditions(
            sources=Sources(
                system_stiffness_n_per_m=None,
                force_noise_n=noise_n,
                position_noise_m=math.sqrt(max(noise_m**2 - quantum_m**2 / 12.0, 0.0)),
                position_resolution_m=quantum_m,
            ),
            secant_force_n=secant_n,
            touch_force_n=touch_n,
            position_resolution_m=quantum_m,
        ),
        wishes,
    )
    time_s = None if curve.time_s is None else curve.time_s[loading][first:]
    stiffness = conditions.sources.system_stiffness_n_per_m
    selected = select(travel_m, force_n, system_stiffness_n_per_m=stiffness, time_s=time_s)
    if wishes.smooth_error_m is None:
        conditions, note = _with_leftover(selected, conditions, noise_m)
        notes.append(note)
    return identify(selected, conditions), tuple(notes)


def _with_leftover(
    selected: Selected, conditions: Conditions, noise_m: float
) -> tuple[Conditions, str]:
    """The smooth error as the residuals of the run speak for it, and what to say about that."""
    missing = "smooth deformation error not given (--msde)"
    batch = selected.samples(selected.batch)
    x, y = batch.deformation_m, batch.force_n
    try:
        found = smooth_leftover(joint(x, y), x, y, white_sd_m=noise_m)
    except DomainError:
        found = None
    if found is None:
        return conditions, f"{missing}: the interval leaves it out"
    sources = replace(
        conditions.sources, smooth_error_m=found.smooth_error_m, smooth_degrees=found.degrees
    )
    return replace(conditions, sources=sources), (
        f"{missing}: taken from the residuals, {found.smooth_error_m * 1e6:.3g} µm with "
        f"{found.degrees:.2g} degrees of freedom"
    )
