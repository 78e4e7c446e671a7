"""Real `stepload` processes: a quick plan, and a stage to stop them on."""

from __future__ import annotations

import fcntl
import gc
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from real_runs import CYCLES, QUICK, Staged, StageServer, in_process


@pytest.fixture(scope="session", autouse=True)
def _nothing_to_collect() -> None:
    """Every run collects garbage before it begins; what was imported for the tests is none."""
    import scipy.optimize  # noqa: F401

    import stepload.report.analyse  # noqa: F401

    gc.collect()
    gc.freeze()


@pytest.fixture
def quick(tmp_path: Path) -> Path:
    """A plan of about 8 s on the simulated rig, with every phase but unloading."""
    path = tmp_path / "quick.yaml"
    path.write_text(QUICK)
    return path


def _made(place: Path, *words: object, drawn: bool | tuple[str, ...] = ()) -> Path:
    """What a command with `--out` makes in `place`, made by whichever worker comes first; beside it
    what the command said."""
    place.mkdir(exist_ok=True)
    out = place / "run"
    with (place / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (place / "said.txt").exists():
            done = in_process(*words, "--out", out, drawn=drawn)
            assert done.returncode == 0, done.stderr
            (place / "said.txt").write_text(done.stdout)
    return out


@pytest.fixture(scope="session")
def for_all_workers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory that all processes of the session have in common."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


def _plan(path: Path, text: str) -> Path:
    """The plan as a file, whole whenever another worker reads it."""
    made = path.with_suffix(f".{os.getpid()}")
    made.write_text(text)
    return made.rename(path)


@pytest.fixture(scope="session")
def quick_plan(for_all_workers: Path) -> Path:
    """The quick plan as a file of the session."""
    return _plan(for_all_workers / "quick.yaml", QUICK)


@pytest.fixture(scope="session")
def quick_run(quick_plan: Path, for_all_workers: Path) -> Path:
    """The directory of one dry run of the quick plan, without figures; to be read only."""
    return _made(for_all_workers / "quick", "run", quick_plan, "--dry-run", "--quiet")


@pytest.fixture(scope="session")
def cycles_run(for_all_workers: Path) -> Path:
    """The same for a quick plan of two cycles, with unloading; it is identified."""
    plan = _plan(for_all_workers / "cycles.yaml", CYCLES)
    return _made(for_all_workers / "cycles", "run", plan, "--dry-run", "--quiet")


@pytest.fixture(scope="session")
def cycles_again(cycles_run: Path, for_all_workers: Path) -> Path:
    """The same record evaluated again, with figures."""
    return _made(for_all_workers / "again", "identify", cycles_run, drawn=True)


@pytest.fixture(scope="session")
def stage_server() -> Iterator[StageServer]:
    server = StageServer()
    yield server
    server.close()


@pytest.fixture
def stage(stage_server: StageServer) -> Iterator[Callable[..., Staged]]:
    """Starts staged processes and ends what is left of them."""
    started: list[Staged] = []

    def start(directions: dict[str, Any], *arguments: object) -> Staged:
        started.append(Staged(stage_server, directions, arguments))
        return started[-1]

    yield start
    for staged in started:
        staged.close()
