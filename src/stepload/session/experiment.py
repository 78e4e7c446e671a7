"""One experiment from beginning to end: prepare, press, make safe, record, evaluate, report.

The arm is safe before a file is closed: `_press` returns when the rig has been made safe and its
devices are closed; only then is the record finished and anything evaluated.
"""

from __future__ import annotations

import contextlib
import logging
import secrets
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from stepload.engine.cadence import PROGRESS_S
from stepload.engine.loop import run_loop
from stepload.engine.notices import Notices, Say, nothing
from stepload.engine.open_rig import OpenRig, opened
from stepload.engine.operator import Operator
from stepload.engine.tick import Engine
from stepload.errors import LeftEarlyError, RefusedError, in_words
from stepload.feasibility.preflight import Preflight, preflight_of, refusal_of
from stepload.feasibility.reason import PlanVerdict
from stepload.feasibility.stiffness import plan_where_it_stands
from stepload.plan.compose import SIMULATED
from stepload.plan.model import Plan
from stepload.record.outcome import RunOutcome
from stepload.record.plain import plain
from stepload.record.recorder import Recorder, RecordingFailedError
from stepload.record.rows import Phase
from stepload.report.analyse import Evaluation, evaluate
from stepload.report.model import Document
from stepload.report.provenance import with_record
from stepload.report.run_document import run_document
from stepload.report.run_record import read_to_evaluate
from stepload.report.run_results import about, outcome_data, run_data
from stepload.rig import pose
from stepload.rig.device import ArmConfiguration
from stepload.session import control, files
from stepload.session.resume import Resumed, resumable

Progress = Callable[[Engine, Preflight], None]
RigOpener = Callable[..., contextlib.AbstractContextManager[OpenRig]]
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Finished:
    """What a run left behind; `data` is there whatever happens to its evaluation.

    `problems` are what went wrong after the run, `left_early` is the signal that cut its
    evaluation short, 0 for none.
    """

    directory: Path
    outcome: RunOutcome
    preflight: Preflight
    data: Mapping[str, Any]
    evaluation: Evaluation | None = None
    document: Document | None = None
    problems: tuple[str, ...] = ()
    left_early: int = 0


@dataclass(frozen=True, slots=True)
class _Session:
    """The data of a run from its preparation on."""

    preflight: Preflight
    engine: Engine
    operator: Operator
    directory: Path
    run_id: str
    started: datetime
    resumed: Resumed | None
    dry_run: bool
    seed: int | None
    on_progress: Progress | None
    say: Say
    open_rig: RigOpener
    on_record: Callable[[Path], None]

    @property
    def metadata(self) -> dict[str, str]:
        """The metadata that the record begins with, without what the rig reports."""
        told = files.metadata(
            self.preflight.plan, dry_run=self.dry_run, seed=self.seed, started=self.started
        )
        return {"run_id": self.run_id, **told, **(self.resumed.metadata if self.resumed else {})}

    def status(self) -> dict[str, object]:
        """Where the run is, for requests from another terminal."""
        row = self.engine.row
        if row is None:
            return {"run_id": self.run_id}
        return {
            "run_id": self.run_id, "phase": Phase(row.phase).name, "cycle": row.cycle,
            "step": row.step, "level_n": row.level_n, "force_n": row.force_n,
        }  # fmt: skip

    def progress(self, engine: Engine) -> None:
        """Show how far the run is; virtual time waits while it is paused."""
        if self.on_progress is not None:
            self.on_progress(engine, self.preflight)
        if self.dry_run and engine.course.phase == Phase.PAUSED:
            time.sleep(PROGRESS_S)


