"""Faults that a simulated rig can show, and when.

A `WorldFault` is (kind, start_s, duration_s, magnitude) in world time, which is 0 when the world is
made. Faults of plants (a wrong K, a surface too near, a hidden hard stop, a wrong K_s) are no
faults of devices: they are part of the `WorldSpec`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from stepload.errors import BadInputError
from stepload.rig.world import WorldFault

_CHANNEL = {
    "freeze": "the last sample's value again and again; sequence and clock go on",
    "stuck_mean": "the mean stands still at its last value; the noise stays alive",
    "dropout": "samples are lost on the way, then come again",
    "delay": "samples come `magnitude` seconds later",
    "lost": "the link is lost for good, whatever the duration says",
    "gain": "readings are multiplied by `magnitude`",
    "bias": "`magnitude` (N or m) is added to readings",
    "nan": "readings are NaN",
    "saturated": "readings stand at full scale with the saturation bit set",
    "clock_step": "the device's clock jumps by `magnitude` seconds, and back at the end",
    "sequence_repeat": "the sequence number stands still",
    "raise": "`drain` raises an exception that no driver should let out",
    "gain_ramp": "readings are multiplied by 1 + `magnitude` · t, t since its start",
    "bias_ramp": "`magnitude` · t (N or m) is added to readings, t since its start",
    "clipped": "readings go no further than ±`magnitude` (N or m); no status says so",
}

LATE = {
    "aged": "readings come as before and show an older force: from then on as it was at the start, "
    "until it is that of `magnitude` s ago",
    "old": "readings come as before and show the force of `magnitude` s ago",
    "filter": "the force is shown through a low-pass of first order, time constant `magnitude` s",
}
"""Faults of a force channel; its noise stays alive."""

_WRENCH = {
    "reversed": "readings have the opposite sign, as with a wrong axis or wiring",
    "swapped": "forces appear along the next axis: x as y, y as z, z as x",
}

_SIX = {
    "lateral_dead": "all but the component along the axis read 0, as of a sensor with one axis",
    "lateral_swapped": "the two components across the axis are swapped",
    "torque_dead": "the torques read 0",
    "torque_saturated": "the first torque across the axis stands at full scale; no status says so",
}
"""Faults of the main force sensor of a rig with six axes; they do not affect one axis."""

ARM = {
    "arm_freeze": "the whole arm sample stands still; sequence and clock go on",
    "arm_dropout": _CHANNEL["dropout"],
    "arm_delay": _CHANNEL["delay"],
    "arm_lost": _CHANNEL["lost"] + "; commands still arrive",
    "arm_nan": "the measured position is NaN",
    "arm_clock_step": _CHANNEL["clock_step"],
    "arm_sequence_repeat": _CHANNEL["sequence_repeat"],
    "arm_raise": _CHANNEL["raise"],
    "position_frozen": "the measured position stands still, all else goes on",
    "position_drift": "the measured position runs away by `magnitude` m/s",
    "position_jump": "the measured position is off by `magnitude` m",
    "arm_force_freeze": "the arm's own force stands still",
    "arm_force_gain": "the arm's own force is multiplied by `magnitude`",
    "arm_force_deaf": "the arm's own force feels nothing; its noise stays alive",
    "arm_force_reversed": "the arm's own force has the opposite sign",
    "arm_force_bias": "`magnitude` N is added to the arm's own force",
    **{f"arm_force_{name}": f"its own force: {text}" for name, text in LATE.items()},
    "arm_force_clipped": "the arm's own force goes no further than ±`magnitude` N",
    "arm_turned": "it moves the other way and measures what was commanded, from the beginning on",
    "protective_stop": "the arm brakes, holds and takes no command",
    "command_latency": "commands take effect `magnitude` seconds later",
    "command_jitter": "each command takes effect up to `magnitude` seconds later, in order",
    "command_lost": "commands do not arrive any more, whatever the duration says",
    "command_raise": "`command` raises an exception that no driver should let out",
}

PLATE = {
    "plate_moves": "it moves by `magnitude` m towards the arm, within 20 ms, and back at the end",
    "plate_slips": "friction falls to `magnitude`, until the end; rigs with six axes",
}

HOST = {"host_stall": "the program stands still once for `magnitude` seconds; the rig goes on"}

FAULTS: dict[str, str] = (
    {f"force_{name}": f"force sensor: {text}" for name, text in _CHANNEL.items()}
    | {f"second_{name}": f"second force sensor: {text}" for name, text in _CHANNEL.items()}
    | {f"gauge_{name}": f"displacement gauge: {text}" for name, text in _CHANNEL.items()}
    | {f"force_{name}": f"force sensor: {text}" for name, text in (_WRENCH | LATE).items()}
    | {f"second_{name}": f"second force sensor: {text}" for name, text in (_WRENCH | LATE).items()}
    | {f"force_{name}": f"force sensor: {text}" for name, text in _SIX.items()}
    | {name: f"arm: {text}" for name, text in ARM.items()}
    | {name: f"plate: {text}" for name, text in PLATE.items()}
    | {name: f"host: {text}" for name, text in HOST.items()}
)
"""Every kind of fault with one line of help; `magnitude` is unused where the line does not name it.
"""

_FOR_GOOD = ("lost", "command_lost", "arm_lost")


def check_kinds(faults: Iterable[WorldFault]) -> None:
    """Raises BadInputError for a kind that is not one of `FAULTS`."""
    for fault in faults:
        if fault.kind not in FAULTS:
            raise BadInputError(f"unknown fault {fault.kind!r}", hint=f"one of {', '.join(FAULTS)}")


class Schedule:
    """The faults of one device; cheap to ask while there are none.

    Args:
        faults: faults of a whole rig; those of this device are picked by `prefix`, which is then
            left out of their kind, or else by `kinds`.
    """

    def __init__(
        self,
        faults: Iterable[WorldFault],
        *,
        prefix: str = "",
        kinds: Iterable[str] = (*_CHANNEL, *_WRENCH, *LATE, *_SIX),
    ) -> None:
        mine = {prefix + kind for kind in kinds}
        self._faults = []
        for fault in faults:
            if fault.kind in mine:
                kind = fault.kind.removeprefix(prefix)
                end_s = math.inf if kind in _FOR_GOOD else fault.start_s + fault.duration_s
                self._faults.append((fault.start_s, end_s, kind, fault.magnitude))
        self._faults.sort()
        self.turned = any(kind == "arm_turned" for _, _, kind, _ in self._faults)
        """Whether the arm's direction is turned round, which no time changes."""
        self.next_s = 0.0
        """World time from which `active` must be called."""
        self._look_ahead()

    def _look_ahead(self) -> None:
        self.next_s = min((start for start, *_ in self._faults), default=math.inf)

    def largest(self, kind: str) -> float:
        """Largest magnitude of the faults of this kind that are not over, 0 without one."""
        return max((size for *_, name, size in self._faults if name == kind), default=0.0)

    def active(self, time_s: float) -> dict[str, float]:
        """Kinds active now with their magnitude; past faults are forgotten."""
        self._faults = [fault for fault in self._faults if time_s < fault[1]]
        self._look_ahead()
        return {kind: size for start_s, _, kind, size in self._faults if start_s <= time_s}

    def take(self, time_s: float) -> float:
        """Sum of the magnitudes of the faults that have begun; each acts once."""
        begun = [fault for fault in self._faults if fault[0] <= time_s]
        self._faults = [fault for fault in self._faults if fault[0] > time_s]
        self._look_ahead()
        return sum(fault[3] for fault in begun)
