"""A result as plain data: what `--json` prints, results.json holds and the record keeps."""

from __future__ import annotations

from typing import Any

from stepload.envelope.envelope import Envelope
from stepload.identify.budget import Budget
from stepload.identify.fit import Fit
from stepload.identify.identification import Identification
from stepload.identify.runin import RunIn
from stepload.identify.system import SystemStiffnessFit
from stepload.record.outcome import RunOutcome
from stepload.results.evaluation import Evaluation
from stepload.results.press_data import PressData


def fit_data(fit: Fit, stated: Budget | None) -> dict[str, Any]:
    """One fit with its honest intervals where it has a budget."""
    data: dict[str, Any] = {
        "k": fit.k,
        "n": fit.n,
        "zero_m": fit.zero_m,
        "secant_n_per_m": fit.secant_n_per_m,
        "secant_force_n": fit.secant_force_n,
        "force_rms_n": fit.force_rms_n,
        "points": fit.points,
        "doubts": [{"flag": d.flag.value, "message": d.message} for d in fit.doubts],
    }
    if stated is not None:
        data |= {
            "interval_k": list(stated.interval_k),
            "interval_n": list(stated.interval_n),
            "interval_secant_n_per_m": list(stated.interval_secant_n_per_m),
        }
    return data


def identification_data(found: Identification) -> dict[str, Any]:
    """The JSON object of an identification."""
    stated = found.budget
    return {
        "fits": {name: fit_data(fit, found.budgets.get(name)) for name, fit in found.fits.items()},
        "believe": found.believe,
        "why": list(found.why),
        "comparable_with_paper": found.comparable_with_paper,
        "interval_secant_n_per_m": list(stated.interval_secant_n_per_m) if stated else None,
        "budget": [
            {
                "source": line.source,
                "size": line.size,
                "sigma_ln_k": line.ln_k,
                "sigma_n": line.n,
                "sigma_secant_relative": line.secant_relative,
            }
            for line in (stated.lines if stated else ())
        ],
        "peak_force_n": found.peak_force_n,
        "k_max_n_per_m": found.judgement.identifiability.k_max_n_per_m,
        "verdict": found.judgement.verdict.value,
        "reasons": list(found.judgement.reasons),
    }


def press_summary(data: PressData) -> dict[str, Any]:
    """What the run itself has measured beside the law."""
    return {
        "noise_n": data.noise_n,
        "zero_shift_n": data.zero_shift_n,
        "lag_s": data.lag.lag_s,
        "lag_sigma_s": data.lag.sigma_s,
        "lag_corrected_s": data.lag_corrected_s,
        "touches": [
            {"time_s": t.time_s, "position_m": t.position_m, "force_n": t.force_n,
             "cycle": t.cycle, "purpose": t.purpose}
            for t in data.touches
        ],
        "clocks": [
            {"channel": c.channel, "how": c.how, "skew_ppm": c.skew_ppm,
             "residual_median_us": c.residual_median_us, "residual_p99_us": c.residual_p99_us}
            for c in data.clocks
        ],
    }  # fmt: skip


def run_in_data(found: RunIn) -> dict[str, Any]:
    """Cycles, virgin and steady; never their mean."""
    return {
        "cycles": [
            {"number": c.number, "secant_n_per_m": c.fit.secant_n_per_m, "n": c.fit.n,
             "chord_n_per_m": c.chord_n_per_m, "loop_energy_j": c.loop_energy_j,
             "loop_sigma_j": c.loop_sigma_j, "stored_energy_j": c.stored_energy_j}
            for c in found.cycles
        ],
        "lift_off": found.lift_off,
        "virgin": found.virgin.number if found.virgin else None,
        "steady": found.steady.number if found.steady else None,
        "secant_change": found.secant_change,
        "secant_tolerance": found.secant_tolerance,
        "energy_change": found.energy_change,
        "energy_tolerance": found.energy_tolerance,
        "shakedown_m": found.shakedown_m,
        "residual_indentation_m": found.residual_indentation_m,
    }  # fmt: skip


def system_data(fit: SystemStiffnessFit) -> dict[str, Any]:
    """The JSON object of a system-stiffness run."""
    return {
        "stiffness_n_per_m": fit.stiffness_n_per_m,
        "sigma_n_per_m": fit.sigma_n_per_m,
        "stiffness_upper_n_per_m": fit.stiffness_upper_n_per_m,
        "damping_lower_bound_n_s_per_m": fit.damping_lower_bound_n_s_per_m,
        "intercept_n": fit.intercept_n,
        "msde_m": fit.msde_m,
        "smooth_error_m": fit.smooth_error_m,
        "smooth_degrees": fit.smooth_degrees,
        "nonlinearity": fit.nonlinearity,
        "nonlinearity_sigma": fit.nonlinearity_sigma,
        "contact_share": fit.contact_share,
        "force_range_n": list(fit.force_range_n),
        "points": fit.points,
    }


def outcome_data(outcome: RunOutcome, envelope: Envelope) -> dict[str, Any]:
    """What is known of a run before anything is evaluated."""
    cause = outcome.cause
    return {
        "status": outcome.status.value,
        "why_it_ended": outcome.why,
        "cause": cause._asdict() if cause else None,
        "peak_force_n": outcome.peak_force_n,
        "elastic_limit_n": envelope.theory.elastic_limit_n,
        "force_limit_n": envelope.force_limit_n,
        "levels_done": outcome.levels_done,
        "cycle": outcome.cycle,
        "duration_s": outcome.end_s - outcome.start_s,
        "zero_shift_n": outcome.zero_shift_n,
        "safing": [
            {"name": s.name, "sent": s.sent, "error": s.error, "duration_s": s.duration_s}
            for s in outcome.safing
        ],
        "errors": list(outcome.errors),
        "lateness": outcome.lateness,
        "verdict": outcome.status.value,
        "reasons": [],
    }


def run_data(run: Evaluation) -> dict[str, Any]:
    """The JSON object of a run; one of an identification is in it where there is one."""
    data = outcome_data(run.outcome, run.envelope)
    if run.data is not None:
        data["measured"] = press_summary(run.data)
    if run.identification is not None:
        data |= identification_data(run.identification)
    if run.system is not None:
        data["system_stiffness"] = system_data(run.system)
        data["verdict"] = "system stiffness measured"
    if run.run_in is not None:
        data["run_in"] = run_in_data(run.run_in)
    if run.problem:
        data["reasons"] = [run.problem, *data["reasons"]]
    if resumed := run.recording.metadata.get("resumed"):
        data["resumed"] = resumed
        data["reasons"] = [*data["reasons"], resumed]
    return data