def run_plan(
    preflight: Preflight,
    *,
    dry_run: bool,
    out: Path | None = None,
    seed: int | None = None,
    resume: Path | None = None,
    operator: Operator | None = None,
    on_progress: Progress | None = None,
    on_notice: Say | None = None,
    open_rig: RigOpener | None = None,
    on_record: Callable[[Path], None] | None = None,
) -> Finished:
    """Run a plan and keep everything that it leaves.

    Args:
        preflight: of the plan.
        dry_run: on the simulated rig in virtual time instead of the plan's devices.
        out: directory for the run's files; made where missing.
        seed: of the simulated rig; the plan's own when None.
        resume: directory of an interrupted run of this plan, to go on after its last step.
        operator: where stop and pause requests come in.
        on_progress: called ten times a second of run time.
        on_notice: takes a line for the operator in the moment of a stop and while the rig is made
            safe, in a thread of its own.
        open_rig: opens the devices, in place of `stepload.engine.open_rig.opened`.
        on_record: called with the record's path once it is being written; must return at once.

    Raises:
        RefusedError: the plan may not run; nothing was opened or written.
        BadInputError: the directory cannot be used, or there is nothing to resume.
        DeviceError: a device did not open; nothing moved.
        RecordingFailedError: the record could not be kept; the arm was made safe first.
    """
    refuse_what_may_not_run(preflight, dry_run)
    plan, operator = preflight.plan, operator or Operator()
    resumed = resumable(resume, plan, dry_run=dry_run) if resume else None
    notices = Notices(on_notice) if on_notice else None
    session = _Session(
        preflight=preflight,
        engine=_engine(preflight, operator, resumed),
        operator=operator,
        directory=files.run_directory(plan, dry_run=dry_run, out=out),
        run_id=secrets.token_hex(6),
        started=datetime.now(UTC),
        resumed=resumed,
        dry_run=dry_run,
        seed=seed,
        on_progress=on_progress,
        say=notices.say if notices else nothing,
        open_rig=open_rig or opened,
        on_record=on_record or (lambda path: None),
    )
    for source in plan.sources:
        _log.info("plan %s: sha256 %s", source.name, source.sha256)
    _log.info(
        "run %s in %s: preflight %s, dry_run %s, seed %s, resume %s",
        session.run_id, session.directory, preflight.verdict.value, dry_run, seed, resume,
    )  # fmt: skip
    try:
        with _own_directory(session.directory):
            session, outcome, recorder = _press(session)
        return _keep(session, outcome, recorder)
    finally:
        if notices:
            notices.close()


def _engine(preflight: Preflight, operator: Operator, resumed: Resumed | None) -> Engine:
    return Engine(
        preflight,
        operator,
        start_cycle=resumed.start_cycle if resumed else 1,
        start_level=resumed.start_level if resumed else 0,
    )


def press(preflight: Preflight, out: Path) -> RunOutcome:
    """Run a plan on its own devices with Ctrl+C heard, keep everything in `out`: how it ended.

    Raises:
        SteploadError: as `run_plan`.
    """
    operator = Operator()
    with operator.listening():
        return run_plan(preflight, dry_run=False, out=out, operator=operator).outcome


def refuse_what_may_not_run(preflight: Preflight, dry_run: bool) -> None:
    """Refuse a run for any reason that is known before a device is opened.

    Raises:
        RefusedError: with the reason and what to do.
    """
    if preflight.verdict is PlanVerdict.REFUSED:
        raise refusal_of(preflight)
    stiffness = preflight.plan.rig.system_stiffness
    if stiffness.simulated and not dry_run:
        raise RefusedError(
            f"the calibration record {stiffness.record} was made in a dry run",
            hint="measure K_s on the rig: stepload calibrate PLAN --record FILE",
        )
    if not dry_run:
        refuse_simulated(preflight.plan)
        preflight.plan.refuse_missing()


def simulated_devices(plan: Plan) -> list[str]:
    """Keys of the devices of a plan that are simulated: it can be rehearsed, not run."""
    return [f"rig.{key}" for key, spec in plan.rig.devices.items() if spec.driver == SIMULATED]


def refuse_simulated(plan: Plan) -> None:
    """Refuse simulated devices outside a dry run: they press a payload of their own.

    Raises:
        RefusedError: with the keys that name them; what they say is no measurement.
    """
    named = simulated_devices(plan)
    if named:
        raise RefusedError(
            f"{', '.join(named)}: simulated, so nothing can be pressed",
            hint="add --dry-run to rehearse; name the drivers of your devices to press",
        )


@contextlib.contextmanager
def _own_directory(directory: Path) -> Iterator[None]:
    """Make a run's directory; remove it again if nothing was written into it."""
    files.make_directory(directory)
    try:
        yield
    except BaseException:
        with contextlib.suppress(OSError):
            directory.rmdir()
        raise


def _press(session: _Session) -> tuple[_Session, RunOutcome, Recorder]:
    """Run the engine on the open rig; when this returns the arm is safe and the devices closed."""
    with session.open_rig(session.preflight, dry_run=session.dry_run, seed=session.seed) as rig:
        session = _where_it_stands(session, rig.stands)
        session.operator.moving = True
        with (
            _recording(session, rig) as recorder,
            control.listening(session.directory, session.operator, session.status) as missing,
        ):
            outcome = run_loop(
                session.engine,
                rig,
                recorder,
                on_progress=session.progress,
                identities=rig.identities,
                say=session.say,
            )
    errors = (*outcome.errors, *rig.close_errors, *([missing] if missing else []))
    return session, replace(outcome, errors=errors), recorder


def _where_it_stands(session: _Session, stands: ArmConfiguration | None) -> _Session:
    """The session judged again where the arm is not in the pose of its stiffness calibration.

    Raises:
        RefusedError: with what is left of that stiffness the plan may not run; nothing has moved.
    """
    plan = plan_where_it_stands(session.preflight.plan, stands)
    if plan is session.preflight.plan:
        return session
    preflight = preflight_of(plan)
    if preflight.verdict is PlanVerdict.REFUSED:
        raise refusal_of(preflight)
    engine = _engine(preflight, session.operator, session.resumed)
    return replace(session, preflight=preflight, engine=engine)


