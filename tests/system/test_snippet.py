"""`stepload snippet`: from a record to what a simulator reads."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from real_runs import in_process, results

DRAKE = "{http://drake.mit.edu}"


@pytest.fixture
def run(quick_run: Path) -> Path:
    """The directory of a dry run."""
    return quick_run


def test_every_simulator_gets_what_its_parser_takes(run: Path) -> None:
    told = json.loads(
        in_process("snippet", run, "--for", "mujoco", "--at", "200 N", "--json").stdout
    )  # fmt: skip
    joint = results(run)["fits"]["joint"]
    # Tangent = n times the secant at that force; another weighing of the same data.
    at_200 = (200.0 ** (joint["n"] - 1.0) * joint["k"]) ** (1.0 / joint["n"])
    assert told["stiffness_n_per_m"] == pytest.approx(joint["n"] * at_200, rel=0.05)
    assert told["verdict"] == results(run)["verdict"]
    low, high = told["interval_n_per_m"]
    assert low < told["stiffness_n_per_m"] < high
    assert ElementTree.fromstring(told["snippet"]).find("contact/pair") is not None
    sdf = in_process("snippet", run, "--for", "drake", "--at", "200 N")
    stiffness = ElementTree.fromstring(sdf.stdout).find(f"{DRAKE}point_contact_stiffness")
    assert stiffness is not None
    assert float(stiffness.text or "") == pytest.approx(2 * told["stiffness_n_per_m"], rel=1e-5)


@pytest.mark.parametrize(
    "words",
    [
        ("--for", "gazebo"),
        ("--for", "drake", "--at", "400 N"),
        ("--for", "drake", "--mass", "1 kg"),
        ("--for", "mujoco", "--mass", "0 kg"),
        ("--for", "mujoco", "--stiffness", "secant"),
    ],
)
def test_what_cannot_be_said_is_refused(run: Path, words: tuple[str, ...]) -> None:
    done = in_process("snippet", run, *words)
    assert done.returncode == 2
    assert done.stdout == ""
