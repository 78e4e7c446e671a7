"""Gates: conditions that must hold before a figure is called identified.

A gate has a statistic, a threshold and a sentence. Thresholds come from rehearsals of the run's own
ideal contact (see `rehearse`), but are never below a harmless share of the deformation: smaller
effects are in the budget instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from stepload.evidence.signs import HoldCreep, Sign
from stepload.units import beside_limit, format_quantity

UNLOADED = 0.35
"""An unloading that ends above this share of the top force is no check of the loading: a set or a
yield shows little near the top. At a third it shows as well as further down."""
HARMLESS = 0.01
"""Signs below this share of the chord's deformation do not veto."""
HARMLESS_DRIFT = 0.05
"""Largest drift correction, as a share of the chord's deformation."""
HARMLESS_ZERO = 0.1
"""Largest effect of a zero of force that moved unevenly, as a share of the chord's deformation: it
is a line of the budget, too."""
LATERAL_SHARE = 0.05
"""Largest lateral force, as a share of the axial force, with a single K_s."""
STRONG_LATERAL = 0.3
"""The same where its effect on the arm is corrected: beyond it contacts slide, and F_c falls below
0.83 of its value without lateral force (sphere, sliding, von Mises)."""
LARGEST_CORRECTION = 0.2
"""Largest correction for lateral force, as a share of the deformation. A tenth of it may remain
where the plate is tilted: 2 % of the deformation, less than the interval of most runs."""
CREEP_SHARE = 0.03
"""Largest creep over a settled loading, as a share of the deformation."""
FAR = 2.0
"""From this multiple of the allowed χ² on the stated errors are wrong, not only the law."""

Blocks = Literal["all", "law"]


@dataclass(frozen=True, slots=True)
class Gate:
    """One gate.

    Attributes:
        name: short name.
        value: the statistic; a length in m, or a share.
        threshold: what it must not exceed, in the same unit.
        unit: "m" or "" for a share.
        blocks: "all" figures, or only those that rest on a "law" or a zero.
        sentence: what it means if it has fired; "" if not.
    """

    name: str
    value: float
    threshold: float
    unit: str
    blocks: Blocks
    sentence: str

    @property
    def fires(self) -> bool:
        """Whether the threshold is exceeded; NaN exceeds every threshold."""
        return not self.value <= self.threshold


_MEANS = {
    "gap_change": "the gap between loading and unloading at {at} changes by {value} from cycle 1 "
    "to 2 (allowed {limit}): the first loading left something behind, as yield, creep or slip do",
    "set": "the contact has moved by {value} at {at} beside its movement at the top (allowed "
    "{limit}): it has set, crept or slipped",
    "reload": "the second loading deforms {value} differently from the first (allowed {limit}): "
    "the first one changed the contact, or its rate was another one",
    "gap": "unloading lies {value} from loading at {at} (allowed {limit}): creep, slip, yield, "
    "damping or drift; one cycle, or cycles without holds, cannot tell which",
    "seat": "at {at} the next branch lies {value} from the first loading (allowed {limit}): "
    "something gave way at small force, as a seat or a film does, and a secant would count it",
    "hold_split": "deformation goes on by {value} in a hold while loading beyond what it does "
    "while unloading (allowed {limit}): the contact creeps; stiffness depends on the holds' length",
    "hold_creep": "deformation goes on in the holds, at a pace that makes {value} over the loading "
    "(allowed {limit}): the contact is not settled when the next step begins",
    "rate": "deformation in the holds is {value} from that of the ramps at the same force (allowed "
    "{limit}): the contact is viscous, or force and position are out of step; stiffness depends on "
    "the rate",
    "drift": "the rig drifts by {shift} in the {elapsed} of the loading, {value} of the "
    "deformation (allowed {limit}): it is taken out, but such a drift is rarely even; let the rig "
    "warm up",
    "force_zero": "the zero of force moves by {step} from one look at free air to the next; taken "
    "out as if it were even, it may still be {value} of the deformation (allowed {limit}): let the "
    "sensor warm up",
    "force_zero_stated": "by the stated drift (rig.force.drift) the zero may have moved by {step} "
    "while loading, {value} of the deformation (allowed {limit}), and it was not looked at "
    "again: let the sensor warm up, and end the run in free air",
    "lateral": "the lateral force reaches {value} of the axial force (allowed {limit}): the "
    "arm bends sideways, and its deflection is not that of K_s",
    "strong_lateral": "the lateral force reaches {value} of the axial force (allowed "
    "{limit}): the contact slides, and yields at a smaller force",
    "other_friction": "the lateral force differs by {value} of the axial force from the "
    "calibration (allowed {limit}): the arm bends sideways otherwise, and one K_s does not hold; "
    "calibrate dry and greased",
    "lateral_correction": "what was taken out for the lateral force is {value} of the "
    "deformation (allowed {limit}): press where the arm couples less, or reduce the friction",
    "slip": "the contact slipped while loading; on a plate tilted by as much as {tilt} degrees, "
    "which is not excluded, this may be {value} of the deformation (allowed {limit}): square the "
    "plate, or reduce the friction",
    "share_change": "the lateral force differs by {value} of the axial force between the "
    "first loading and the second (allowed {limit}): friction has changed, or the contact has "
    "slipped to another place",
    "gauge_scale": "from {low} to {high} the gauge changes by {gauge}, the arm's travel less the "
    "system's deflection by {arm}: {value} apart (allowed {limit}); the gauge has come to the end "
    "of its range or has a wrong scale, or K_s is not that of this run",
    "gauge_stands": "the gauge stands still from {low} to {high}, while the arm's travel less the "
    "system's deflection goes on by {value} (allowed {limit}): it has come to the end of its range",
    "gauge_stops": "the gauge stands still from {low} to {high}; at its pace just below it would "
    "have changed by {value} (allowed {limit}), and the arm does not say that the payload stopped: "
    "the gauge has come to the end of its range",
    "misfit": "the law ({law}) does not fit: it leaves {value} rms (allowed {limit}), and loading "
    "again scatters by {scatter} only: this is no noise, whatever errors were stated",
}