@contextlib.contextmanager
def _recording(session: _Session, rig: OpenRig) -> Iterator[Recorder]:
    """The run's record; it is abandoned where something unforeseen happens before its end."""
    recorder = Recorder(
        session.directory,
        rates_hz=rig.rates_hz,
        clock=rig.clock,
        metadata=session.metadata
        | files.device_metadata(rig.identities)
        | pose.to_texts(rig.stands),
        attachments=files.attachments(session.preflight),
        lossless=rig.clock.virtual,
        say=session.say,
    )
    try:
        session.on_record(recorder.part_path)
        yield recorder
    except BaseException:
        recorder.abandon()
        raise


def _keep(session: _Session, outcome: RunOutcome, recorder: Recorder) -> Finished:
    """Evaluate a run that is over, and finish its files even if the evaluation fails."""
    head = about(session.metadata, files.plan_files(session.preflight.plan))
    bare = plain({**head, **outcome_data(outcome, session.preflight)})
    finished = Finished(session.directory, outcome, session.preflight, bare)
    try:
        recorder.sync()
        finished = _evaluated(session, finished, recorder.part_path)
        recorder.finish(finished.data, str(finished.data["verdict"]))
        _log.info("record finished: verdict %s", finished.data["verdict"])
    except Exception as error:  # the recorder's own; what got to the disk stays there
        raise _given_up(finished, recorder, error) from error
    return replace(finished, problems=(*finished.problems, *_write_files(finished)))


def _evaluated(session: _Session, finished: Finished, record: Path) -> Finished:
    """The run with its evaluation; never raises, for the record must be finished."""
    try:
        recording = read_to_evaluate(record, finished.outcome.lateness.ticks)
        bare = Evaluation(session.preflight, finished.outcome, recording, session.dry_run)
        finished, evaluation = _identified(session.operator, finished, bare)
        finished = replace(finished, evaluation=evaluation, data=plain(run_data(evaluation)))
        return replace(finished, document=run_document(evaluation))
    except Exception as error:  # a bug here must not cost the record
        _log.info("the evaluation failed", exc_info=True)
        problems = (*finished.problems, f"the evaluation failed: {in_words(error)}")
        data = {**finished.data, "reasons": list(problems)}
        return replace(finished, problems=problems, data=data)


def _identified(
    operator: Operator, finished: Finished, bare: Evaluation
) -> tuple[Finished, Evaluation]:
    """The evaluation with identification; without, and why, if that fails or is cut short."""
    try:
        operator.moving = False  # nothing moves any more: a signal ends the evaluation
        return finished, evaluate(bare)
    except LeftEarlyError as error:
        finished = replace(finished, left_early=error.signal_number)
        problem = "the evaluation was left out on request: `stepload identify` does it"
    except Exception as error:  # a bug there must not cost the report
        _log.info("the identification failed", exc_info=True)
        problem = f"the evaluation failed: {in_words(error)}"
    finally:
        operator.moving = True
    return replace(finished, problems=(problem,)), replace(bare, problem=problem)


def _given_up(finished: Finished, recorder: Recorder, error: Exception) -> RecordingFailedError:
    """The error of a record that could not be finished; what is known is still written down."""
    reason = error.message if isinstance(error, RecordingFailedError) else in_words(error)
    kept = None
    with contextlib.suppress(Exception):
        kept = recorder.rescue(files.rescue_places(finished.directory))
    with contextlib.suppress(Exception):
        recorder.abandon()
    place = kept.path.parent if kept else finished.directory
    with contextlib.suppress(OSError):
        files.write_results(place, {**finished.data, "reasons": [reason]}, None)
        if kept:
            files.write_bag_metadata(kept.path)
    hint = "what was in memory is lost; `stepload recover` repairs what is on the disk"
    if kept:
        part = (
            f"what is whole of the record ({kept.damage})" if kept.damage else "all of the record"
        )
        hint = f"{part} is in {kept.path}: stepload identify {place}"
    why = finished.outcome.why
    return RecordingFailedError(why if reason in why else f"{why}\n{reason}", hint=hint)


def _write_files(finished: Finished) -> list[str]:
    """Write results and report beside the record, which is whole already; what went wrong."""
    try:
        document = finished.document
        if document is not None:
            document = with_record(document, finished.directory / files.RECORD)
        files.write_results(finished.directory, finished.data, document)
        files.write_bag_metadata(finished.directory / files.RECORD)
    except Exception as error:
        _log.info("report or results not written", exc_info=True)
        return [f"report or results not written: {in_words(error)}"]
    return []
