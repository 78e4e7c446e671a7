"""The cells of a map: its panels, the possible changes, and the payloads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stepload.design.changes import finer, for_sale, gauged, known, stiffer
from stepload.design.law import Payload
from stepload.design.world import Cell
from stepload.envelope.benches import Bench, Specimen, k_max
from stepload.estimators.conditions import Conditions

SPHERE = 1.5
COLUMNS = 18
SOFTEST, STIFFEST, FARTHEST = 1.0 / 30.0, 10.0, 60.0
"""Stiffnesses of a map as shares of K_max (34); the last ones only if a payload is as stiff."""
EXPONENTS = (1.0, 1.25, 1.5, 1.75, 2.0)
STIFFNESS_FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0)
KNOWN_TO = (0.003, 0.01, 0.03, 0.1, 0.3)
FINER = (0.25, 1.0, 4.0, 16.0, 64.0)
GAUGES_M = (1e-7, 3e-7, 1e-6, 3e-6, 1e-5)
PANELS = ("exponent", "system stiffness", "sigma of K_s", "position resolution", "gauge")
BUY, PAYLOADS = "buy", "payloads"


@dataclass(frozen=True, slots=True)
class Point:
    """One cell with its place in the map.

    Attributes:
        series: a panel's name, "buy" or "payloads".
        index: its number within the series.
        value: the quantity that the panel varies, in its unit; NaN elsewhere.
        change: name of the change; "" in a panel.
        payload: name of the payload; "" where a secant and an exponent stand for it.
        cell: what is drawn and identified.
    """

    series: str
    index: int
    value: float
    change: str
    payload: str
    cell: Cell


def columns(rig: Bench, specimens: Sequence[Specimen]) -> list[float]:
    """Secant stiffnesses of a map in N/m, around K_max and as far as the payloads."""
    middle = k_max(rig.conditions, rig.top_n)
    wanted = 1.3 * max((each.at_top_n_per_m for each in specimens), default=0.0)
    high = min(max(STIFFEST * middle, wanted), FARTHEST * middle)
    found: list[float] = np.geomspace(SOFTEST * middle, high, COLUMNS).tolist()
    return found


def points(rig: Bench, specimens: Sequence[Specimen], secants: Sequence[float]) -> list[Point]:
    """Every cell of a map."""
    told = rig.conditions
    stiffness = told.sources.system_stiffness_n_per_m
    rows: dict[str, list[tuple[float, float, Conditions]]] = {
        "exponent": [(n, n, told) for n in EXPONENTS],
        "position resolution": [
            (told.position_resolution_m / f, SPHERE, finer(told, f)) for f in FINER
        ],
    }
    if stiffness is not None:
        rows["system stiffness"] = [
            (f * stiffness, SPHERE, stiffer(told, f)) for f in STIFFNESS_FACTORS
        ]
        rows["sigma of K_s"] = [(share, SPHERE, known(told, share)) for share in KNOWN_TO]
        rows["gauge"] = [(size, SPHERE, gauged(told, size)) for size in GAUGES_M]
    found = []
    for series in PANELS:
        places = [(row, secant) for row in rows.get(series, ()) for secant in secants]
        for index, ((value, n, changed), secant) in enumerate(places):
            cell = _cell(rig, changed, Payload(secant, n, rig.top_n))
            found.append(Point(series, index, value, "", "", cell))
    sold = for_sale(told)
    bought = [(name, change, secant) for name, change in sold.items() for secant in secants]
    for index, (name, change, secant) in enumerate(bought):
        cell = _cell(rig, change(told), Payload(secant, SPHERE, rig.top_n))
        found.append(Point(BUY, index, float("nan"), name, "", cell))
    return [*found, *_of_payloads(rig, specimens, sold)]


def _cell(rig: Bench, told: Conditions, payload: Payload, touch_n: float | None = None) -> Cell:
    touch_n = rig.touch_n if touch_n is None else touch_n
    return Cell(payload, told, touch_n, rig.zero_drift_n_per_s, rig.damping_n_s_per_m)


def _of_payloads(
    rig: Bench,
    specimens: Sequence[Specimen],
    sold: dict[str, Callable[[Conditions], Conditions]],
) -> list[Point]:
    found: list[Point] = []
    for each in specimens:
        if each.conditions is None:
            continue
        for name, change in sold.items():
            payload = Payload(each.secant_n_per_m, each.exponent, each.top_n)
            changed = replace(change(each.conditions), elastic_limit_n=None)
            cell = _cell(rig, changed, payload, each.touch_n)
            found.append(Point(PAYLOADS, len(found), float("nan"), name, each.name, cell))
    return found
