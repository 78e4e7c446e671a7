"""Work for the tests of the runner: cheap jobs that leave a trace of who did them."""

from __future__ import annotations

import os
import random
import signal
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from stepload.jobs.pool import ENVIRONMENT


@dataclass(frozen=True)
class Job:
    """What is to be done."""

    series: str
    index: int


@dataclass(frozen=True, order=True)
class Drawn:
    """A row."""

    series: str
    index: int
    value: float


@dataclass(frozen=True)
class Counted:
    """Draws a number for each job.

    Attributes:
        seed: of the draws.
        traces: where each job that is begun leaves an empty file `index-pid-time`.
        deadly: the job that kills its process with SIGKILL.
        takes_s: what a job takes.
    """

    seed: int
    traces: Path
    deadly: int = -1
    takes_s: float = 0.0

    def run(self, job: Job, /) -> Drawn:
        own = f"{job.index}-{os.getpid()}-{time.monotonic_ns()}"
        (self.traces / own).touch()
        if job.index == self.deadly:
            os.kill(os.getpid(), signal.SIGKILL)
        time.sleep(self.takes_s)
        value = random.Random(f"{self.seed} {job.series} {job.index}").random()
        return Drawn(job.series, job.index, value)


@dataclass(frozen=True)
class Deaf(Counted):
    """Ctrl+C comes into job 2, which takes it for nothing."""

    def run(self, job: Job, /) -> Drawn:
        if job.index == 2:
            with suppress(KeyboardInterrupt):
                os.kill(os.getpid(), signal.SIGINT)
        return super().run(job)


@dataclass(frozen=True)
class Interrupting(Counted):
    """Job 9 sends Ctrl+C to the parent and leaves a file `late` unless it is killed soon."""

    def run(self, job: Job, /) -> Drawn:
        row = super().run(job)
        if job.index == 9:
            os.kill(os.getppid(), signal.SIGINT)
            time.sleep(10.0)
            (self.traces / "late").touch()
        return row


@dataclass(frozen=True)
class Threads:
    """Tells how many threads of linear algebra its process may use, and which process it is."""

    def run(self, job: Job, /) -> tuple[int, list[str | None]]:
        time.sleep(0.05)
        return os.getpid(), [os.environ.get(name) for name in ENVIRONMENT]


def begun(traces: Path, index: int) -> list[Path]:
    """The traces of a job."""
    return list(traces.glob(f"{index}-*"))


@dataclass(frozen=True)
class Meeting:
    """Two jobs of which each waits until the other has been begun too."""

    place: Path

    def run(self, job: Job, /) -> bool:
        (self.place / str(job.index)).touch()
        end_s = time.monotonic() + 120.0
        while len(list(self.place.iterdir())) < 2 and time.monotonic() < end_s:
            time.sleep(0.01)
        return time.monotonic() < end_s
