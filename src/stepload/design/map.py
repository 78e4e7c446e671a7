"""A map of what a rig measures: its cells (panels, changes, payloads) and their results."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stepload.errors import BadInputError, DomainError
from stepload.feasibility.draft_plan import CYCLES, DEFAULT, FREE_S
from stepload.feasibility.map_grid import Bench, Specimen, bench, specimen
from stepload.identification.changes import finer, for_sale, gauged, known, stiffer
from stepload.identification.conditions import Conditions
from stepload.identification.expected import Expected, LoadSchedule, Narrowing, expect
from stepload.identification.fit import FloatArray
from stepload.identification.identifiability import k_max
from stepload.identification.quantity import Line, ResultVerdict
from stepload.plan.shipped import payload_folder

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
LARGEST = 2


@dataclass(frozen=True, slots=True)
class Point:
    """One cell with its place in the map.

    Attributes:
        series: a panel's name, "buy" or "payloads".
        index: its number within the series.
        value: the quantity that the panel varies, in its unit; NaN elsewhere.
        change: name of the change; "" without one.
        payload: its name; "" where a secant and an exponent stand for it.
        secant_n_per_m: from touch, at `top_n`, the top force.
        exponent: n.
        conditions: of the identification.
        touch_n: force at which a touch is seen.
    """

    series: str
    index: int
    value: float
    change: str
    payload: str
    secant_n_per_m: float
    exponent: float
    top_n: float
    conditions: Conditions
    touch_n: float

    def expected(self) -> Expected:
        """The result to be expected in the default order of steps and holds."""
        order = DEFAULT
        schedule = LoadSchedule(
            self.top_n * np.arange(1, order.steps + 1) / order.steps,
            min(self.touch_n, 0.5 * self.top_n / order.steps),
            (order.ramp_s,) * order.steps, (order.ramp_s,) * (order.steps - 1), order.hold_s,
            CYCLES, FREE_S,
        )  # fmt: skip

        def deformation(force_n: FloatArray) -> FloatArray:
            share = (force_n / self.top_n) ** (1.0 / self.exponent)
            return np.asarray(self.top_n / self.secant_n_per_m * share)

        return expect(self.conditions, schedule, deformation)


@dataclass(frozen=True, slots=True)
class Row:
    """Result of a cell.

    Attributes:
        point: the cell.
        k_max_n_per_m: (34) of it.
        expected: the result to be expected; None where no stiffness can be determined, for the
            reason `problem`.
    """

    point: Point
    k_max_n_per_m: float
    expected: Expected | None = None
    problem: str = ""

    @property
    def half_width(self) -> float:
        """Of the expected interval, as a share of the chord; NaN where it is not identifiable."""
        found = self.expected
        if found is None or found.chord.verdict is ResultVerdict.NOT_IDENTIFIABLE:
            return math.nan
        return found.chord.half_width

    @property
    def lines(self) -> list[Line]:
        """The largest of its budget, the largest first."""
        lines = () if self.expected is None else self.expected.chord.lines
        return sorted(lines, key=lambda line: -line.relative)[:LARGEST]

    @property
    def narrowing(self) -> Sequence[Narrowing]:
        """What narrows the interval most; computed where it is asked for."""
        return () if self.expected is None else self.expected.narrowing

    @property
    def narrow(self) -> bool:
        """Whether the interval is within ±1/t."""
        return self.expected is not None and self.expected.chord.verdict is ResultVerdict.IDENTIFIED

    @property
    def measured(self) -> bool:
        """Whether the payload is also below K_max."""
        return self.narrow and self.point.secant_n_per_m < self.k_max_n_per_m


def row_of(point: Point) -> Row:
    """The result of a cell."""
    limit = k_max(point.conditions, point.top_n)
    try:
        return Row(point, limit, point.expected())
    except (DomainError, np.linalg.LinAlgError) as error:
        return Row(point, limit, problem=str(error))


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
    rows: dict[str, list[tuple[float, str, float, Conditions]]] = {
        "exponent": [(n, "", n, told) for n in EXPONENTS],
        "position resolution": [
            (told.position_resolution_m / f, "", SPHERE, finer(told, f)) for f in FINER
        ],
    }
    if stiffness is not None:
        rows["system stiffness"] = [
            (f * stiffness, "", SPHERE, stiffer(told, f)) for f in STIFFNESS_FACTORS
        ]
        rows["sigma of K_s"] = [(share, "", SPHERE, known(told, share)) for share in KNOWN_TO]
        rows["gauge"] = [(size, "", SPHERE, gauged(told, size)) for size in GAUGES_M]
    rows[BUY] = [
        (math.nan, name, SPHERE, change(told)) for name, change in for_sale(told).items()
    ]  # fmt: skip
    found = []
    for series in (*PANELS, BUY):
        places = [(row, secant) for row in rows.get(series, ()) for secant in secants]
        found += [
            Point(series, index, value, change, "", secant, n, rig.top_n, changed, rig.touch_n)
            for index, ((value, change, n, changed), secant) in enumerate(places)
        ]
    pressed = [each for each in specimens if each.conditions is not None]
    for index, each in enumerate(pressed):
        assert each.conditions is not None
        found.append(
            Point(PAYLOADS, index, math.nan, "", each.name, each.secant_n_per_m, each.exponent,
                  each.top_n, each.conditions, each.touch_n)
        )  # fmt: skip
    return found


@dataclass(frozen=True, slots=True)
class Map:
    """A map: a rig, payloads, and a row for every cell."""

    rig: Bench
    specimens: Sequence[Specimen]
    rows: Sequence[Row]

    def of(self, series: str) -> list[Row]:
        """The rows of a series."""
        return [row for row in self.rows if row.point.series == series]


Start = Callable[[int], None]


def shipped_payloads() -> list[Path]:
    """The payloads that come with stepload."""
    return sorted(payload_folder().glob("*.yaml"))


def make(
    rig: str,
    payloads: Sequence[Path],
    *,
    shipped: Sequence[Path] = (),
    top_n: float | None = None,
    on_start: Start | None = None,
) -> Map:
    """The map of a rig with its payloads.

    Args:
        rig: a profile that comes with stepload, or a rig file.
        payloads: payload files; each name once.
        shipped: more of them, left out where `payloads` has one of the same name.
        top_n: top force; None: 300 N, or the largest that the rig can press.
        on_start: called with the number of cells before the computation.

    Raises:
        BadInputError: no such rig or payload, or two payloads of one name.
        PlanError: a file is invalid.
    """
    base = bench(rig, top_n)
    bodies = [specimen(rig, path, base.top_n) for path in payloads]
    names = [each.name for each in bodies]
    for name in names:
        if names.count(name) > 1:
            raise BadInputError(
                f"two payloads are named {name!r}", hint="give each a name of its own"
            )
    bodies += (
        body for path in shipped if (body := specimen(rig, path, base.top_n)).name not in names
    )
    cells = points(base, bodies, columns(base, bodies))
    if on_start is not None:
        on_start(len(cells))
    return Map(base, bodies, [row_of(cell) for cell in cells])
