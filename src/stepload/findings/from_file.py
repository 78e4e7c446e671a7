"""Identification from a file: a record of ours, or a curve from elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError
from stepload.findings.analyse import identify_payload, identify_system
from stepload.findings.conditions import Conditions, from_attachments, measured
from stepload.findings.identification import Identification, identify
from stepload.findings.press_data import press_data
from stepload.identify.sources import Sources
from stepload.identify.system import SystemStiffnessFit, fit_system_stiffness
from stepload.record.curves import Curve, read_curve
from stepload.record.reader import read_recording

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


def identify_file(path: Path, wishes: Wishes) -> tuple[Identification, tuple[str, ...]]:
    """Identify a payload from a record (.mcap) or a CSV curve; also what had to be assumed.

    Raises:
        BadInputError: the file is not what it should be, or has nothing to identify.
    """
    if path.suffix.lower() in (".mcap", ".part"):
        recording = read_recording(path)
        data = press_data(recording)
        conditions = _wished(measured(from_attachments(recording.attachments), data), wishes)
        notes = ("the record is partial",) if recording.partial else ()
        return identify_payload(data, conditions), notes
    return _identify_curve(read_curve(path), wishes)


def system_of_file(path: Path) -> SystemStiffnessFit:
    """System stiffness from a record or a CSV curve with positions.

    Raises:
        BadInputError: the file is not what it should be, or has nothing to identify.
    """
    if path.suffix.lower() in (".mcap", ".part"):
        recording = read_recording(path)
        data = press_data(recording)
        return identify_system(data, measured(from_attachments(recording.attachments), data))
    curve = read_curve(path)
    if curve.position_m is None or curve.time_s is None:
        raise BadInputError(
            f"{path}: system stiffness needs the columns time_s, position_m, force_n"
        )
    return fit_system_stiffness(
        curve.time_s, curve.position_m, curve.force_n, resolution_m=_quantum(curve.position_m)
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
    force_n = curve.force_n
    peak = int(np.argmax(force_n)) + 1
    notes = [] if peak == len(force_n) else [f"loading only: the first {peak} samples, to the peak"]
    noise_n = float(np.std(np.diff(force_n[:peak], 2))) / math.sqrt(6.0) if peak > 3 else 0.0
    touch_n = 0.0
    first = 0
    if not compensated:
        touch_n = max(TOUCH_SHARE * float(force_n.max()), TOUCH_NOISE * noise_n)
        first = int(np.argmax(force_n >= touch_n))
        travel_m = travel_m - travel_m[first]
        notes.append(f"touch taken where the force passes {touch_n:.3g} N")
    if not compensated and not wishes.system_stiffness_sigma_n_per_m:
        notes.append("σ(K_s) not given (--system-stiffness-sigma): the interval leaves it out")
    if not wishes.smooth_error_m:
        notes.append("smooth deformation error not given (--msde): the interval leaves it out")
    quantum_m = _quantum(travel_m)
    secant_n = SECANT_FORCE_N
    if force_n.max() < secant_n:
        secant_n = float(force_n.max())
        notes.append(f"secant at the peak force of {secant_n:.4g} N")
    conditions = _wished(
        Conditions(
            sources=Sources(
                system_stiffness_n_per_m=None, force_noise_n=noise_n,
                position_resolution_m=quantum_m,
            ),
            secant_force_n=secant_n,
            touch_force_n=touch_n,
            position_resolution_m=quantum_m,
        ),
        wishes,
    )  # fmt: skip
    time_s = None if curve.time_s is None else curve.time_s[first:peak]
    found = identify(travel_m[first:peak], force_n[first:peak], conditions, time_s=time_s)
    return found, tuple(notes)


def _quantum(position_m: FloatArray) -> float:
    """The resolution (m) of a channel as its data show it: their smallest difference."""
    steps = np.diff(np.unique(position_m))
    steps = steps[steps > 1e-3 * float(np.median(steps))] if steps.size else steps
    return float(steps.min()) if steps.size else 1e-9
