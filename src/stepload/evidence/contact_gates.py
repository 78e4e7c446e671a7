"""The gates of the contact itself: time, touch and lateral force."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.evidence.chord import Chord
from stepload.evidence.drift import Drift
from stepload.evidence.elastic import Elastic
from stepload.evidence.figures import Discrepancies
from stepload.evidence.gates import (
    HARMLESS_DRIFT,
    HARMLESS_ZERO,
    Gate,
    creep_gates,
    judged,
    sign_gate,
    touch_gate,
)
from stepload.evidence.loops import Loop
from stepload.evidence.pressed import Pressed, Touch
from stepload.evidence.rate import rate_sign
from stepload.evidence.rehearse import TO_SIGMA, creep_threshold, rate_threshold, thresholds
from stepload.evidence.signs import branches_of, hold_creep, signs_of
from stepload.units import format_quantity

OF_TWO_CYCLES = ("gap_change", "set", "reload")
UNSEEN = 0.02
"""Set, creep and drift that a single cycle cannot exclude, as a share of the deformation."""
SLOW_CREEP = 2.0
"""Largest ratio of the creep of the first loading to its difference from the second one, for creep
that takes longer than about two seconds: 0.43 to 1.0 for 2 to 40 s and holds of 0.5 s."""
HARMLESS_TOUCH = 0.03
"""Largest harmless shift of the touch, as a share of the deformation."""


def contact_signs(
    run: Pressed,
    loops: Sequence[Loop],
    main: Chord,
    elastic: Elastic,
    drift: Drift | None,
    drawn: Sequence[FloatArray],
) -> tuple[list[Gate], Discrepancies]:
    """Evaluate every sign that a contact is not elastic: the gates, and their share in the budget.

    Args:
        run: the run.
        loops: its cycles, drift taken out.
        main: the chord.
        elastic: the elastic contact with which the cycles are compared.
        drift: the drift that was subtracted.
        drawn: rehearsed travel of every branch, see `rehearse.draws`.
    """
    sources = run.conditions.sources
    signs = {sign.name: sign for sign in signs_of(loops, elastic.at)}
    rehearsed = thresholds(list(signs.values()), branches_of(loops), drawn)
    watched = [name for name in OF_TWO_CYCLES if name in signs]
    time_m = max((abs(signs[name].value_m) for name in watched), default=0.0)
    creep = hold_creep(loops, main.from_n, elastic)
    rate = rate_sign(loops, elastic)
    if "gap" in signs:
        if "gap_change" not in signs:
            # A second loading without its unloading still shows set and reload.
            alone_m = math.hypot(abs(signs["gap"].value_m) / math.sqrt(3.0), UNSEEN * main.span_m)
            time_m = max(time_m, alone_m)
        else:
            # A loop that is the same in both cycles changes nothing between them.
            beyond_m = max(abs(signs["gap"].value_m) - rehearsed["gap"], 0.0)
            time_m = max(time_m, beyond_m / math.sqrt(3.0))
        if "gap_change" not in signs or creep is None or rate is None:
            watched.append("gap")
    gates = [sign_gate(signs[name], rehearsed[name], main.span_m) for name in watched]
    if "seat" in signs:
        gates.append(sign_gate(signs["seat"], rehearsed["seat"], main.span_m, "law"))
    if rate is not None:
        allowed_m = rate_threshold(rate, branches_of(loops), drawn, elastic)
        gates.append(sign_gate(rate, allowed_m, main.span_m))
        time_m = max(time_m, abs(rate.value_m))
    creep_m = zero_m = 0.0
    if creep is not None:
        limit_m = creep_threshold(creep, loops, elastic, sources)
        total_m = limit_m * creep.total_per_mean
        gates += creep_gates(creep, limit_m, total_m, main.span_m)
        # The creep beyond the noise counts with all of it or none. Added is what holds of this
        # length do not exclude; slow creep would have shown between the loadings as well.
        noise_m = total_m / TO_SIGMA
        unseen_m = min(noise_m, SLOW_CREEP * rehearsed.get("reload", math.inf) / math.sqrt(3.0))
        found_m = math.sqrt(max(creep.total_m**2 - noise_m**2, 0.0) / 3.0)
        creep_m = math.hypot(found_m, unseen_m)
    elapsed_s = float(main.weights @ loops[0].loading.path.time_s)
    unlooked_n = sources.zero_drift_n_per_s * abs(elapsed_s)
    if run.zero_step_n is not None or unlooked_n > 0.0:
        moved_n = unlooked_n
        meaning = "force_zero_stated"
        if run.zero_step_n is not None:
            # Between two tares the zero is within half the step of an even drift.
            moved_n, meaning = 0.5 * abs(run.zero_step_n), "force_zero"
        harm_m = moved_n * elastic.at(main.from_n)
        step = format_quantity(run.zero_step_n or moved_n, "N")
        allowed_m = HARMLESS_ZERO * main.span_m
        gates.append(judged("force_zero", harm_m, allowed_m, "m", meaning=meaning, step=step))
        zero_m = harm_m / math.sqrt(3.0)
    if drift is not None:
        shift_m = drift.rate_m_per_s * elapsed_s
        share, shift = abs(shift_m) / main.span_m, format_quantity(shift_m, "m")
        elapsed = f"{elapsed_s:.0f} {'s' if run.timed else 'rows'}"
        gates.append(
            judged(
                "drift",
                share,
                HARMLESS_DRIFT,
                shift=shift,
                elapsed=elapsed,
            )
        )
    if run.touches is not None:
        gates.append(_touch(run, run.touches, main, elastic, drift))
    ends = run.conditions.bend(np.array([main.from_n, main.to_n]))
    gates += run.sideways.gates(abs(float(np.diff(ends)[0])) / main.span_m)
    slipped_m, unseen_m = run.askew.slip_m(main.from_n, main.to_n, elastic.payload_at)
    gates += run.askew.gates(slipped_m, main.span_m)
    slip_m = math.hypot(slipped_m, unseen_m) / math.sqrt(3.0)
    return gates, Discrepancies(time_m, creep_m, zero_m, slip_m)


def _touch(
    run: Pressed,
    touches: tuple[Touch, Touch],
    main: Chord,
    elastic: Elastic,
    drift: Drift | None,
) -> Gate:
    """The gate of the points of touch, after subtraction of drift and unequal forces."""
    one, other = touches
    at_n = max(0.5 * (one.force_n + other.force_n), 1e-3 * main.to_n)
    pressed_m = elastic.travel(np.array([one.force_n, other.force_n]))
    shift = other.travel_m - one.travel_m - float(np.diff(pressed_m)[0])
    elapsed = other.time_s - one.time_s
    shift -= drift.rate_m_per_s * elapsed if drift is not None else 0.0
    sources = run.conditions.sources
    sigma = math.hypot(
        sources.position_resolution_m / math.sqrt(12.0),
        sources.position_noise_m,
        elastic.at(at_n) * math.hypot(sources.force_noise_n, sources.force_resolution_n / 3.5),
        drift.sigma_m_per_s * elapsed if drift is not None else 0.0,
        max(one.blur_m, other.blur_m) / math.sqrt(3.0),
    )
    allowed = max(3.0 * math.sqrt(2.0) * sigma, HARMLESS_TOUCH * main.span_m)
    return touch_gate(shift, allowed, run.conditions.elastic_limit_n)
