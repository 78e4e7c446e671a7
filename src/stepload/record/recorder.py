"""What the engine records with: a push costs under a microsecond and never touches the disk."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Thread
from typing import NoReturn

from stepload.errors import BadInputError, ExitCode, SteploadError
from stepload.record.container import Appender, sync_directory
from stepload.record.layout import EVENTS, STREAMS
from stepload.record.plain import to_json
from stepload.record.recovery import PART_SUFFIX, Recovered, copy_whole
from stepload.record.ring import RINGS, Shared, State, capacities
from stepload.record.rows import TickRow
from stepload.record.scan import Scan, count_messages
from stepload.record.writer_process import Start, Writer, begin
from stepload.rig.clock import Clock
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample

NAME = "run.mcap"
MAX_RATE_HZ = 10_000.0
TIMEOUT_S = 30.0
"""Longest wait for the writer where nothing is lost by waiting."""
SILENT_S = 2.0
"""Data that wait for so long are told of."""
STALLED_S = 12.0
"""The same ends the run: the rest of the 16 s that memory holds is for making the arm safe."""
KILL_S = 2.0
_WRITER_ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1",
    "MALLOC_MMAP_THRESHOLD_": str(1 << 28),
    "MALLOC_TRIM_THRESHOLD_": str(1 << 28),
}
"""glibc keeps the memory of a chunk for the next one: getting it anew is a fifth of the writing."""
_LOOK_S = 0.1
"""How often the writer process itself is looked at (a system call)."""
_STANDS = {
    "T": "it was stopped by a signal (kill -CONT {pid})", "D": "it waits for the disk",
    "R": "the computer is too busy for it",
}  # fmt: skip
"""What a state in /proc/PID/stat means."""


class RecordingFailedError(SteploadError):
    """The record could not be written to its end (exit code 4)."""

    exit_code = ExitCode.STOPPED


class Recorder:
    """Records one run into `directory`/run.mcap, through a process of its own.

    The writer process puts everything on the disk every 50 ms and outlives this process. Until
    `finish` the file is called run.mcap.part.

    Args:
        directory: existing directory of the run; nothing outside of it is written.
        rates_hz: nominal rate of each stream that will come: "force", "arm" and "tick", also
            "second_force" and "displacement" where the rig has them.
        clock: the run's clock; its offset to wall time is taken once, here.
        metadata: flat texts for the record's "run" metadata.
        attachments: files to keep in the record, by name.
        lossless: wait when the disk does not keep up (virtual time) instead of dropping.
        say: takes a line for the operator, and must return at once.

    Raises:
        BadInputError: the directory cannot be written to, or holds a record already.
        RecordingFailedError: the writer process did not start, or the disk is full.
    """

    force: Callable[[ForceSample], None]
    second_force: Callable[[ForceSample], None]
    arm: Callable[[ArmSample], None]
    displacement: Callable[[DisplacementSample], None]
    tick: Callable[[TickRow], None]

    def __init__(
        self,
        directory: Path,
        *,
        rates_hz: Mapping[str, float],
        clock: Clock,
        metadata: Mapping[str, str],
        attachments: Mapping[str, bytes],
        lossless: bool,
        say: Callable[[str], None] = lambda text: None,
    ) -> None:
        for name, rate_hz in rates_hz.items():
            if not 0.0 < rate_hz <= MAX_RATE_HZ:
                raise BadInputError(
                    f"rate of {name}: {rate_hz} Hz, must be within 0 … {MAX_RATE_HZ}"
                )
        self.path = directory / NAME
        self.part_path = directory / (NAME + PART_SUFFIX)
        self._lossless = lossless
        self._say = say
        self._look_at_s = time.monotonic()
        self._silent = self._stalled = False
        self._events = 0
        self._problem = ""
        self._closed = False
        wall_ns = time.time_ns()
        offset_ns = wall_ns - round(clock.now_s() * 1e9)
        checksums = {
            f"sha256 {name}": hashlib.sha256(data).hexdigest() for name, data in attachments.items()
        }
        told = {
            **metadata,
            "clock": "virtual" if clock.virtual else "monotonic",
            "clock_offset_ns": str(offset_ns),
            "rates_hz": json.dumps(dict(rates_hz)),
            **checksums,
        }
        self._start = Start(
            dict(rates_hz), offset_ns, wall_ns, self.part_path, told, dict(attachments)
        )
        self._file_fd = file_fd = _open_locked(self.part_path, self.path)
        try:
            self._shared, memory_fd = Shared.create(capacities(rates_hz))
            try:
                self._process, self._control = _spawn(file_fd, memory_fd)
            except OSError:
                self._shared.close()
                raise
            finally:
                os.close(memory_fd)
        except OSError as error:
            self.part_path.unlink()
            os.close(file_fd)
            raise RecordingFailedError(f"cannot start the record writer: {error}") from error
        self._counters = self._shared.counters
        for name in rates_hz:
            setattr(self, name, self._shared.producer(name, self._wait_for_room))
        self._push_event = self._shared.event_producer(self._wait_for_room)
        try:
            self._send(self._start)
            self._wait_until_running()
        except BaseException as error:
            self.abandon()
            self.part_path.unlink(missing_ok=True)
            if isinstance(error, OSError):
                raise RecordingFailedError(f"the record writer went away: {error}") from error
            raise

    def recorded(self, stream: str) -> int:
        """Rows of a stream that are safely on the disk."""
        return self._shared.recorded(stream)

    def event(self, time_s: float, kind: str, data: Mapping[str, object]) -> None:
        """Record something that happened, with its numbers."""
        self._push_event(time_s, to_json({"time_s": time_s, "kind": kind, "data": data}))
        self._events += 1

    def sync(self) -> None:
        """Return once everything pushed so far is on the disk, readable at `part_path`.

        Raises:
            RecordingFailedError: it will not get there.
        """
        rows = [name for name in STREAMS if self._shared.capacity[name]]

        def behind() -> bool:
            events = self._shared.recorded("events") + self._shared.dropped("events")
            return events < self._events or any(self._shared.waiting(name) for name in rows)

        self._wait(lambda: bool(self.problem()) or not behind())
        if behind():
            self._fail("the record writer does not keep up")

    def problem(self) -> str:
        """Why the record is not what it should be; "" while all is well. Never blocks."""
        now_s, state = time.monotonic(), self._counters[0] if not self._closed else None
        if self._problem or self._closed or (state == State.RUNNING and now_s < self._look_at_s):
            return self._problem
        self._look_at_s = now_s + _LOOK_S
        if state == State.FAILED:
            self._problem = f"the record cannot be written: {self._shared.text}"
        elif state == State.UNNAMED:
            self._problem = self._shared.text
        elif self._process.poll() is not None and state != State.CLOSED:
            self._problem = f"the record writer ended with code {self._process.returncode}"
        elif lost := {n: self._shared.dropped(n) for n in RINGS if self._shared.dropped(n)}:
            rows = ", ".join(f"{count} of {name}" for name, count in lost.items())
            self._problem = f"the disk does not keep up, rows were dropped: {rows}"
        elif state == State.RUNNING and not self._lossless:
            self._look_behind()
        return self._problem

    def _look_behind(self) -> None:
        """Look how much of what came waits for the disk; a busy writer has the time of the ring."""
        rates = self._start.rates_hz.items()
        behind_s = max(self._shared.waiting(name) / rate_hz for name, rate_hz in rates)
        was, self._silent = self._silent, behind_s > SILENT_S
        if self._silent and not was:
            told = f"record: {behind_s:.0f} s of data wait to be written: {self._standing()}."
            self._say(f"{told} After {STALLED_S:.0f} s the run ends.")
        if behind_s > STALLED_S:
            self._stalled = True
            self._problem = f"{behind_s:.0f} s of data could not be written: {self._standing()}"

    def _standing(self) -> str:
        """What the writer process does instead of writing."""
        pid, state = self._process.pid, ""
        with contextlib.suppress(OSError, IndexError):
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        why = _STANDS.get(state, f"its state is {state or 'unknown'}").format(pid=pid)
        return f"writer process {pid}, {why}"

    def finish(self, results: Mapping[str, object], verdict: str) -> Path:
        """Write results and summary, read everything back, and give the file its final name.

        Returns:
            The path of the finished record.

        Raises:
            RecordingFailedError: not everything is in the file; it stays run.mcap.part and can be
                repaired.
        """
        self._send((verdict, to_json(results, indent=1)))
        if not self._ended():
            self._fail("the record cannot be finished")
        if self._counters[0] != State.CLOSED:
            self._fail(f"the record writer ended with code {self._process.returncode}")
        found = count_messages(self.part_path)
        for name in RINGS:
            if self._shared.capacity[name]:
                topics = STREAMS[name].topics if name in STREAMS else (EVENTS,)
                topic, written = topics[0].name, self._shared.recorded(name)
                if found.get(topic, 0) != written:
                    self._fail(f"{topic}: {written} written, {found.get(topic, 0)} read back")
        try:  # still locked, so that no other process takes it for unfinished in between
            os.rename(self.part_path, self.path)
        except OSError as error:
            self._fail(f"cannot be renamed to {self.path.name}: {error.strerror}")
        self.abandon()
        sync_directory(self.path.parent)
        return self.path

    def rescue(self, places: Iterable[Path]) -> Recovered | None:
        """Write all that there is, from the file and from memory, into the first directory that
        takes it; nothing can be recorded after that."""
        self._end_writer()
        fcntl.flock(self._file_fd, fcntl.LOCK_UN)
        for place in places:
            with contextlib.suppress(Exception):  # the last resort: the next place may do
                with open(f"/proc/self/fd/{self._file_fd}", "rb") as file:
                    scan = Scan(file, os.fstat(self._file_fd).st_size)
                    name, target = self.part_path.name, place / NAME
                    found = copy_whole(file, scan, target, name, self._rest)
                if target == self.path:
                    self.part_path.unlink(missing_ok=True)
                sync_directory(place)
                return found
        return None

    def _rest(self, out: Appender) -> None:
        """Write what is in memory only."""
        if not out.counts:  # nothing of the file can be read
            begin(out, self._start)
        Writer(out, self._shared, self._start.offset_ns).drain()

    def abandon(self) -> None:
        """Stop recording. What was pushed gets to the disk; the file stays run.mcap.part."""
        if self._closed:
            return
        self.problem()
        self._end_writer()
        self._closed = True
        for name in (*STREAMS, "_push_event"):
            setattr(self, name, _closed)
        self._shared.close()
        os.close(self._file_fd)

    def _end_writer(self) -> None:
        """Close what the writer listens to, and wait for its end; a stalled one is killed."""
        if not self._control.closed:
            self._control.close()
        if not self._ended():
            self._process.kill()
            with contextlib.suppress(subprocess.TimeoutExpired):  # its disk may hold it for ever
                self._process.wait(KILL_S)

    def _ended(self) -> bool:
        """Whether the writer ends in the time that it has."""
        limit_s = KILL_S if self._stalled else TIMEOUT_S
        return self._wait(lambda: self._process.poll() is not None, limit_s)

    def _wait(self, done: Callable[[], bool], limit_s: float = TIMEOUT_S) -> bool:
        """Whether it comes true in time; what it waits for is said after 2 s."""
        begun_s, said = time.monotonic(), False
        while not done():
            waited_s = time.monotonic() - begun_s
            if (over := waited_s > limit_s) or (waited_s > SILENT_S and not said):
                said, told = True, f"waited {waited_s:.0f} s for {self._standing()}"
                if over:
                    self._stalled, self._problem = True, self._problem or told
                    return False
                self._say(f"record: {told}")
            time.sleep(0.001)
        return True

    def _send(self, message: object) -> None:
        """Send without waiting: a writer that stands still never takes the whole of it."""

        def send() -> None:
            with contextlib.suppress(Exception):  # the writer is gone, which its process tells
                self._control.send(message)

        Thread(target=send, name="record", daemon=True).start()

    def _fail(self, why: str) -> NoReturn:
        why = self.problem() or why
        where = "" if str(self.part_path) in why else f"{self.part_path}: "
        raise RecordingFailedError(f"{where}{why}")

    def _wait_until_running(self) -> None:
        self._wait(lambda: self._counters[0] == State.RUNNING or bool(self.problem()))
        if self.problem():
            self._fail(self._problem)

    def _wait_for_room(self, has_room: Callable[[], bool]) -> bool:
        """Called with a full ring: whether there is room now. Waits for it when lossless."""
        if self._lossless:
            self._wait(lambda: has_room() or bool(self.problem()))
        return has_room()


def _closed(*_: object) -> NoReturn:
    raise RuntimeError("the recorder is closed")


def _open_locked(part: Path, final: Path) -> int:
    """A new locked file, which no repair takes for unfinished while a descriptor to it is open."""
    if final.exists():
        raise BadInputError(f"{final} exists already", hint="a run needs a directory of its own")
    try:
        fd = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
    except FileExistsError as error:
        raise BadInputError(
            f"{part} exists: an unfinished record", hint="repair it first: `stepload recover`"
        ) from error
    except OSError as error:
        raise BadInputError(
            f"cannot record to {part}: {error.strerror}", hint="choose another directory"
        ) from error
    fcntl.flock(fd, fcntl.LOCK_EX)
    return fd


def _spawn(file_fd: int, memory_fd: int) -> tuple[subprocess.Popen[bytes], Connection]:
    """Start the writer with signals blocked, so that Ctrl+C never reaches it."""
    blocked = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    program = [sys.executable, "-P", "-m", "stepload.record.writer_process"]
    theirs, ours = os.pipe()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, blocked)
    try:
        process = subprocess.Popen(
            [*program, str(file_fd), str(memory_fd)],
            stdin=theirs,
            stdout=subprocess.DEVNULL,
            pass_fds=(file_fd, memory_fd),
            env={**os.environ, **_WRITER_ENVIRONMENT},
        )
    except OSError:
        os.close(ours)
        raise
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        os.close(theirs)
    return process, Connection(ours, readable=False)
