"""A run on open devices from its first tick to its outcome: drive, make safe, explain, conclude."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress

from stepload.engine.cadence import Cadence, DeviceFaults
from stepload.engine.interfaces import RecordSink, RigDevices
from stepload.engine.notices import EventLog, Say, nothing
from stepload.engine.realtime import LOOK_S, LOOKS, LoopHungError, hang_watch, realtime_conditions
from stepload.engine.safe_end import make_rig_safe
from stepload.engine.safing import Action, make_safe, stop_notice, why_it_stopped
from stepload.engine.tick import Engine
from stepload.errors import in_words
from stepload.record.outcome import ActionResult, Cause, RunOutcome, RunStatus
from stepload.rig.device import Identity

EXPLAIN_DEADLINE_S = 1.0
_log = logging.getLogger(__name__)
Event = tuple[float, str, dict[str, object]]


def run_loop(
    engine: Engine,
    rig: RigDevices,
    record: RecordSink,
    *,
    on_progress: Callable[[Engine], None] | None = None,
    identities: Mapping[str, Identity] | None = None,
    say: Say = nothing,
) -> RunOutcome:
    """Run an engine on open devices to its end, make the rig safe, and say what happened.

    Does not raise for anything that goes wrong on the way: it is in the outcome. Files are not
    closed here; finish the record afterwards. `on_progress` is called ten times a second.
    `identities` by role, as in `OpenRig`, are named where a device ends the run. `say` takes lines
    for the operator in the moment of a stop and while the rig is made safe; it must return at once.
    """
    run = _Run(engine, rig, record, on_progress, identities or {}, say)
    run.drive()
    run.make_safe()
    run.explain()
    outcome = run.outcome()
    _record_end(record, run.log, engine, outcome)
    return outcome


class _Run:
    """One run, and what is known of it so far."""

    def __init__(
        self,
        engine: Engine,
        rig: RigDevices,
        record: RecordSink,
        on_progress: Callable[[Engine], None] | None,
        identities: Mapping[str, Identity],
        say: Say,
    ) -> None:
        self.engine, self.rig, self.say = engine, rig, say
        self.errors: list[str] = []
        self.faults = DeviceFaults(engine, rig, identities, self.errors)
        self.safing: tuple[ActionResult, ...] = ()
        self.start_s = self.loop_end_s = self.end_s = rig.clock.now_s()
        self.log = EventLog(_log, self.start_s)
        self.cadence = Cadence(engine, rig, record, self.faults, on_progress, self.log)
        engine.on_stop = lambda cause: say(stop_notice(cause, self.start_s))
        engine.on_word = say

    def drive(self) -> None:
        """Tick until the loop has ended, in whatever way; never raises."""
        try:
            with realtime_conditions(self.rig.clock.virtual), self._watched():
                self.cadence.run()
        except LoopHungError:
            pass
        except BaseException as error:  # the arm is made safe before anything else
            message = in_words(error)
            self.errors.append(message)
            self.engine.trip(Cause("loop", 1.0, 0.0, "", 0.0, self.rig.clock.now_s(), message))
        self.loop_end_s = self.rig.clock.now_s()

    def make_safe(self) -> None:
        """Make the rig safe, unless the watch over a hung loop has done so already."""
        self.safing = self.safing or make_rig_safe(self.engine, self.rig, self.errors, self.say)
        self.end_s = self.rig.clock.now_s()

    def explain(self) -> None:
        """Ask the devices what they know of the cause; one that hangs has a deadline here too."""
        with suppress(BaseException):
            ask = Action("why", self.faults.explain, EXPLAIN_DEADLINE_S)
            make_safe([ask], self.engine.operator)

    def outcome(self) -> RunOutcome:
        """The outcome of the run."""
        engine, course = self.engine, self.engine.course
        status, retracted = self._status(), engine.safe_reached or course.done
        signal_number = engine.operator.signal_number
        # Nobody can move a simulated arm back.
        stands_m = 0.0 if self.rig.clock.virtual else course.target_m - course.start_m
        return RunOutcome(
            status=status,
            cause=engine.cause,
            why=why_it_stopped(
                status, engine.cause, retracted, engine.still_closed, self.safing, self.start_s,
                self.loop_end_s, signal_number, stands_m,
                course.guard.found.message if course.guard.found else "",
            ),
            retracted=retracted,
            safing=self.safing,
            start_s=self.start_s,
            end_s=self.end_s,
            peak_force_n=engine.peak_force_n,
            zero_shift_n=course.zero_shift_n,
            levels_done=course.levels_done,
            cycle=max(course.cycle, 1),  # touches on a circle belong to no cycle
            touches=tuple(course.touches),
            tares=tuple(course.tares),
            lateness=self.cadence.lateness,
            signal_number=signal_number,
            errors=tuple(self.errors),
        )  # fmt: skip

    def _status(self) -> RunStatus:
        course = self.engine.course
        if self.engine.cause is not None:
            return RunStatus.STOPPED
        if course.done and not course.interrupted:
            return RunStatus.COMPLETED
        return RunStatus.INTERRUPTED

    def _watched(self) -> AbstractContextManager[None]:
        """A watch that makes the rig safe where the loop stands still; needs the main thread."""
        if self.rig.clock.virtual or threading.current_thread() is not threading.main_thread():
            return nullcontext()
        return hang_watch(lambda: self.cadence.ticks, self._rescue, self._last_words)

    def _rescue(self) -> None:
        """Make the rig safe from the watch's thread: the loop is held up."""
        held_s, now_s = LOOK_S * LOOKS, self.rig.clock.now_s()
        message = f"the loop has stood still for {held_s:g} s, held up by {self.cadence.busy}"
        self.engine.trip(Cause("hang", held_s, LOOK_S, "s", held_s, now_s, message))
        self.errors.append(message)
        self.safing = make_rig_safe(self.engine, self.rig, self.errors, self.say)

    def _last_words(self) -> str:
        """The final error message, for a main thread that cannot be interrupted."""
        self.engine.operator.on_lost()
        return why_it_stopped(
            RunStatus.STOPPED, self.engine.cause, False, "", self.safing, self.start_s,
            self.rig.clock.now_s(),
        )  # fmt: skip


def _record_end(record: RecordSink, log: EventLog, engine: Engine, outcome: RunOutcome) -> None:
    end_s = outcome.end_s
    actions: list[Event] = [
        (end_s, "safing_action",
         {"name": action.name, "sent": action.sent, "error": action.error,
          "duration_s": action.duration_s})
        for action in outcome.safing
    ]  # fmt: skip
    end: Event = (end_s, "end", {"status": outcome.status.value, "why": outcome.why})
    with suppress(BaseException):  # the outcome must not be lost with the record's end
        for event in (*engine.events, *actions, end):
            log.add(*event)
            record.event(*event)
    engine.events.clear()
    log.close()
