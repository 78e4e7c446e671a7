"""A run in the form that is judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from stepload.identification.conditions import Conditions
from stepload.identification.lateral import ContactAlignment, LateralForce
from stepload.identification.loops import Track


@dataclass(frozen=True, slots=True)
class RunData:
    """A run in the form that is judged.

    Attributes:
        tracks: number, loading and unloading (or None) of each cycle in the order of time; one
            zero of travel for all.
        conditions: what is known besides the data.
        zero_step_n: largest change of the force's zero from one tare to the next; None without two.
        lateral_force: the lateral force, and the uncertainty that it causes.
        alignment: how the contact was made, and how well rig and plate are aligned.
        arm_drift_m_per_s: drift of the arm's position from the first touch to the last, beside a
            gauge; None where it is not known.
        adhesive: whether the force was negative near the touch.
        between_n: forces of the chord; None: 10 % of the top force, and the top.
        looked: whether the loading might have ended at an earlier level because of its deformation.
        timed: whether the times of the tracks are times, not rows.
        errors_known: whether anything is known of the errors; without, no figure has an interval.
        notes: sentences to be reported with the figures.
        doubts: sentences that block every figure.
        law_doubts: sentences that block figures that rest on a law, and so on the zero of the
            force.
    """

    tracks: Sequence[tuple[int, Track, Track | None]]
    conditions: Conditions
    zero_step_n: float | None = None
    lateral_force: LateralForce = field(default_factory=lambda: LateralForce("guided"))
    alignment: ContactAlignment = field(default_factory=ContactAlignment)
    arm_drift_m_per_s: float | None = None
    adhesive: bool = False
    between_n: tuple[float, float] | None = None
    looked: bool = False
    timed: bool = True
    errors_known: bool = True
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    law_doubts: tuple[str, ...] = ()
