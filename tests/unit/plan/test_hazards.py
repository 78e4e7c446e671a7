"""Who has read the hazards of a rig: kept in its file, without harm to the file."""

from __future__ import annotations

import stat
from datetime import date
from pathlib import Path

import pytest

from stepload.plan.hazards import hazards_read, keep, read_by, read_words
from stepload.plan.load import load_plan

ROOT = Path(__file__).parents[3]
DAY = date(2026, 3, 1)
HEAD = f"stepload: 1\npayload: {ROOT}/procedures/payloads/plastic-sphere.yaml\n"
TAIL = (
    "procedure: {step: 50 N, top_force: 300 N, surface_distance: 5 mm, surface_uncertainty: 1 mm}\n"
)
BLOCK = "rig:\n  # ours\n  profile: stvf # as bought\n  name: Anna\n"


def _plan(tmp_path: Path, rig: str, newline: str = "\n") -> Path:
    path = tmp_path / "plan.yaml"
    path.write_bytes((HEAD + rig + TAIL).replace("\n", newline).encode())
    return path


@pytest.mark.parametrize(
    "half", ["  hazards_read_by: Anna\n", "  hazards_read_on: 2026-03-01\n",
             "  hazards_read_by: ' '\n  hazards_read_on: 2026-03-01\n"],
)  # fmt: skip
def test_half_a_signature_is_none(tmp_path, half):
    assert not hazards_read(load_plan(_plan(tmp_path, BLOCK + half)))


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("name", ["Anna", 'An: "na" #1', "Åsa\\n"])
def test_the_plan_keeps_who_and_when_and_all_else(tmp_path, newline, name):
    path = _plan(tmp_path, BLOCK, newline)
    path.chmod(0o640)
    before = path.read_bytes().splitlines()
    plan = load_plan(path)
    assert keep(plan, read_by(name, DAY)) == path
    after = load_plan(path)
    assert (after.rig.hazards_read_by, after.rig.hazards_read_on) == (name, DAY)
    assert read_words(after) == f"read {DAY}"
    rows = path.read_bytes().splitlines()
    assert [row for row in rows if b"hazards_read" not in row] == before
    assert (b"\r\n" in path.read_bytes()) == (newline == "\r\n")
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert sorted(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_a_rig_file_of_its_own_keeps_it(tmp_path, mark):
    (tmp_path / "there.yaml").write_text(mark + "profile: stvf\nname: Anna\n")
    (tmp_path / "anna.yaml").symlink_to("there.yaml")
    path = _plan(tmp_path, "rig: anna.yaml\n")
    assert keep(load_plan(path), read_by("Anna", DAY)) == tmp_path / "there.yaml"
    assert hazards_read(load_plan(path))
    assert (tmp_path / "anna.yaml").is_symlink()
    assert (tmp_path / "there.yaml").read_text().startswith(mark)


@pytest.mark.parametrize(
    "rig", ["rig: stvf\n", "rig: {profile: stvf}\n", BLOCK + "  hazards_read_by: Bo\n"]
)
def test_what_cannot_be_kept_changes_nothing(tmp_path, rig):
    path = _plan(tmp_path, rig)
    before = path.read_bytes()
    assert keep(load_plan(path), read_by("Anna", DAY)) is None
    assert path.read_bytes() == before
