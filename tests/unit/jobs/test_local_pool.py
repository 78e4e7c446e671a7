"""Batches over processes of this machine: the same rows, however many do them."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import closing, suppress
from itertools import chain
from pathlib import Path

import pytest
from counted_work import Counted, Deaf, Drawn, Interrupting, Job, Meeting, Threads, begun

from stepload.errors import RefusedError
from stepload.jobs.jobs import TAIL, run_all
from stepload.jobs.pool import Pool, interruptible

JOBS = [Job("a", index) for index in range(31)]


def test_rows_do_not_depend_on_the_number_of_processes(tmp_path: Path) -> None:
    work = Counted(5, tmp_path)
    whole = [work.run(job) for job in JOBS]
    for processes in (1, 2):
        with Pool(processes) as pool:
            batches = list(run_all(work, JOBS, pool, 4))
        assert max(len(batch) for batch in batches) == (1 if processes == 1 else 31 // TAIL)
        assert sorted(row for batch in batches for row in batch) == sorted(whole)
    assert whole != [Counted(6, tmp_path).run(job) for job in JOBS]


def test_batches_become_smaller_towards_the_end_and_leave_nothing_out(tmp_path: Path) -> None:
    jobs = [Job("a", index) for index in range(100)]
    with Pool(2) as pool:
        batches = [len(batch) for batch in run_all(Counted(5, tmp_path), jobs, pool, 5)]
    assert sum(batches) == 100
    assert (max(batches), batches.count(1) >= TAIL) == (5, True)


def test_two_processes_work_at_the_same_time(tmp_path: Path) -> None:
    with Pool(2) as pool:
        rows = [row for batch in run_all(Meeting(tmp_path), JOBS[:2], pool, 1) for row in batch]
    assert rows == [True, True]


@pytest.fixture
def hears_ctrl_c() -> Iterator[None]:
    """Also where the tests run in the background, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("hears_ctrl_c")
def test_a_job_that_ctrl_c_came_into_has_no_result_even_where_it_caught_it(tmp_path: Path) -> None:
    """As a simulated run, which ends by it as by a fault; the jobs before it have theirs."""
    rows: list[Drawn] = []
    with pytest.raises(KeyboardInterrupt):
        rows.extend(chain.from_iterable(run_all(Deaf(5, tmp_path), JOBS, Pool(1), 25)))
    assert rows == [Counted(5, tmp_path).run(job) for job in JOBS[:2]]
    assert not begun(tmp_path, 3)


@pytest.mark.usefixtures("hears_ctrl_c")
def test_ctrl_c_counts_also_where_the_block_ends_by_another_error() -> None:
    def deaf() -> None:
        with suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        raise RefusedError("no such run")

    with pytest.raises(KeyboardInterrupt), interruptible():
        deaf()


@pytest.mark.usefixtures("hears_ctrl_c")
def test_ctrl_c_gives_up_what_is_being_done_and_what_came_is_kept(tmp_path: Path) -> None:
    rows: list[Drawn] = []
    with Pool(2) as pool, pytest.raises(KeyboardInterrupt):
        rows.extend(chain.from_iterable(run_all(Interrupting(5, tmp_path), JOBS, pool, 1)))
    assert len(rows) >= 8
    assert not list(tmp_path.glob("late"))


def test_a_killed_process_ends_the_whole(tmp_path: Path) -> None:
    work = Counted(5, tmp_path, deadly=9)
    with Pool(2) as pool, pytest.raises(RefusedError):
        list(run_all(work, JOBS, pool, 1))
    assert len(begun(tmp_path, 9)) == 1


def test_what_is_given_up_ends_soon(tmp_path: Path) -> None:
    work = Counted(5, tmp_path, takes_s=0.01)
    jobs = [Job("a", index) for index in range(400)]
    with Pool(2) as pool, closing(run_all(work, jobs, pool, 4)) as batches:
        next(batches)
    assert len(list(tmp_path.iterdir())) < 100


def test_an_error_in_a_job_comes_through(tmp_path: Path) -> None:
    work = Counted(5, tmp_path / "nowhere")
    for processes in (1, 2):
        with Pool(processes) as pool, pytest.raises(FileNotFoundError):
            list(run_all(work, JOBS, pool))


def test_a_process_uses_one_thread_and_no_module_of_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "7")
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    with Pool(2) as pool:
        told = [row for batch in run_all(Threads(), JOBS[:8], pool, 1) for row in batch]
    assert {pid for pid, _ in told} - {os.getpid()}
    assert all(counts == ["1"] * 4 for _, counts in told)
    assert os.environ["OPENBLAS_NUM_THREADS"] == "7"
    assert "OMP_NUM_THREADS" not in os.environ
