"""Figures of an identification and of a system stiffness, as they stand in results.json."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator

from stepload.identification.contact_quality import ContactQuality
from stepload.identification.fit import Missing
from stepload.identification.identify import REPORTED, Identification
from stepload.report.model import NOTHING
from stepload.report.rows import Cell, Row, column, data, figure, form, in_one_unit, quantity
from stepload.units import percent

Pair = tuple[float, float]

KINDS = {
    "chord": "chord, loading",
    "unloading_chord": "chord, unloading",
    "reloading_chord": "chord, reloading",
    "secant_from_touch": "secant, zero fitted",
    "secant_from_mean_plane": "secant, from the mean plane",
    "tangent": "tangent",
}
"""Displayed name of each stiffness."""
SIGNS = {
    "gap": "unloading against loading",
    "set": "set",
    "reload": "second loading against the first",
    "seat": "the foot of the next branch against the first loading",
    "creep": "creep over the loading",
    "rate": "holds against ramps at the same force",
}
"""Displayed name of each sign of what is not elastic."""


class Line(Row):
    """One line of the budget of a stiffness."""

    source: str = figure("Where the uncertainty comes from.", "source")
    size: str = figure("How large that is, with units, for people.", "size")
    relative: Annotated[float | None, percent] = figure(
        "Standard uncertainty of the stiffness from it, relative.", "u(stiffness)/stiffness"
    )


def finite_ends(ends: Any) -> Any:
    """An interval; None where an end is not finite."""
    return ends if ends is not None and all(map(math.isfinite, ends)) else None


class QuantityRow(Row):
    """One stiffness with its interval and verdict."""

    kind: Annotated[str, KINDS.__getitem__] = figure(
        "chord, secant_from_touch (28), secant_from_mean_plane or tangent.", "stiffness"
    )
    from_n: Annotated[float, lambda n: quantity("N")(n) if n else "touch"] = figure(
        "Lower force of the stiffness; 0: from the touch.", "from"
    )
    to_n: float = figure("Upper force.", "to")
    value_n_per_m: Annotated[float | None, Cell(lambda row: row.shown[0])] = figure(
        "The stiffness.", "value"
    )
    interval_n_per_m: Annotated[
        Pair | None, BeforeValidator(finite_ends), Cell(lambda row: row.shown[1])
    ] = figure("Its 95 % interval.", "95 % interval")
    half_width: Annotated[
        float | None,
        lambda half: f"±{percent(half, 2)}" if math.isfinite(half) else NOTHING,
    ] = column("half width")
    verdict: str = figure("Whether it may be used.", "verdict")
    why: tuple[str, ...] = figure("Why it is not identified.")
    lines: tuple[Line, ...] = figure("Its budget.")

    @property
    def shown(self) -> tuple[str, str]:
        """Value and interval for people."""
        value, ends = self.value_n_per_m, self.interval_n_per_m
        if value is None or not math.isfinite(value):
            return NOTHING, NOTHING
        if ends is None:
            return quantity("N/m")(value), NOTHING
        return in_one_unit(ends, "N/m", value)


class ExponentRow(Row):
    """The exponent n of the power law (2)."""

    value: float | None = figure("n.")
    interval: tuple[float | None, float | None] = figure("Every exponent that the data allow.")
    verdict: str = figure("As of a stiffness.")
    why: tuple[str, ...] = figure("Why it is not identified.")


class Sign(Row):
    """One sign that a contact is not elastic."""

    name: Annotated[str, SIGNS.__getitem__] = figure("Code of the sign.", "sign")
    value_m: float | None = figure("Deformation found.", "found")
    sigma_m: float | None = figure("Its standard uncertainty.", "standard uncertainty")


class Loss(Row):
    """Work lost in the first cycle over that of its loading."""

    share: float | None = figure("The share.")
    sigma: float | None = figure("Its standard uncertainty.")


def _loss(found: Any) -> Any:
    return found if found is None else dict(zip(Loss.model_fields, found, strict=True))


class InelasticRow(Row):
    """What is not elastic."""

    share: float | None = figure(
        "Largest of the signs that errors do not explain, over the deformation.",
        at="inelastic.share",
    )
    elastic: bool = figure("Whether that is within the interval of the headline.")
    signs: tuple[Sign, ...] = figure("Every sign that was looked at.", at="inelastic.parts")
    loss: Annotated[Loss | None, BeforeValidator(_loss)] = figure(
        "Work lost in the first cycle; null without an unloading.", at="inelastic.loss"
    )


class NarrowingRow(Row):
    """One thing to do about a line of the budget."""

    line: str = figure("Line of the budget.")
    todo: str = figure("What narrows it.")
    half_width: float | None = figure("Half width of the headline then, as a share.")


class Law(Row):
    """One law that was tried."""

    name: str = figure("Of the law.", "law")
    chi2: Annotated[float | None, form(".1f")] = figure("χ² of its fit.", "χ²")
    degrees: int = figure("Of freedom.", "degrees of freedom")
    alike: bool = figure(
        "Whether the data cannot tell it from the best.", "cannot be told from the best"
    )
    counts: bool = figure("Whether figures may rest on it.", "figures may rest on it")


class DoubtRow(Row):
    """What speaks against a fit."""

    flag: str = figure("A word for programs.")
    message: str = figure("A sentence for people.")


class FitRow(Row):
    """One estimator's fit of F = K δⁿ."""

    name: Annotated[str, Cell(lambda row: f"{row.name} *" if row.selected else row.name)] = column(
        "fit"
    )
    k: Annotated[float | None, form(".3g")] = figure("K in N/mⁿ.", "K [N/mⁿ]")
    n: Annotated[float | None, form(".3f")] = figure("Exponent n.", "n")
    zero_m: Annotated[float | None, lambda m: quantity("m")(m) if m else "as given"] = figure(
        "Fitted zero of the contact, 0 where taken as given.", "zero"
    )
    secant_n_per_m: float | None = figure("Secant F/δ at secant_force_n (28).", "secant")
    secant_force_n: float = figure("Force of the secant.")
    force_rms_n: float | None = figure("Root mean square of the residual force.", "rms residual")
    points: int = figure("Samples that were fitted.")
    doubts: tuple[DoubtRow, ...] = figure("What speaks against this fit.")
    selected: bool = column("")


