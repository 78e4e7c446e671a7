"""Effect of lateral force in system runs, and the same runs corrected for it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stepload.errors import BadInputError
from stepload.estimators.lateral_effect import CROSS_COMPLIANCE, Across
from stepload.estimators.lateral_effect_fit import MIN_FORCE, AcrossFit, fit_across
from stepload.estimators.system import Cells, gather
from stepload.results.analyse import pieces, series_contact
from stepload.results.press_data import LOADING, UNLOADING
from stepload.results.run_record import SavedRun

TYPICAL_SHARE = 0.3
"""Lateral share of a payload for which the uncertainty of the correction is reported."""
NOT_KNOWN = "under which friction K_s was measured is not known"


@dataclass(frozen=True, slots=True)
class AcrossRuns:
    """The fit, None where nothing was recorded or an axis is guided; and its description."""

    fit: AcrossFit | None
    told: str

    def keys(self) -> dict[str, Any]:
        """The keys of a calibration record."""
        if self.fit is None:
            return {"across_told": self.told}
        across = self.fit.across
        known = across.per_newton_m is not None
        return {
            "across_m_per_n": across.per_newton_m or (),
            "across_sigma_m_per_n": across.sigma_m_per_n if known else (),
            "across_correlation": across.correlation,
            "at_share": across.at_share or (),
            "share_reach": across.reach,
            "across_told": self.told,
        }

    def taken_out(self, runs: Sequence[SavedRun]) -> tuple[SavedRun, ...]:
        """The runs corrected for lateral force, so that all have the mean lateral share."""
        if self.fit is None:
            return tuple(runs)
        return tuple(_without(run, self.fit.across) for run in runs)


def across_of_runs(runs: Sequence[SavedRun]) -> AcrossRuns:
    """Evaluate the effect of lateral force in K_s runs.

    Args:
        runs: against a block, K_s runs of one arm in one pose.

    Raises:
        DomainError: a run has too little force.
        BadInputError: some runs recorded the lateral force and others did not.
    """
    if not all(run.conditions.arm for run in runs):
        return AcrossRuns(None, "")
    if silent := [str(run.path) for run in runs if run.data.across_n is None]:
        if len(silent) < len(runs):
            raise BadInputError(
                f"{', '.join(silent)}: no lateral force is told there, as it is in the "
                "others; with them under which friction K_s was measured would be lost",
                hint="leave these runs out, or press again with a six-axis force sensor",
            )
        return AcrossRuns(None, f"the force sensor tells no lateral force: {NOT_KNOWN}")
    fit = fit_across(
        [_cells(run) for run in runs],
        contacts=[series_contact(run.conditions) for run in runs],
        length_n=runs[0].conditions.sources.smooth_length_n,
    )
    return AcrossRuns(fit, _told(fit))


def _cells(run: SavedRun) -> Cells:
    data = run.data
    mask = data.branch((*LOADING, *UNLOADING))
    time_s, first = np.unique(data.time_s[mask], return_index=True)
    force_n = data.force_n[mask][first]
    assert data.across_n is not None
    return gather(
        time_s, data.travel_m[mask][first], force_n, force_n >= 0.5 * MIN_FORCE * force_n.max(),
        pieces(data)[mask][first], data.branch(LOADING)[mask][first], data.across_n[mask][first],
    )  # fmt: skip


def _without(run: SavedRun, across: Across) -> SavedRun:
    data = run.data
    assert data.across_n is not None
    travel_m = data.travel_m - across.taken_m(data.force_n, data.across_n)
    return replace(run, data=replace(data, travel_m=travel_m))


def _told(fit: AcrossFit) -> str:
    """Uncertainty of the correction, in words."""
    sizes = np.linalg.norm(fit.shares, axis=1)
    span = f"shares of {sizes.min():.1%} to {sizes.max():.1%} across"
    of_any = CROSS_COMPLIANCE * TYPICAL_SHARE
    if not len(fit.directions):
        return (
            f"one number: {span} are too much alike, for errors as large as those of these runs, "
            "to tell what the force across does; K_s holds for payloads of the same share, within "
            "5 % (press the block dry, and greased, harder and more often)"
        )
    along = [
        f"({d[0]:+.2f}, {d[1]:+.2f}) to {fit.stiffness_n_per_m * sigma * TYPICAL_SHARE:.1%}"
        for d, sigma in zip(fit.directions, fit.sigma_m_per_n, strict=True)
    ]
    c = np.array(fit.across.per_newton_m) * fit.stiffness_n_per_m
    text = (
        f"lateral force: {span}; per newton across {c[0]:+.3f} and {c[1]:+.3f} of what one "
        f"along does; at a share of {TYPICAL_SHARE:.0%} beside the calibrated one known along "
        f"{' and '.join(along)} of the deflection (standard uncertainty)"
    )
    if len(fit.directions) == 1:
        text += (
            f"; at right angles to it nothing is claimed ({of_any:.0%}): the runs went one way only"
        )
    beyond = 1.5 * fit.across.reach
    return text + f"; beyond {beyond:.0%} from it it costs width" if math.isfinite(beyond) else text