def gate(
    name: str, value: float, threshold: float, unit: str, blocks: Blocks, sentence: str
) -> Gate:
    """A gate whose sentence is kept only if it fires."""
    made = Gate(name, value, threshold, unit, blocks, sentence)
    return made if made.fires else Gate(name, value, threshold, unit, blocks, "")


def judged(
    name: str,
    value: float,
    threshold: float,
    unit: str = "",
    *,
    blocks: Blocks = "all",
    meaning: str = "",
    **words: str,
) -> Gate:
    """A gate with its sentence of the table, of that name or of another `meaning`.

    `words` are what it says besides the value and what is allowed.
    """
    shown, limit = beside_limit(value, threshold, unit or "%")
    text = _MEANS[meaning or name].format(value=shown, limit=limit, **words)
    return gate(name, value, threshold, unit, blocks, text)


def sign_gate(sign: Sign, rehearsed_m: float, span_m: float, blocks: Blocks = "all") -> Gate:
    """The gate of a sign that is zero for an elastic contact."""
    threshold = max(rehearsed_m, HARMLESS * span_m)
    value, limit = beside_limit(sign.value_m, threshold, "m")
    text = _MEANS[sign.name].format(at=format_quantity(sign.force_n, "N"), value=value, limit=limit)
    return gate(sign.name, abs(sign.value_m), threshold, "m", blocks, text)


def creep_gates(creep: HoldCreep, rehearsed_m: float, total_m: float, span_m: float) -> list[Gate]:
    """The gates of creep in holds.

    Args:
        creep: what the holds show.
        rehearsed_m: largest mean over all holds of a contact that does not creep.
        total_m: the same of `creep.total_m`.
        span_m: deformation of the chord.
    """
    found = []
    per_hold = HARMLESS * span_m / max(creep.holds, 1)
    if creep.unloading_m is not None:
        value = 0.5 * abs(creep.loading_m - creep.unloading_m)
        found.append(judged("hold_split", value, max(rehearsed_m, per_hold), "m"))
    allowed_m = max(total_m, CREEP_SHARE * span_m)
    found.append(judged("hold_creep", abs(creep.total_m), allowed_m, "m"))
    return found


def touch_gate(shift_m: float, threshold_m: float, limit_n: float | None) -> Gate:
    """The gate of the point of touch, first to last."""
    believed = f" below the elastic limit of {format_quantity(limit_n, 'N')} that was believed" if (
        limit_n is not None and shift_m > 0.0) else ""  # fmt: skip
    means = f"the payload has yielded{believed} or seated, or the rig drifts"
    if shift_m <= 0.0:
        means = "the rig drifts, or the payload grew"
    moved, limit = beside_limit(shift_m, threshold_m, "m")
    text = f"the point of touch has moved by {moved} from first to last (allowed {limit}): {means}"
    return gate("touch_shift", abs(shift_m), threshold_m, "m", "all", text)


def shape_gates(
    law: str, advantage: float, allowed: float, better: str, off: float, off_allowed: float
) -> list[Gate]:
    """The gates of a law's shape.

    Args:
        law: name of the law.
        advantage: χ² of the law less that of the best other law.
        allowed: how much is allowed.
        better: name of that law.
        off: relative deviation of the local chord from that of the law's fit.
        off_allowed: how much is allowed.
    """
    better_by, least = beside_limit(advantage, allowed, "")
    away, most = beside_limit(off, off_allowed)
    return [
        gate(
            "shape", advantage, allowed, "", "law",
            f"the data speak for another law ({better}) than {law}: χ² differs by {better_by} "
            f"(allowed {least})",
        ),
        gate(
            "chord_of_fit", abs(off), off_allowed, "", "law",
            f"the chord of {law} is {away} from the measured one (allowed ±{most}): the law does "
            "not describe this contact",
        ),
    ]  # fmt: skip


def fit_gate(chi2: float, allowed: float, law: str) -> Gate:
    """The gate of the lack of fit of the best law; far beyond the allowed value the stated errors,
    and so all intervals, are too small."""
    far = chi2 > FAR * allowed
    left, most = beside_limit(chi2, allowed, "")
    text = (
        f"no law fits: the best one ({law}) leaves χ² = {left} (allowed {most}) with "
        "the stated errors"
    ) + ("; they are too small, or the travel jumps: no interval holds" if far else "")
    return gate("lack_of_fit", chi2, allowed, "", "all" if far else "law", text)


def fired(gates: Sequence[Gate], *, of_law: bool) -> tuple[str, ...]:
    """Sentences of the gates that block a figure that rests on a law, or one that does not."""
    return tuple(g.sentence for g in gates if g.fires and (of_law or g.blocks == "all"))
