"""What of a loading is not elastic: loop, set, creep and rate, each with its standard uncertainty.

None of them widens a figure of one branch: a loading chord is that of its path and rate. They say
what it may be called. It is elastic where they are within its interval.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.identification.budget import dithered
from stepload.identification.drift import Drift
from stepload.identification.elastic import Elastic
from stepload.identification.fit import FloatArray
from stepload.identification.inelastic_signs import Sign, lost_work, rate_sign, signs_of
from stepload.identification.loops import BETWEEN, Branch, Hold, Loop
from stepload.identification.run_data import RunData
from stepload.identification.smooth import NORMAL_95, smooth_correlation

NOT_REPEATED = 0.2
"""Share of the smooth deformation error that is another one in every branch."""


@dataclass(frozen=True, slots=True)
class Part:
    """One sign of what is not elastic: a length in m and its standard uncertainty.

    `elapsed_s` lies between what it compares: a drift of 1 m/s adds as many metres to it.
    """

    name: str
    value_m: float
    sigma_m: float
    elapsed_s: float = 0.0

    @property
    def shown_m(self) -> float:
        """Its size; 0 where the errors alone may explain it (95 %)."""
        size_m = abs(self.value_m)
        return size_m if size_m > NORMAL_95 * self.sigma_m else 0.0


@dataclass(frozen=True, slots=True)
class Inelastic:
    """The signs of a run and its set, in m; `span_m` is the deformation of the chord.

    `loss` is the work that the first cycle lost over that of its loading, with its standard
    uncertainty; None without an unloading.
    """

    parts: tuple[Part, ...]
    span_m: float
    loss: tuple[float, float] | None = None

    @property
    def share(self) -> float:
        """The largest part that errors do not explain, over the deformation of the chord."""
        return max((part.shown_m for part in self.parts), default=0.0) / self.span_m

    @property
    def largest(self) -> str:
        """Name of that part; "" without any."""
        return max(self.parts, key=lambda part: part.shown_m).name if self.parts else ""

    def of(self, name: str) -> Part | None:
        """A part by its name."""
        return next((part for part in self.parts if part.name == name), None)


def inelastic_of(
    run: RunData, loops: Sequence[Loop], span_m: float, from_n: float, elastic: Elastic,
    drift: Drift | None,
) -> Inelastic:  # fmt: skip
    """Every sign that these cycles can show, drift taken out.

    `span_m` is the deformation of the chord, `from_n` its lower force; the cycles are compared with
    the elastic contact.
    """
    signs = [sign for sign in signs_of(loops, elastic.at) if sign.name != "top_shift"]
    rate = rate_sign(loops, elastic)
    signs += [rate] if rate is not None else []
    parts = [Part(s.name, s.value_m, _sigma(s, run, elastic, drift), s.elapsed_s) for s in signs]
    creep = _creep(run, loops, from_n, elastic, drift)
    lost = lost_work(loops[0])
    loss = None if lost is None else (
        lost[0].value_m / lost[1], _sigma(lost[0], run, elastic, drift) / lost[1]
    )  # fmt: skip
    return Inelastic((*parts, *([creep] if creep else [])), span_m, loss)


def _sigma(sign: Sign, run: RunData, elastic: Elastic, drift: Drift | None) -> float:
    """Standard uncertainty of a sign in m, by the stated errors."""
    sources, variance, late_m, drifted_m = run.conditions.sources, 0.0, 0.0, 0.0
    length_n = sources.smooth_length_n or 0.5 * elastic.top_n
    moved_n = abs(run.zero_step_n or 0.0) / math.sqrt(12.0)
    for branch, weights in _gathered(sign.terms):
        path = branch.path
        compliance = elastic.compliance(path.force_n)
        noise = sources.force_noise_n**2 / path.count + sources.force_resolution_n**2 / 12.0
        white = compliance**2 * noise + sources.position_noise_m**2 / path.count
        own = (NOT_REPEATED * sources.smooth_error_m) ** 2
        smooth = own * smooth_correlation(path.force_n, length_n)
        variance += float(weights**2 @ white + weights @ smooth @ weights)
        variance += float(weights @ dithered(elastic, path, sources) @ weights)
        variance += (moved_n * float(weights @ compliance)) ** 2
        late_m += float(weights @ (compliance * path.rate_n_per_s)) * sources.lag_sigma_s
        if drift is not None:
            drifted_m += float(weights @ path.time_s) * drift.sigma_m_per_s
    return math.sqrt(variance + late_m**2 + drifted_m**2)


def _gathered(terms: Sequence[tuple[Branch, FloatArray]]) -> list[tuple[Branch, FloatArray]]:
    """The terms of a sign, those of one branch together."""
    found: dict[int, tuple[Branch, FloatArray]] = {}
    for branch, weights in terms:
        before = found.get(id(branch))
        found[id(branch)] = (branch, weights if before is None else before[1] + weights)
    return list(found.values())


def _creep(
    run: RunData, loops: Sequence[Loop], from_n: float, elastic: Elastic, drift: Drift | None
) -> Part | None:
    """Deformation that goes on in the holds of the loadings, over the first loading; None without.

    All holds of all loadings show one pace, in proportion to the deformation and the time. With one
    cycle those of the unloading take out what goes the same way in both, as a drift does.
    """
    up = [hold for loop in loops for hold in loop.loading.holds if hold.force_n > 0.9 * from_n]
    if not up:
        return None
    pace, sigma, slowed = _pace(up, run, elastic)
    down = loops[0].unloading.holds if loops[0].unloading is not None else ()
    if drift is not None:
        sigma = math.hypot(sigma, slowed * drift.sigma_m_per_s)
    elif down:
        other, other_sigma, _ = _pace(down, run, elastic)
        pace, sigma = 0.5 * (pace - other), 0.5 * math.hypot(sigma, other_sigma)
    path = loops[0].loading.path
    used = path.force_n > 0.9 * from_n
    whole = float(np.trapezoid(elastic.deformation(path.force_n[used]), path.time_s[used]))
    return Part("creep", pace * whole, sigma * whole)


def _pace(holds: Sequence[Hold], run: RunData, elastic: Elastic) -> tuple[float, float, float]:
    """Creep over deformation and time in 1/s, its uncertainty, and what a drift of 1 m/s adds.

    Sums over all holds: low levels creep more of their deformation than high ones, which have crept
    at the levels before.
    """
    sources = run.conditions.sources
    forces = np.array([hold.force_n for hold in holds])
    compliance = elastic.payload_compliance(forces)
    crept = sum(h.creep(float(c)) for h, c in zip(holds, compliance, strict=True))
    lasted_s = BETWEEN * np.array([hold.lasted_s for hold in holds])
    watched = float(lasted_s @ elastic.deformation(forces))
    samples = np.maximum(np.array([hold.samples for hold in holds], dtype=float), 1.0)
    bend = elastic.compliance(forces) * sources.force_noise_n
    white = (sources.position_noise_m**2 + bend**2) / samples
    variance = 2.0 * (white + sources.quantum_left_m**2)
    sigma = math.sqrt(float(variance.sum()))
    return crept / watched, sigma / watched, float(lasted_s.sum()) / watched
