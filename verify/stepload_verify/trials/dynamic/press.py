"""One run from its plan to its score: drawn, pressed by the engine, recorded, read back, judged."""

from __future__ import annotations

import tempfile
import traceback
import zlib
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from stepload.engine.first_loading import true_deformation
from stepload.engine.loop import run_loop
from stepload.engine.open_rig import opened
from stepload.engine.operator import Operator
from stepload.engine.rehearse import world_for
from stepload.engine.tick import Engine
from stepload.envelope.envelope import Envelope
from stepload.envelope.reason import PlanVerdict
from stepload.errors import SteploadError
from stepload.identification.verdict import judge
from stepload.record.outcome import RunOutcome
from stepload.record.recorder import Recorder
from stepload.results.conditions import Stated
from stepload.results.from_file import identify_file
from stepload.results.run_data import pressed
from stepload.results.run_record import saved_run
from stepload.rig.world import PayloadTruth
from stepload.runner.pool import interruptible
from stepload.session import files
from stepload_verify.trials.dynamic.plans import Draft, draw, envelope_in
from stepload_verify.trials.dynamic.worlds import ALL
from stepload_verify.trials.honest.answer import QUANTITIES, Answer, Outcome, Scored, stated

DRAWS = 200
QUICK_S = 1.0
"""Creep that is over in this time is as true settled as prompt: a ramp takes as long."""
STEP = 1e-3
"""Relative step of the true tangent, downwards."""


def drawn(world: str, seed: int, directory: Path) -> tuple[Draft, str, Envelope]:
    """The plan of a world and a seed, what is wrong with its rig, and its envelope."""
    rng = np.random.default_rng([seed, zlib.crc32(world.encode())])
    for _ in range(DRAWS):
        draft = draw(rng, directory)
        if not ALL[world].fits(draft):
            continue
        spoiled, story = ALL[world].spoil(draft, rng)
        try:
            envelope = envelope_in(directory, spoiled)
            world_for(envelope)
        except SteploadError:
            continue
        if envelope.verdict is not PlanVerdict.REFUSED:
            return spoiled, story, envelope
    raise RuntimeError(f"no plan for {world}")


def run(envelope: Envelope, directory: Path) -> tuple[RunOutcome, float, Path]:
    """Press a plan as a dry run does: its outcome, the true peak force in N, and the record."""
    with opened(envelope, dry_run=True) as rig:
        told = files.metadata(envelope.plan, dry_run=True, seed=None, started=datetime.now(UTC))
        recorder = Recorder(
            directory, rates_hz=rig.rates_hz, clock=rig.clock,
            metadata=told | files.device_metadata(rig.identities),
            attachments=files.attachments(envelope), lossless=True,
        )  # fmt: skip
        outcome = run_loop(Engine(envelope, Operator()), rig, recorder, identities=rig.identities)
        assert rig.world is not None
        peak_n = rig.world.true_peak_force_n
    return outcome, peak_n, recorder.finish({}, outcome.status.value)


def answered(record: Path, quick: bool) -> Mapping[str, Answer]:
    """The program's answers for a record; `quick` leaves out the paper's fits.

    Raises:
        SteploadError: the program refuses the record.
    """
    if quick:
        saved = saved_run(record)
        found = judge(pressed(saved.data, saved.conditions))
        return {name: stated(each) for name, each in found.quantities.items()}
    identified, _ = identify_file(record, Stated())
    return {name: stated(each) for name, each in identified.quantities.items()}


def truth(payload: PayloadTruth, quantity: str, answer: Answer) -> float | None:
    """What is true of a simulated contact at the forces that an answer names, in N/m.

    It is that of the first loading without creep and without the seating, which is not part of the
    payload. A secant from the touch counts from where the force rises above 0 N.
    """
    payload = replace(payload, seating_m=0.0)
    high_n, low_n, zero_m = answer.to_n, 0.0, 0.0
    if quantity == "chord":
        low_n = answer.from_n
    elif quantity == "tangent":
        low_n = (1.0 - STEP) * high_n
    elif quantity == "secant_from_mean_plane" and "rough" not in payload.law:
        return None
    if quantity != "secant_from_mean_plane":
        zero_m = true_deformation(payload, low_n)
    return (high_n - low_n) / (true_deformation(payload, high_n) - zero_m)


def settled(payload: PayloadTruth, true_n_per_m: float | None) -> float | None:
    """The value with all creep, true as well where creep ends within `QUICK_S`; else None."""
    last_s = payload.creep_time_s * 10.0**payload.creep_decades
    if true_n_per_m is None or payload.creep == 0.0 or last_s > QUICK_S:
        return None
    return true_n_per_m / (1.0 + payload.creep)


def judged(world: str, seed: int, quick: bool = False, keep: Path | None = None) -> Outcome:
    """Press one case and hold every answer against the truth; `keep` its files in a directory."""
    with tempfile.TemporaryDirectory() as own:
        directory = keep or Path(own)
        draft, story, envelope = drawn(world, seed, directory)
        payload = world_for(envelope).payload
        answers: Mapping[str, Answer] = {}
        problem, broken = "", False
        with interruptible():
            outcome, peak_n, record = run(envelope, directory)
        try:
            answers = answered(record, quick)
        except SteploadError as refusal:
            problem = str(refusal)
        except Exception:
            problem, broken = traceback.format_exc(limit=-3), True
    procedure = envelope.plan.procedure
    channels = "two channels" if envelope.plan.rig.second_force.source != "none" else "one channel"
    table = "table" if envelope.plan.rig.system_stiffness.deflection_force_n else "no table"
    stop = f"{outcome.cause.rule}: {outcome.cause.message}" if outcome.cause else ""
    return Outcome(
        world, seed, world == "as-declared", ALL[world].unseen,
        f"{story or 'nothing added'}; {procedure.cycles} cycles, {channels}, {table}",
        draft.family, draft.top_n,
        tuple(_scored(payload, name, answers[name]) for name in QUANTITIES if name in answers),
        problem, broken, stop, peak_n / envelope.theory.elastic_limit_n,
    )  # fmt: skip


def _scored(payload: PayloadTruth, name: str, answer: Answer) -> Scored:
    true_n_per_m = truth(payload, name, answer)
    return Scored(name, answer, true_n_per_m, settled(payload, true_n_per_m))
