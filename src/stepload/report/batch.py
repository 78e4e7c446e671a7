"""The runs of a batch together: one chord a specimen, their mean, and what stands out.

Everything follows from the records. All chords are between the forces that all runs of a payload
have; errors that the runs share are kept apart from what scatters, as in a comparison.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.identification.difference import correlations
from stepload.identification.quantity import Line, Quantity, ResultVerdict, combined
from stepload.identification.smooth import NORMAL_95
from stepload.plan.model import Acceptance
from stepload.report import batch_statistics as stats
from stepload.report.comparison_runs import ComparedRun, chords, compared_run
from stepload.report.run_record import SavedRun, labelled

TRIAL = "trial="
"""Begin of the tag that says which repeat of a specimen a run is."""


def trial_of(tags: str) -> str:
    """The repeat that a run is, by the tags in its metadata; "" where they do not say."""
    found = (tag.removeprefix(TRIAL) for tag in tags.split("\n") if tag.startswith(TRIAL))
    return next(found, "")


@dataclass(frozen=True, slots=True)
class Pressed:
    """One run of a batch with its chord; `touch_m` is where the arm first touched."""

    run: SavedRun
    chord: Quantity
    specimen: str
    operator: str
    trial: str
    touch_m: float


@dataclass(frozen=True, slots=True)
class Specimen:
    """One specimen, the mean of its runs.

    Attributes:
        interval_n_per_m: 95 %, mean of the ends of its runs' intervals.
        broken: rules that it breaks, by their names in `batch_statistics.MEANINGS`.
        limits: "inside", "outside" or "unclear" where the interval crosses a limit; "" without.
    """

    number: int
    name: str
    runs: int
    value_n_per_m: float
    interval_n_per_m: tuple[float, float]
    touch_m: float
    broken: tuple[str, ...]
    limits: str


@dataclass(frozen=True, slots=True)
class Mean:
    """Mean over specimens: `scatter` its 95 % half width by Student's t, `common` the relative
    standard uncertainties that all share and more specimens do not shrink; all in N/m."""

    value: float
    sigma: float
    scatter: float
    common: tuple[Line, ...]

    @property
    def common_half(self) -> float:
        """95 % half width of what is common."""
        return NORMAL_95 * combined(self.common) * self.value

    @property
    def half(self) -> float:
        """95 % half width of both."""
        return math.hypot(self.scatter, self.common_half)


@dataclass(frozen=True, slots=True)
class Group:
    """The runs of one payload; what takes more specimens than there are is None."""

    payload: str
    pressed: tuple[Pressed, ...]
    specimens: tuple[Specimen, ...]
    mean: Mean | None
    trend: stats.Trend | None
    chart: stats.Chart | None
    gauge: stats.Gauge | None
    no_gauge: str
    capability: stats.Capability | None
    acceptance: Acceptance | None

    @property
    def tolerance(self) -> float:
        """Width between the limits in N/m; NaN without both."""
        limits = self.acceptance
        if limits is None or limits.chord_min_n_per_m is None or limits.chord_max_n_per_m is None:
            return math.nan
        return limits.chord_max_n_per_m - limits.chord_min_n_per_m


@dataclass(frozen=True, slots=True)
class Batch:
    """A batch: its runs by payload; `left_out` are runs without a chord, `notes` for readers."""

    name: str
    groups: tuple[Group, ...]
    left_out: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def runs(self) -> list[SavedRun]:
        """Every run that counts."""
        return [each.run for group in self.groups for each in group.pressed]


def batch_of(
    name: str, runs: Sequence[SavedRun], acceptance: Acceptance | None, notes: Sequence[str] = ()
) -> Batch:
    """Evaluate the runs of a batch.

    Args:
        name: of the batch.
        runs: completed payload runs, each press once.
        acceptance: limits of a sound specimen.
        notes: what is known already.
    """
    ordered = sorted(runs, key=lambda run: run.metadata.get("started", ""))
    compared = [compared_run(run, run.conditions.secant_force_n) for run in labelled(ordered)]
    usable = [each for each in compared if each.found.headline is not None]
    left_out = [each.run.name for each in compared if each.found.headline is None]
    groups, told = [], list(notes)
    for payload in dict.fromkeys(_payload(each) for each in usable):
        alike = [each for each in usable if _payload(each) == payload]
        if found := chords(alike):
            groups.append(_group(payload, alike, found, acceptance))
        else:
            left_out += [each.run.name for each in alike]
    doubtful = [
        each.run.name
        for each in usable
        if each.found.headline and each.found.headline.verdict is not ResultVerdict.IDENTIFIED
    ]
    if doubtful:
        told.append(f"not identified as narrowly as the plan asks: {', '.join(doubtful)}")
    return Batch(name, tuple(groups), tuple(left_out), tuple(told))


def _payload(each: ComparedRun) -> str:
    return each.run.metadata.get("payload", "")


def _group(
    payload: str,
    runs: Sequence[ComparedRun],
    found: Sequence[Quantity],
    acceptance: Acceptance | None,
) -> Group:
    pressed = tuple(
        Pressed(
            each.run, chord, each.run.metadata.get("specimen") or each.run.place,
            each.run.metadata.get("operator", ""), trial_of(each.run.metadata.get("tags", "")),
            next((t.position_m for t in each.run.data.touches), math.nan),
        )
        for each, chord in zip(runs, found, strict=True)
    )  # fmt: skip
    names = list(dict.fromkeys(each.specimen for each in pressed))
    place = np.array([names.index(each.specimen) for each in pressed])
    chord = np.array([each.value_n_per_m for each in found])
    values = np.array([chord[place == at].mean() for at in range(len(names))])
    ends = np.array([each.interval_n_per_m for each in found])
    drawn, out = stats.chart(values), stats.outliers(values)
    specimens = []
    for at, name in enumerate(names):
        mine = place == at
        low, high = map(float, ends[mine].mean(axis=0))
        broken = (drawn.broken[at] if drawn else ()) + (("ESD",) if at in out else ())
        specimens.append(
            Specimen(
                at + 1, name, int(mine.sum()), float(values[at]), (low, high),
                pressed[int(np.argmax(mine))].touch_m, broken, _limits(acceptance, low, high),
            )
        )  # fmt: skip
    gauge, no_gauge = _gauge(pressed)
    capable = None
    if acceptance is not None and drawn is not None:
        ends_n_per_m = acceptance.chord_min_n_per_m, acceptance.chord_max_n_per_m
        capable = stats.capability(values, *ends_n_per_m, drawn.sigma)
    return Group(
        payload, pressed, tuple(specimens), _mean(runs, found, place, values), stats.trend(values),
        drawn, gauge, no_gauge, capable, acceptance,
    )  # fmt: skip


def _limits(acceptance: Acceptance | None, low: float, high: float) -> str:
    """Whether an interval keeps the limits, as ISO 14253-1 decides."""
    if acceptance is None:
        return ""
    least = acceptance.chord_min_n_per_m or -math.inf
    most = acceptance.chord_max_n_per_m or math.inf
    if low >= least and high <= most:
        return "inside"
    return "outside" if high < least or low > most else "unclear"


def _mean(
    runs: Sequence[ComparedRun],
    found: Sequence[Quantity],
    place: stats.IntArray,
    values: stats.FloatArray,
) -> Mean | None:
    """The mean over specimens; None for a single one.

    The sample variance holds what differs between specimens. What two specimens share on average,
    the mean of the covariances of different specimens, is added: it does not average out.
    """
    n = values.size
    if n < 2:
        return None
    measured = [each.measured(chord) for each, chord in zip(runs, found, strict=True)]
    apart = place[:, None] != place
    common = []
    for source, correlation in correlations(measured).items():
        sigma = np.array([each.lines.get(source, 0.0) for each in measured])
        shared = float((np.outer(sigma, sigma) * correlation.most)[apart].mean())
        if shared > 0.0:
            common.append(Line(source, "", math.sqrt(shared)))
    sigma = float(values.std(ddof=1))
    common.sort(key=lambda line: -line.relative)
    return Mean(
        float(values.mean()), sigma, stats.student(n - 1) * sigma / math.sqrt(n), tuple(common)
    )


def _gauge(pressed: Sequence[Pressed]) -> tuple[stats.Gauge | None, str]:
    """Gauge R&R; None and why there is none, "" where no specimen was pressed again."""
    cells: dict[tuple[str, str], list[float]] = {}
    for each in pressed:
        cells.setdefault((each.specimen, each.operator), []).append(each.chord.value_n_per_m)
    parts = list(dict.fromkeys(part for part, _ in cells))
    operators = list(dict.fromkeys(operator for _, operator in cells))
    counts = {len(values) for values in cells.values()}
    if counts == {1} and len(cells) == len(parts):
        return None, ""
    if len(counts) > 1 or len(cells) < len(parts) * len(operators):
        return None, "no gauge R&R: every operator must press every specimen equally often"
    if counts == {1} or len(parts) < 2:
        return None, "no gauge R&R: it needs two specimens, each pressed twice by every operator"
    values = [[cells[part, operator] for operator in operators] for part in parts]
    return stats.gauge(np.array(values)), ""
