"""Computation of a map: every cell is a job whose result does not depend on place or order."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.design.binomial import Share, share
from stepload.design.course import course
from stepload.design.judge import judge
from stepload.design.points import Point
from stepload.design.reference import reference
from stepload.design.whole import headline
from stepload.design.world import Cell, press
from stepload.envelope.benches import k_max
from stepload.errors import DomainError
from stepload.estimators.judge import ResultVerdict
from stepload.evidence.figures import HOPELESS
from stepload.runner.digest import product_digest
from stepload.runner.jobs import run_in_order
from stepload.runner.pool import Pool

AT_ONCE, MOST_SAMPLES = 250, 1_250_000
"""Runs that are simulated together, and their samples, which limits the memory of a process."""
BATCH = 4
"""Number of cells in a batch of a process."""
DECIDING = ("contact", "design", "estimators", "evidence")
"""Packages whose code determines the result of a cell."""


@dataclass(frozen=True, slots=True)
class Row:
    """Result of a cell.

    Attributes:
        point: the cell.
        k_max_n_per_m: (34) of it.
        within: share of runs whose headline lies within 1/t of the truth.
        identified: share of runs with the verdict IDENTIFIED.
        measured: share of runs with both.
        covered: share of the IDENTIFIED runs whose interval contains the truth.
        half_width: median half width of the interval as a share of the headline; NaN where it is
            wider than the headline itself.
        veto: the gate that stopped most runs, "" where none did.
        checked, agreed: number of runs that also went through the whole pipeline, and of those with
            the same verdict.
        value_off: relative difference of their headlines where both are IDENTIFIED.
        problem: why no stiffness can be determined in this cell, "" where it can.
    """

    point: Point
    k_max_n_per_m: float
    within: Share
    identified: Share
    measured: Share
    covered: Share
    half_width: float
    veto: str
    checked: int = 0
    agreed: int = 0
    value_off: float = 0.0
    problem: str = ""


@dataclass(frozen=True, slots=True)
class Work:
    """Common settings of all jobs of a map.

    Attributes:
        seed: of everything that is drawn.
        samples: runs of each cell.
        check_every: of every so many cells one run goes through the whole pipeline too; 0: none.
    """

    seed: int
    samples: int
    check_every: int = 0

    @property
    def digest(self) -> str:
        """Digest of the code that determines the result of a cell."""
        return product_digest(*DECIDING)

    def run(self, point: Point, /) -> Row:
        """Do one cell."""
        cell, told = point.cell, point.cell.conditions
        limit = k_max(told, cell.payload.at_n)
        rng = np.random.default_rng([self.seed, _own(cell)])
        plan = course(cell.payload.at_n, cell.touch_n, cell.order)
        at_once = min(AT_ONCE, max(1, MOST_SAMPLES // plan.force_n.size))
        try:
            own = reference(cell, plan)
        except (DomainError, np.linalg.LinAlgError) as error:
            none = share(0, self.samples)
            return Row(
                point, limit, none, none, none, share(0, 0), math.nan, "", problem=str(error)
            )
        within, identified, covered = (np.zeros(self.samples, dtype=bool) for _ in range(3))
        half = np.empty(self.samples)
        vetoes: dict[str, int] = {}
        checked = agreed = 0
        value_off = 0.0
        for start in range(0, self.samples, at_once):
            part = slice(start, min(start + at_once, self.samples))
            runs = press(cell, plan, part.stop - part.start, rng)
            found = judge(cell.payload, plan, runs, own)
            ratio = found.value_n_per_m / found.truth_n_per_m
            within[part] = np.abs(ratio - 1.0) <= 1.0 / told.t
            identified[part] = found.identified
            with np.errstate(divide="ignore"):
                covered[part] = np.abs(np.log(ratio)) <= np.arcsinh(found.half_width)
            half[part] = found.half_width
            for name, count in found.vetoed.items():
                vetoes[name] = vetoes.get(name, 0) + count
            if not start and self.check_every and point.index % self.check_every == 0:
                checked, whole = 1, headline(told, plan, runs, 0)
                said = whole is not None and whole.verdict is ResultVerdict.IDENTIFIED
                agreed = int(said == bool(found.identified[0]))
                if whole is not None and said and agreed:
                    value_off = abs(float(found.value_n_per_m[0]) / whole.value_n_per_m - 1.0)
        return Row(
            point,
            limit,
            share(int(within.sum()), self.samples),
            share(int(identified.sum()), self.samples),
            share(int((identified & within).sum()), self.samples),
            share(int((identified & covered).sum()), int(identified.sum())),
            _median(half),
            max(vetoes, key=lambda name: vetoes[name]) if vetoes else "",
            checked,
            agreed,
            value_off,
        )


def _own(cell: Cell) -> int:
    """A seed that depends on the payload alone, so that rigs are compared on the same draws."""
    body = cell.payload
    text = f"{body.secant_n_per_m:.9e} {body.exponent:.9e} {body.at_n:.9e}"
    return zlib.crc32(text.encode())


def _median(half: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
    middle = float(np.median(half))
    return middle if middle <= HOPELESS else math.nan


def run_all(work: Work, cells: Sequence[Point], pool: Pool) -> list[Row]:
    """Compute all cells; the rows are in the order of the cells, whatever the pool."""
    return [row for rows in run_in_order(work, cells, pool, BATCH) for row in rows]
