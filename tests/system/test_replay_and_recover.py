"""`stepload replay` and `stepload recover` as a user meets them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from real_runs import in_process

from stepload.engine import replay
from stepload.errors import BadInputError
from stepload.record.reader import Event, read_recording


@pytest.fixture
def finished(quick_run: Path) -> Path:
    """The record of a dry run."""
    return quick_run / "run.mcap"


def test_replay_says_which_rule_when_and_by_how_much(finished: Path) -> None:
    done = in_process("replay", finished, "--json")
    assert done.returncode == 0
    found = json.loads(done.stdout)
    assert (found["tripped"], found["notes"]) == (False, [])
    assert found["ticks"] > 1000
    tripped = in_process(
        "replay", finished, "--force-limit", "150 N", "--limit", "contact_n_s_per_m=1 N s/m"
    )
    assert tripped.returncode == 4
    assert "trip by R2 at " in tripped.stdout
    assert " N, limit 150 N, judged by a sample" in tripped.stdout


@pytest.mark.parametrize(
    ("limit", "told"),
    [("speed=1 m/s", "no threshold is called 'speed'"), ("jump_n=1", "has no unit"),
     ("jump_n=nan N", "jump_n"), ("jump_n=-1 N", "finite and positive"), ("jump_n", "jump_n="),
     ("identical_counts=many", "identical_counts=many"), ("jump_n=1 m", "jump_n=1 m"),
     ("identical_counts=1.5", "whole number")],
)  # fmt: skip
def test_a_limit_that_is_none_is_refused(finished: Path, limit: str, told: str) -> None:
    name, _, value = limit.partition("=")
    with pytest.raises(BadInputError) as caught:
        replay.replay_file(finished, {name: value})
    assert told in f"{caught.value}"


def test_what_the_order_of_the_run_ended_is_told_where_no_rule_trips(
    finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = read_recording(finished)
    start_s = float(recording.ticks.time_s[0])
    end = Event(start_s + 2.0, "trip", {"rule": "old_zero", "message": "the zero is \x1btoo old"})
    ended = replace(recording, events=(*recording.events, end))
    assert replay.replay_file(finished).notes == ()
    monkeypatch.setattr(replay, "read_recording", lambda _: ended)
    [note] = replay.replay_file(finished).notes
    assert note.startswith("the run itself was ended by old_zero at 2.000 s: the zero is ")
    assert "\x1b" not in note


def test_recover_says_by_its_exit_code_what_it_did(finished: Path, tmp_path: Path) -> None:
    assert in_process("recover", tmp_path / "nowhere").returncode == 2
    assert in_process("recover", tmp_path).returncode == 0
    assert in_process("recover", "/dev/zero").returncode == 2
    bare = tmp_path / "record"
    bare.write_bytes(finished.read_bytes()[:-200])
    done = in_process("recover", bare)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "record.recovered.mcap").exists()
    (tmp_path / "broken.mcap.part").write_bytes(b"no record")
    done = in_process("recover", tmp_path)
    assert done.returncode == 2
    assert "not repaired: " in done.stdout


def test_a_cut_record_with_the_name_of_a_finished_one_is_repaired_where_it_lies(
    finished: Path, tmp_path: Path
) -> None:
    data = finished.read_bytes()
    (tmp_path / "run.mcap").write_bytes(data[: len(data) // 2])
    said = in_process("recover", tmp_path)
    assert said.returncode == 0, said.stderr
    assert read_recording(tmp_path / "run.recovered.mcap").ticks.time_s.size > 100
    (whole := tmp_path / "whole").mkdir()
    (whole / "run.mcap").write_bytes(data)
    assert f"no unfinished record in {whole}" in in_process("recover", whole).stdout
