"""Results as objects for programs: the content of `--json`, results.json and the record."""

from __future__ import annotations

import dataclasses
from typing import Any

from stepload.envelope.envelope import Envelope
from stepload.identification.identify import Identification
from stepload.identification.run_in import RunIn
from stepload.identification.system_stiffness import SystemStiffnessFit
from stepload.record.outcome import RunOutcome
from stepload.results import fields
from stepload.results.analyse import Evaluation
from stepload.results.model import data
from stepload.results.press_data import PressData
from stepload.results.provenance import about
from stepload.results.quality import quality_data
from stepload.results.reasons import loaded, reasons_of


def fits_data(rows: list[fields.NamedFit]) -> dict[str, Any]:
    """Fits by their names."""
    return {
        row.name: {key: value for key, value in data(fields.FIT, row).items() if value is not None}
        for row in rows
    }


def identification_data(found: Identification) -> dict[str, Any]:
    """The object of an identification."""
    rows = fields.fits_of(found) + fields.fits_of(found, reported=False)
    return {
        "fits": fits_data(rows),
        "selected": found.selected,
        "why": found.why,
        "comparable_with_paper": found.comparable_with_paper,
        "interval_secant_n_per_m": found.interval_secant_n_per_m,
        "peak_force_n": found.peak_force_n,
        "k_max_n_per_m": found.k_max_n_per_m,
        "verdict": found.verdict,
        "reasons": found.reasons,
        "laws_chosen": found.conditions.laws,
        "contact": quality_data(found.run.alignment.quality),
        **_judged_data(found),
    }


def _judged_data(found: Identification) -> dict[str, Any]:
    """The headline, every other figure, and what is not elastic."""
    judged = found.judgement
    if judged is None:
        return {"headline": None, "quantities": {}, "exponent": None, "inelastic": None, "laws": []}
    lost = judged.inelastic.loss
    return {
        "headline": data(fields.QUANTITY, judged.headline),
        "quantities": {
            kind: data(fields.QUANTITY, each) for kind, each in judged.quantities.items()
        },
        "exponent": judged.exponent,
        "inelastic": {
            "share": judged.inelastic.share,
            "elastic": judged.elastic,
            "signs": [data(fields.PART, each) for each in judged.inelastic.parts],
            "loss": None if lost is None else {"share": lost[0], "sigma": lost[1]},
        },
        "laws": judged.laws,
        "narrowing": found.narrowing,
        "drift_m_per_s": judged.drift_m_per_s,
        "remarks": judged.notes,
    }


def system_data(fit: SystemStiffnessFit) -> dict[str, Any]:
    """The object of a system stiffness."""
    return data(fields.SYSTEM + fields.SYSTEM_REST, fit)


def _measured_data(press: PressData) -> dict[str, Any]:
    """Quantities that the run measured in addition to the law."""
    return {
        "noise_n": press.noise_n,
        "zero_shift_n": press.zero_shift_n,
        "second_zero_shift_n": press.second_zero_shift_n,
        "lag_s": press.lag.lag_s,
        "lag_sigma_s": press.lag.sigma_s,
        "lag_corrected_s": press.lag_corrected_s,
        "touches": press.touches,
        "clocks": [data(fields.CLOCK, clock) for clock in press.clocks],
    }


def _run_in_data(found: RunIn) -> dict[str, Any]:
    """Cycles, virgin and steady; never their mean."""
    numbers = {each.name: getattr(found, each.name) for each in dataclasses.fields(found)}
    return numbers | {
        "cycles": [data(fields.CYCLE, cycle) for cycle in found.cycles],
        "virgin": found.virgin.number if found.virgin else None,
        "steady": found.steady.number if found.steady else None,
    }


def outcome_data(outcome: RunOutcome, envelope: Envelope) -> dict[str, Any]:
    """Settings of a run that are known before anything is evaluated."""
    cause = outcome.cause
    return {
        "status": outcome.status,
        "why_it_ended": outcome.why,
        "cause": cause._asdict() if cause else None,
        "peak_force_n": outcome.peak_force_n,
        "elastic_limit_n": envelope.theory.elastic_limit_n,
        "elastic_limit": envelope.theory.counted,
        "force_limit_n": envelope.force_limit_n,
        "levels_done": outcome.levels_done,
        "cycle": outcome.cycle,
        "duration_s": outcome.end_s - outcome.start_s,
        "zero_shift_n": outcome.zero_shift_n,
        "safing": [
            {key: getattr(each, key) for key in ("name", "sent", "duration_s", "error")}
            for each in outcome.safing
        ],
        "errors": outcome.errors,
        "lateness": outcome.lateness,
        "verdict": outcome.status,
        "reasons": [],
    }


def run_data(run: Evaluation) -> dict[str, Any]:
    """The object of a run, including that of its identification where there is one."""
    made = {
        **about(run.recording.metadata, run.recording.attachments),
        "simulated": run.dry_run,
        **outcome_data(run.outcome, run.envelope),
    }
    if run.data is not None:
        made["levels"] = run.levels
        made["measured"] = _measured_data(run.data)
    if run.identification is not None:
        peak_n = made["peak_force_n"]  # of the whole run, not of its first loading alone
        made |= identification_data(run.identification) | {"peak_force_n": peak_n}
    if run.system is not None:
        made["system_stiffness"] = system_data(run.system)
        made["verdict"] = "system stiffness measured"
    if run.run_in is not None:
        made["run_in"] = _run_in_data(run.run_in)
    if (until := loaded(run.recording.events, run.identification)) is not None:
        made["until"] = until
    if resumed := run.recording.metadata.get("resumed"):
        made["resumed"] = resumed
    return made | {"reasons": [*filter(None, [run.problem]), *reasons_of(run)]}
