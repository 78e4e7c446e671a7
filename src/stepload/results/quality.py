"""How the contact of a run was made, from its data; as an object and as words for people."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from stepload.estimators.contact_quality import ContactQuality, contact_quality
from stepload.estimators.missing import Missing
from stepload.estimators.wrench import Wrench
from stepload.record.rows import Phase
from stepload.results.press_data import LOADING, UNLOADING, PressData

HOLDS = (Phase.HOLD, Phase.UNLOAD_HOLD)


def wrench_of(data: PressData) -> Wrench | None:
    """The samples in contact with what is across the axis; None of a sensor with one axis."""
    if data.across_n is None:
        return None
    mask = data.branch((*LOADING, *UNLOADING))
    phase = data.phase[mask]
    resting = np.isin(phase, HOLDS)
    begins = resting & ~np.concatenate([[False], resting[:-1] & (phase[1:] == phase[:-1])])
    noise_n, torque_noise = data.lateral_noise_n, data.torque_noise_n_m
    torque = None if data.torque_n_m is None else data.torque_n_m[mask, :2]
    return Wrench(
        time_s=data.time_s[mask],
        force_n=data.force_n[mask],
        across_n=data.across_n[mask],
        rising=np.isin(phase, LOADING),
        cycle=data.cycle[mask],
        held=np.where(resting, np.cumsum(begins), 0),
        noise_n=noise_n / math.sqrt(2.0) if math.isfinite(noise_n) else data.noise_n,
        torque_n_m=torque,
        torque_noise_n_m=torque_noise / math.sqrt(2.0) if math.isfinite(torque_noise) else 0.0,
        turn=data.turn,
    )


def quality_of(data: PressData, lever_m: float | None) -> ContactQuality | Missing:
    """What a run says of how its contact was made."""
    return contact_quality(wrench_of(data), lever_m)
