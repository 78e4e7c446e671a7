"""Some faulted and healthy runs of the fault campaign, through the command line."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from long_ones import long, long_rows
from real_runs import ROOT, in_process

PLAN = str(ROOT / "procedures" / "campaign.yaml")
LAUNCH = [
    sys.executable, "-c",
    "from stepload.cli.main import main\nfrom stepload.jobs import jobs\n"
    "if __name__ == '__main__': jobs.BATCH = 1; main()",
    "campaign", PLAN,
]  # fmt: skip
"""The command, with results in small batches: so a campaign can be cut short that is soon over."""
RUNS = 8


def lines(directory: Path) -> list[str]:
    file = directory / "runs.jsonl"
    return file.read_text().splitlines() if file.exists() else []


def test_no_run_comes_above_the_elastic_limit(tmp_path: Path) -> None:
    options = ["--runs", RUNS, "--seed", "2", "--processes", "1", "--out", tmp_path / "c"]
    done = in_process("campaign", PLAN, *options, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    apart = sum(g["runs"] for g in found["groups"] if g["name"].startswith("apart"))
    assert found["runs"] + apart == RUNS
    assert found["above_elastic_limit"] == 0
    assert found["max_peak_ratio"] < 1.0
    assert found["max_j"] < 1.0
    assert found["rate_bound_95"] == pytest.approx(1.0 - 0.05 ** (1.0 / found["runs"]))
    assert len({row["kind"] for row in found["faults"]}) > RUNS // 2
    rows = [json.loads(line) for line in lines(tmp_path / "c")]
    assert {(row["series"], len(row["wrong"])) for row in rows} == {("one", 1), ("six", 1)}


@pytest.mark.parametrize(("runs", "seed"), long_rows([(1, 10), (4, 5)]))
def test_healthy_runs_are_plans_of_labs(tmp_path: Path, runs: int, seed: int) -> None:
    """Some are refused; a directory knows what its runs are."""
    options = ["--runs", runs, "--seed", seed, "--processes", "1", "--out", tmp_path / "c"]
    done = in_process("campaign", PLAN, *options, "--axes", "one", "--faults", "none", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["runs"] + found["refused"] == runs
    assert found["above_elastic_limit"] == 0
    other = in_process("campaign", PLAN, *options, "--axes", "one")
    assert other.returncode != 0
    shown = in_process("campaign", PLAN, "--runs", "1", "--replay", "six-0")
    assert "mount: friction_static" in shown.stdout
    wrong = in_process("campaign", PLAN, "--runs", "1", "--axes", "seven")
    assert wrong.returncode == 2
    assert "one, six or both" in wrong.stderr


@pytest.mark.parametrize("processes", [1, *long([2])])
def test_an_interrupted_campaign_goes_on_to_the_same_result(tmp_path: Path, processes: int) -> None:
    """Of one or two processes, cut short; by one process, and all of it by one process."""
    options = ["--runs", "4", "--seed", "4", "--json"]
    whole = in_process(
        "campaign", PLAN, *options, "--processes", 1, "--out", tmp_path / "whole", "--parquet"
    )
    part = tmp_path / "part"
    process = subprocess.Popen(
        [*LAUNCH, *options, "--processes", str(processes), "--out", str(part)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    while process.poll() is None and not lines(part):
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    process.communicate()
    assert process.returncode in (0, 130)
    with (part / "runs.jsonl").open("a") as file:
        file.write('{"series":"one","ind')  # what a power cut leaves
    rest = in_process("campaign", PLAN, *options, "--processes", 1, "--out", part, "--parquet")
    assert (whole.returncode, rest.returncode) == (0, 0), rest.stderr
    assert sorted(lines(part)) == sorted(lines(tmp_path / "whole"))
    first, second = json.loads(whole.stdout), json.loads(rest.stdout)
    first.pop("elapsed_s"), second.pop("elapsed_s")
    assert first == second
    tables = [(at / "runs.parquet").read_bytes() for at in (part, tmp_path / "whole")]
    assert tables[0] == tables[1]


@pytest.mark.long
def test_an_ablation_takes_a_rule_from_a_campaign_that_is_there(tmp_path: Path) -> None:
    options = [
        "--runs", "10", "--seed", "4", "--faults", "force_freeze", "--processes", "1", "--json",
        "--out", str(tmp_path),
    ]  # fmt: skip
    assert in_process("campaign", PLAN, *options).returncode == 0
    there = lines(tmp_path)
    done = in_process("campaign", PLAN, *options, "--ablate", "R4", "--ablate", "R8")
    assert done.returncode == 0, done.stderr
    assert lines(tmp_path) == there
    found = json.loads(done.stdout)
    frozen, searched = found["without"]["R4"], found["without"]["R8"]
    assert frozen["done_again"] == len(lines(tmp_path / "without-R4")) > 1
    assert frozen["figures"]["runs"] == found["everything"]["runs"] == 10
    assert searched["done_again"] == searched["not_stopped"] == 0
