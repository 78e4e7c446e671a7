"""A Dask scheduler and workers on loopback, each a process of its own that can be killed."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from stepload.runner.threads import THREADS

HERE = Path(__file__).parent


class Cluster:
    """Its scheduler has the same address after a restart."""

    def __init__(self) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = int(probe.getsockname()[1])
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.scheduler = self._start_scheduler()
        self.workers: list[subprocess.Popen[bytes]] = []

    def _start(self, *words: str, **changes: str) -> subprocess.Popen[bytes]:
        env = os.environ | dict.fromkeys(THREADS, "1") | changes
        own = changes.get("PYTHONPATH", "")
        env["PYTHONPATH"] = os.pathsep.join(filter(None, [own, str(HERE), *sys.path]))
        command = [sys.executable, "-m", "dask", *words, "--host", "127.0.0.1", "--no-dashboard"]
        return subprocess.Popen(
            command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )

    def _start_scheduler(self) -> subprocess.Popen[bytes]:
        return self._start("scheduler", "--port", str(self.port), "--no-jupyter")

    def add_worker(self, threads: int = 1, **changes: str) -> subprocess.Popen[bytes]:
        """One more worker with these environment variables."""
        words = ("worker", self.address, "--nthreads", str(threads), "--no-nanny")
        self.workers.append(self._start(*words, **changes))
        return self.workers[-1]

    def restart_scheduler(self, workers: int) -> None:
        """Kill it and begin a new one; workers leave a scheduler that is gone, and come anew."""
        self.scheduler.kill()
        self.scheduler.wait()
        self.scheduler = self._start_scheduler()
        for _ in range(workers):
            self.add_worker()

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@contextmanager
def cluster(workers: int) -> Iterator[Cluster]:
    """A scheduler and its workers, until the end of the `with` block."""
    own = Cluster()
    try:
        for _ in range(workers):
            own.add_worker()
        wait_for(own.address)
        yield own
    finally:
        own.close()


def wait_for(address: str, give_up_s: float = 60.0) -> None:
    """Until something listens there."""
    host, port = address.removeprefix("tcp://").split(":")
    end_s = time.monotonic() + give_up_s
    while True:
        try:
            socket.create_connection((host, int(port)), timeout=1.0).close()
            return
        except OSError:
            if time.monotonic() > end_s:
                raise
            time.sleep(0.05)
