"""Checks that a sensor is live: its readings change, and it does not flag them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

from stepload.engine.watch import wrench_axis
from stepload.envelope.limits import SECOND_IDENTICAL_COUNTS, identical_counts
from stepload.plan.model import ArmSpec, DisplacementSpec, ForceSpec, Rig, SecondForceSource
from stepload.rig.samples import Status
from stepload.setup.check_line import CheckLine, Mark
from stepload.setup.watch import Watched

SILENT_S = 0.5
"""Time in s (or ten periods) without a sample after which a gauge has fallen silent."""


def check_live(
    name: str, spec: ForceSpec | ArmSpec | DisplacementSpec, seen: Watched, rig: Rig
) -> Iterator[CheckLine]:
    """Findings on the readings themselves; none where they are as they should be."""
    samples = seen.samples[name]
    if flagged := [sample.status for sample in samples if sample.status]:
        bits = Status(0)
        for status in flagged:
            bits |= Status(status)
        yield CheckLine(
            f"{name}: status", Mark.FAIL, float(len(flagged)), 0.0, "",
            f"{len(flagged)} of {len(samples)} samples are flagged by the device"
            f" ({str(bits.name).replace('|', ', ').replace('_', ' ').lower()}): a run stops at the"
            " first (R4)",
            "see the device's own display and its page in docs/devices",
        )  # fmt: skip
    if isinstance(spec, ForceSpec):
        index = wrench_axis(spec.axis)[0]
        values = [sample.wrench[index] for sample in samples]
        if spec is rig.second_force.sensor:
            limit = identical_counts(spec, rig.second_force.noise_n, SECOND_IDENTICAL_COUNTS)
        else:
            limit = identical_counts(spec, spec.noise_n)
        yield from _standing(name, values, limit, coarse=spec.resolution_n > 0.0)
    if isinstance(spec, ArmSpec) and rig.second_force.source is SecondForceSource.ARM:
        values = [sample.force_n for sample in samples]
        yield from _standing("second_force", values, SECOND_IDENTICAL_COUNTS, coarse=False)
    if isinstance(spec, DisplacementSpec):
        longest_s, limit_s = max(seen.ages_s[name]), max(SILENT_S, 10.0 / spec.rate_hz)
        if longest_s > limit_s:
            yield CheckLine(
                f"{name}: silence", Mark.FAIL, longest_s, limit_s, "s",
                "no sample came for so long", "check cable and supply of the gauge",
            )  # fmt: skip


def _standing(
    name: str, values: Sequence[float], limit: int, *, coarse: bool
) -> Iterator[CheckLine]:
    """A live sensor has noise: equal readings in a row are a frozen one (R4).

    `limit` is how many are too many, 0 where no number decides, as with a `coarse` resolution.
    """
    same = max((sum(1 for _ in group) for _, group in itertools.groupby(values)), default=0)
    frozen = bool(limit) and same > limit
    if frozen or (same == len(values) and limit == 0):
        yield CheckLine(
            f"{name}: readings", Mark.WARN if coarse and not frozen else Mark.FAIL,
            float(same), float(limit or len(values)), "",
            f"{same} of {len(values)} readings in a row were the same to the last bit; a live"
            " sensor has noise",
            "has it stopped measuring? Touch it and look whether its reading moves",
        )  # fmt: skip
