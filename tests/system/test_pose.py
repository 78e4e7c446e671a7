"""`stepload pose`: small searches, whole."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from real_runs import ROOT, in_process

SMALL = ("pose", "ur5e", "--radius", "300 mm to 500 mm", "--height", "0 mm")
BALL = ROOT / "procedures" / "payloads" / "silicone-sphere.yaml"


def test_poses_are_told_drawn_and_written(tmp_path: Path) -> None:
    out = tmp_path / "poses"
    done = in_process(*SMALL, "--payload", BALL, "--out", out, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert json.loads((out / "pose.json").read_text()) == said
    assert "<svg" in (out / "pose.svg").read_text()
    assert (out / "pose.png").read_bytes().startswith(b"\x89PNG")
    assert said["best"][0]["k_zz_n_per_m"] > said["median_k_zz_n_per_m"]
    assert 1.0 <= said["best"][0]["stuck_ratio"] <= said["best"][0]["largest_stuck_ratio"]
    for words in ("The best of", "silicone sphere has", "Held sideways", "no calibration"):
        assert words in done.stderr
    again = in_process(*SMALL, "--out", out, cwd=tmp_path)
    assert again.returncode == 2
    assert "is there already" in again.stderr


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (("stvf",), 3, "a machine of one axis has no poses"),
        (("ur5e", "--radius", "3 m"), 3, "reaches no place"),
        (("ur5e", "--radius", "3"), 2, "--radius: '3' has no unit"),
        (("ur5e", "--radius", "500 mm to 300 mm"), 2, "is no range"),
        (("ur5e", "--radius", "-300 mm"), 2, "is below 0 m"),
        (("ur5e", "--height", "nan mm"), 2, "--height"),
        (("ur5e", "--height", "20 m"), 2, "more than 10 m"),
        (("ur5e", "--tool", "-10 mm"), 2, "--tool: -10 mm is below 0 m"),
        (("ur5e", "--tool", "10 kg"), 2, "is a mass, not a length"),
        (("ur5e", "--press", "0", "0", "0"), 2, "no direction"),
        (("ur5e", "--press", "nan", "0", "0"), 2, "no direction"),
        (
            ("ur5e", "--payload", ROOT / "procedures" / "plastic-sphere.yaml"),
            2,
            "can press with 269 N at most",
        ),
        (("ur5e", "--arm", "ur7"), 2, "no arm is named 'ur7'"),
        (("ur5e", "--calibration", "none.json"), 2, "none.json"),
        (("ur5e", "--out", "file"), 2, "that is a file"),
    ],
)
def test_what_cannot_be_done_is_refused_in_a_sentence(
    tmp_path: Path, words: tuple[object, ...], code: int, told: str
) -> None:
    (tmp_path / "file").write_text("mine")
    said = in_process("pose", *words, cwd=tmp_path)
    assert said.returncode == code, said.stderr
    assert told in said.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
