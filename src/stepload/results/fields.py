"""Every figure of a run's results, defined once: see `model.Field`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from stepload.results.model import NOTHING, Field, data, finite, interval, named, number, quantity
from stepload.units import percent

if TYPE_CHECKING:
    from stepload.envelope.press import Term
    from stepload.envelope.schedule import Stage
    from stepload.identification.fit import Fit
    from stepload.identification.identify import Identification
    from stepload.identification.inelastic import Part
    from stepload.identification.quantity import Line, Quantity
    from stepload.identification.run_in import Cycle
    from stepload.identification.system_stiffness import SystemStiffnessFit
    from stepload.identification.verdict import LawRow
    from stepload.record.align import ChannelClock


class NamedFit(NamedTuple):
    """One estimator's fit of a run."""

    name: str
    fit: Fit
    selected: bool


def fits_of(found: Identification, *, reported: bool = True) -> list[NamedFit]:
    """The fits that are reported and the selected one, or all the others."""
    from stepload.identification.identify import REPORTED  # loaded already: `found` is of it

    first = [*REPORTED, *({found.selected} - set(REPORTED))]
    names = first if reported else [name for name in found.fits if name not in first]
    return [
        NamedFit(name, found.fits[name], name == found.selected)
        for name in names
        if name in found.fits
    ]


def _micro(value: float) -> str:
    return f"{value:.0f} µs" if math.isfinite(value) else NOTHING


_FIT: tuple[Field[Fit], ...] = (
    named("k", "K [N/mⁿ]", number(".3g")),
    named("n", "n", number(".3f")),
    named("zero_m", "zero", lambda value: quantity("m")(value) if value else "as given"),
    named("secant_n_per_m", "secant", quantity("N/m")),
    *map(named, ("secant_force_n", "force_rms_n", "points", "doubts")),
)
FIT: tuple[Field[NamedFit], ...] = (
    Field(lambda row: f"{row.name} *" if row.selected else row.name, label="fit"),
    *(field.of(lambda row: row.fit) for field in _FIT),
    Field(lambda row: row.fit.force_rms_n, "", "rms residual", quantity("N")),
)


KINDS = {
    "chord": "chord, loading",
    "unloading_chord": "chord, unloading",
    "reloading_chord": "chord, reloading",
    "secant_from_touch": "secant, zero fitted",
    "secant_from_mean_plane": "secant, from the mean plane",
    "tangent": "tangent",
}
"""Displayed name of each stiffness."""


def _interval(each: Quantity) -> tuple[float, float] | None:
    ends = each.interval_n_per_m
    return ends if all(map(math.isfinite, ends)) else None


QUANTITY: tuple[Field[Quantity], ...] = (
    Field(lambda each: each.kind, "kind", "stiffness", lambda kind: KINDS[kind]),
    named("from_n", "from", lambda force: quantity("N")(force) if force else "touch"),
    named("to_n", "to", quantity("N")),
    Field(
        lambda each: finite(each.value_n_per_m), "value_n_per_m", "value", quantity("N/m")
    ),
    Field(_interval, "interval_n_per_m", "95 % interval", interval("N/m")),
    Field(
        lambda each: finite(each.half_width), label="half width",
        show=lambda half: f"±{percent(half, 2)}",
    ),
    named("verdict", "verdict"),
    named("why"),
    Field(lambda each: [data(LINE, line) for line in each.lines], "lines"),
)  # fmt: skip

LINE: tuple[Field[Line], ...] = (
    named("source", "source"),
    named("size", "size"),
    Field(lambda line: line.relative, "relative", "u(stiffness)/stiffness", percent),
)


SIGNS = {
    "gap": "unloading against loading",
    "set": "set",
    "reload": "second loading against the first",
    "seat": "the foot of the next branch against the first loading",
    "creep": "creep over the loading",
    "rate": "holds against ramps at the same force",
}
"""Displayed name of each sign."""

PART: tuple[Field[Part], ...] = (
    named("name", "sign", lambda name: SIGNS[name]),
    named("value_m", "found", quantity("m")),
    named("sigma_m", "standard uncertainty", quantity("m")),
)

LAW: tuple[Field[LawRow], ...] = (
    named("name", "law"),
    named("chi2", "χ²", number(".1f")),
    named("degrees", "degrees of freedom"),
    Field(lambda row: "yes" if row.alike else "no", label="cannot be told from the best"),
    Field(lambda row: "yes" if row.counts else "no", label="figures may rest on it"),
)

CYCLE: tuple[Field[Cycle], ...] = (
    named("number", "cycle"),
    Field(lambda cycle: cycle.fit.secant_n_per_m, "secant_n_per_m", "secant", quantity("N/m")),
    Field(lambda cycle: cycle.fit.n, "n", "n", number(".3f")),
    named("chord_n_per_m", "chord, forces common to all cycles", quantity("N/m")),
    Field(
        lambda cycle: f"{cycle.loop_energy_j * 1e3:.3g} ± {cycle.loop_sigma_j * 1e3:.1g} mJ",
        label="loop energy",
    ),
    Field(lambda cycle: percent(cycle.loop_energy_j / cycle.stored_energy_j, 2), label="of stored"),
    *map(named, ("loop_energy_j", "loop_sigma_j", "stored_energy_j")),
)


def smooth_error(size_m: float, degrees: float | None) -> str:
    """A smooth error and the uncertainty of its size."""
    known = "" if degrees is None else f", known with {degrees:.2g} degrees of freedom"
    return f"{quantity('m')(size_m)}{known}"


SYSTEM: tuple[Field[SystemStiffnessFit], ...] = (
    named("stiffness_n_per_m", "K_s", quantity("N/m")),
    named("sigma_n_per_m", "standard uncertainty", quantity("N/m")),
    named("msde_m", "MSDE", quantity("m")),
    Field(
        lambda fit: f"{100.0 * fit.nonlinearity:+.2f} % ± {percent(fit.nonlinearity_sigma, 3)}",
        label="nonlinearity",
    ),
)
"""Fields of a table of several runs; a single run shows the others too."""

SYSTEM_REST: tuple[Field[SystemStiffnessFit], ...] = (
    named("stiffness_upper_n_per_m", "upper limit, if the contact is in series", quantity("N/m")),
    named("damping_lower_bound_n_s_per_m", "C_s, lower bound [N s/m]", number(".3g")),
    Field(
        lambda fit: smooth_error(fit.smooth_error_m, fit.smooth_degrees),
        label="smooth position error",
    ),
    named("force_range_n", "force range", interval("N")),
    named("points", "samples"),
    *map(named, ("intercept_n", "smooth_error_m", "smooth_degrees")),
    *map(named, ("nonlinearity", "nonlinearity_sigma", "contact_share")),
)

CLOCK: tuple[Field[ChannelClock], ...] = (
    named("channel", "channel"),
    named("how", "times from"),
    Field(lambda clock: clock.why or None, label="why"),
    named("skew_ppm", "skew [ppm]", number(".1f")),
    named("residual_median_us", "residual, median", _micro),
    named("residual_p99_us", "residual, 99 %", _micro),
)

FORCE_TERM: tuple[Field[Term], ...] = (
    named("name", "term"),
    Field(lambda term: term.value, "value_n", "force", quantity("N")),
    named("source", "from"),
)

STAGE: tuple[Field[Stage], ...] = (
    named("name", "stage"),
    named("each_s", "each", lambda value: f"{value:.1f} s"),
    named("repeats", "times"),
    Field(lambda stage: stage.total_s, "", "total", lambda value: f"{value:.1f} s"),
)
