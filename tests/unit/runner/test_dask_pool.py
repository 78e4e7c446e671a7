"""Batches over a real scheduler and separate workers that are killed while they work."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from counted_work import Counted, Drawn, begun
from dask_cluster import cluster

from stepload.errors import BadInputError, RefusedError
from stepload.runner import cluster as clusters
from stepload.runner.choose import open_pool
from stepload.runner.cluster import DaskPool
from stepload.runner.jobs import Job, Pool, run_all, run_in_order
from stepload.runner.local import LocalPool

JOBS = [Job("a", index) for index in range(60)] + [Job("a", 60, (0.5, 0.25))]


def rows_of(work: Counted, pool: Pool) -> list[Drawn]:
    return sorted(row for batch in run_all(work, JOBS, pool, 4) for row in batch)


def expected(tmp_path: Path) -> list[Drawn]:
    (tmp_path / "here").mkdir()
    with LocalPool(1) as pool:
        return rows_of(Counted(5, tmp_path / "here"), pool)


@pytest.mark.long
def test_rows_are_those_of_the_local_pool_and_other_code_is_refused(tmp_path: Path) -> None:
    """A worker that is there, one that comes later, and one that has other code."""
    with cluster(1) as own, open_pool(scheduler=own.address) as pool:
        work = Counted(5, tmp_path)
        whole = expected(tmp_path)
        assert rows_of(work, pool) == whole
        assert [row for batch in run_in_order(work, JOBS, pool, 4) for row in batch] == whole
        assert len(list(tmp_path.glob("*-*"))) == 2 * len(JOBS)
        with pytest.raises(FileNotFoundError):  # of the job, and no sign of a lost scheduler
            rows_of(Counted(5, tmp_path / "nowhere"), pool)
        own.workers[0].kill()
        own.add_worker(CODE="other")
        with pytest.raises(RefusedError, match="digest other, not asks"):
            rows_of(Counted(5, tmp_path, code="worker"), pool)


@pytest.mark.long
def test_workers_and_a_scheduler_are_killed_and_nothing_is_lost(tmp_path: Path) -> None:
    """A worker in the middle of a batch, then the scheduler, whose workers leave with it."""
    work = Counted(5, tmp_path, takes_s=0.05)
    found: list[Drawn] = []
    with cluster(2) as own, DaskPool(own.address) as pool:
        for number, batch in enumerate(run_all(work, JOBS, pool, 4)):
            found += batch
            if number == 1:
                own.workers[0].kill()
                own.add_worker()
            if number == 5:
                own.restart_scheduler(workers=2)
    assert sorted(found) == expected(tmp_path)
    assert len(list(tmp_path.glob("*-*"))) > len(JOBS)  # some were indeed done again


@pytest.mark.long
def test_a_scheduler_that_stays_away_ends_the_whole(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with cluster(1) as own, DaskPool(own.address, patience_s=0.5) as pool:
        batches = run_all(Counted(5, tmp_path, takes_s=0.05), JOBS, pool, 4)
        assert len(next(batches)) == 4
        own.scheduler.kill()
        with pytest.raises(RefusedError, match="no scheduler answers"):
            list(batches)
    assert "was lost: waiting" in caplog.text


@pytest.mark.long
def test_a_batch_that_its_scheduler_gives_up_is_sent_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A scheduler that gives a batch up with its first worker, and a job that kills two."""
    monkeypatch.setenv("DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES", "0")
    with cluster(3) as own, DaskPool(own.address) as pool:
        assert rows_of(Counted(5, tmp_path, deadly=9, times=2), pool) == expected(tmp_path)
        assert len(begun(tmp_path, 9)) == 3
        monkeypatch.setattr("stepload.runner.losses.MOST_IN_A_ROW", 0)
        with pytest.raises(RefusedError, match="worker of a batch was lost"):
            list(run_all(Counted(5, tmp_path, deadly=0, times=99), JOBS[:1], pool))


@pytest.mark.long
def test_what_would_not_be_the_same_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Workers with two threads, with threads of linear algebra, without stepload; nobody at all."""
    work = Counted(5, tmp_path)
    broken = tmp_path / "broken" / "stepload"
    broken.mkdir(parents=True)
    (broken / "__init__.py").write_text("")
    with cluster(0) as own:
        monkeypatch.setattr(clusters, "CONNECT_S", 3.0)
        with pytest.raises(RefusedError, match="has no worker"):
            DaskPool(own.address)
        monkeypatch.setattr(clusters, "CONNECT_S", 20.0)
        for words, changes, match in (
            (2, {}, "has 2 threads"),
            (1, {"OMP_NUM_THREADS": "4"}, "no OMP_NUM_THREADS=1"),
            (1, {"PYTHONPATH": str(broken.parent)}, "no stepload.runner"),
        ):
            worker = own.add_worker(words, **changes)
            with DaskPool(own.address) as pool, pytest.raises(RefusedError, match=match):
                rows_of(work, pool)
            worker.kill()
            worker.wait()
            own.workers.remove(worker)
    assert not list(tmp_path.glob("*-*"))
    monkeypatch.setattr(clusters, "CONNECT_S", 0.5)
    with pytest.raises(RefusedError, match="no scheduler answers"):
        DaskPool(own.address)


@pytest.mark.parametrize("text", ["", "10.0.0.5", "tcp://10.0.0.5", ":8786", "tcp://a:99999"])
def test_an_address_without_a_port_is_refused(text: str) -> None:
    with pytest.raises(BadInputError, match="no address with a port"):
        DaskPool(text)


def test_a_missing_library_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(BadInputError, match=r"--scheduler needs distributed[^$]*stepload\[dask\]"):
        open_pool(scheduler="tcp://127.0.0.1:1")
    with pytest.raises(BadInputError, match="--processes beside --scheduler"):
        open_pool(2, "tcp://127.0.0.1:1")