def reported_fits(found: Identification) -> list[FitRow]:
    """The fits that a table shows: those of the paper, and the selected one."""
    names = dict.fromkeys((*REPORTED, found.selected))
    return [
        FitRow.model_validate(found.fits[name]).model_copy(
            update={"name": name, "selected": name == found.selected}
        )
        for name in names
        if name in found.fits
    ]


class Branch(Row):
    """The lateral share of one branch."""

    cycle: int = figure("From 1.")
    rising: bool = figure("Whether it is the loading.")
    share: Pair = figure(
        "Lateral over axial force, for the sensor's two axes across in the order x, y, z, with"
        " sign."
    )


class SlipRow(Row):
    """One slip event."""

    time_s: float = figure("On the run's clock.")
    force_n: float = figure("Force along the axis.")
    jump_n: float = figure("Size of the jump of the force across.")
    cycle: int = figure("From 1.")
    rising: bool = figure("Whether while loading.")


class Place(Row):
    """Where the plate was touched, in the loading's hold of largest force."""

    force_n: float = figure("Mean over the hold.")
    beside_m: Pair = figure("Along the sensor's two axes across, from its axis.")
    sigma_m: float = figure("Standard uncertainty of each by noise alone.")


class Contact(Row):
    """How the contact was made: lateral force, slip, place."""

    missing: str = figure(
        'Why nothing is known; "" where it is, and null stands for all else where it is not.'
    )
    branches: tuple[Branch, ...] | None = figure("The share of every branch.")
    slips: tuple[SlipRow, ...] | None = figure("Slip events in the order of time.")
    undetected_slip_n: float | None = figure(
        "Jump at the top force that is certain to be seen; smaller ones may have happened."
    )
    place: Place | None = figure("Where the plate was touched.")
    place_missing: str | None = figure('Why that is not known; "" where it is.')


def contact_of(found: ContactQuality | Missing) -> dict[str, Any]:
    """What `Contact` is made from."""
    if isinstance(found, Missing):
        return dict.fromkeys(Contact.model_fields) | {"missing": found.why}
    missing = found.place if isinstance(found.place, Missing) else None
    return {
        "missing": "", "branches": found.branches, "slips": found.slips,
        "undetected_slip_n": found.undetected_n,
        "place": None if missing else found.place, "place_missing": missing.why if missing else "",
    }  # fmt: skip


class Identified(Row):
    """The result of an identification."""

    fits: Mapping[str, FitRow] = figure(
        "By the name of the estimator; docs/identify.md lists them."
    )
    selected: str = figure("Which of the fits is the one to use.")
    why: tuple[str, ...] = figure("Why that one.")
    comparable_with_paper: bool = figure("Whether the zero may be taken as the paper takes it.")
    interval_secant_n_per_m: Pair | None = figure(
        "95 % interval of the secant of the selected fit."
    )
    peak_force_n: float | None = figure("Largest measured contact force.")
    k_max_n_per_m: float | None = figure("Stiffest contact that could have been identified (34).")
    verdict: str = figure(
        'identified, marginal, not identifiable; "system stiffness measured"; or the status where'
        " nothing was identified.", 
    )  # fmt: skip
    reasons: tuple[str, ...] = figure("Why, and what a reader must know.")
    contact: Annotated[Contact, BeforeValidator(contact_of)] = figure(
        "How the contact was made.", at="run.alignment.quality"
    )
    headline: QuantityRow | None = figure("The result: the chord stiffness.")
    quantities: Mapping[str, QuantityRow] = figure("Every stiffness by kind.")
    exponent: ExponentRow | None = figure("The exponent.", at="judgement.exponent", default=None)
    inelastic: InelasticRow | None = figure("What is not elastic.", at="judgement")
    narrowing: tuple[NarrowingRow, ...] = figure("What narrows the headline most.")
    laws: tuple[Law, ...] = figure("Laws that were tried.", at="judgement.laws", default=None)
    drift_m_per_s: float | None = figure(
        "Drift of the position.", at="judgement.drift_m_per_s", default=None
    )
    remarks: tuple[str, ...] = figure("On the evidence.", at="judgement.notes", default=None)


def identification_data(found: Identification) -> dict[str, Any]:
    """The object of an identification."""
    return {"exponent": None, "laws": ()} | data(Identified, found)
