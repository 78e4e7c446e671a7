"""Origin of the errors of a recorded run, as its record states it."""

from __future__ import annotations

import numpy as np

from stepload.estimators.smooth import SHORTEST
from stepload.evidence.origin import Origin
from stepload.results.press_data import LOADING, PressData
from stepload.results.run_data import sideways_of
from stepload.results.run_record import SavedRun


def origin_of(run: SavedRun) -> Origin:
    """Everything that decides which errors the run shares with others.

    A simulated rig differs from the real one of its name, and each of its seeds draws other errors
    of the travel.
    """
    sources, told = run.conditions.sources, run.metadata
    rig = told.get("rig", "")
    stiffness = sources.system_stiffness_n_per_m
    shortest_n = SHORTEST * float(run.data.force_n.max())
    return Origin(
        rig=f"{rig} (simulated)" if rig and run.simulated else rig,
        arm=_device(told.get("arm", ""))[0],
        force_sensor=", ".join(_device(told.get("force_sensor", ""))),
        axis=told.get("force_axis", ""),
        pose=run.conditions.pose,
        kinematics=f"seed {told.get('seed', '')}" if run.simulated else "",
        calibration=told.get("calibration", ""),
        stiffness_n_per_m=None
        if stiffness is None
        else (stiffness, sources.system_stiffness_sigma_n_per_m),
        surface_m=_surface_m(run.data),
        reach_m=_reach_m(run.data, sources.smooth_length_n or shortest_n),
        across=sideways_of(run.data, run.conditions).errors,
    )


def _device(text: str) -> tuple[str, ...]:
    """Make with serial number, and calibration; empty where the number is not known.

    The text is that of `session.files.device_metadata`. Firmware is left out: it does not determine
    any error.
    """
    make, _, rest = text.partition(", firmware ")
    if not make or make.endswith((" ", " unknown")):
        return ("",)
    calibration = rest.rpartition(", calibration ")[2]
    return make, calibration


def _surface_m(data: PressData) -> float | None:
    """Travel of the arm at the last touch before the first load step."""
    loading = data.branch(LOADING)
    begin_s = float(data.time_s[loading][0]) if loading.any() else np.inf
    before = [touch.position_m for touch in data.touches if touch.time_s <= begin_s]
    return before[-1] if before else None


def _reach_m(data: PressData, length_n: float) -> float | None:
    """Travel over which the force changes by the length of the smooth error."""
    loading = data.first_loading()
    if data.gauge or not loading.any():
        return None
    rise_n = float(np.ptp(data.force_n[loading]))
    return length_n * float(np.ptp(data.travel_m[loading])) / rise_n if rise_n > 0.0 else None
