"""The verbs of the first day on the command line."""

from __future__ import annotations

import json

import pytest
from bench_fakes import DAY, Hands, Rig, opener, press_nothing
from typer.testing import CliRunner

from stepload.cli.main import app
from stepload.errors import BadInputError, DeviceError, RefusedError
from stepload.plan.load import load_plan
from stepload.setup.answers import Answers
from stepload.setup.wizard import set_up

ARM = {
    "name": "bench", "host": "127.0.0.1", "sensor": "bota-sensone-serial",
    "sensor_options": "port=/dev/null", "hazards_read_by": "A. Tester",
    "keys": "system_stiffness.sigma=2e3 N/m",
}  # fmt: skip
BALL = [
    "--shape", "sphere", "--radius", "25 mm", "--material", "silicone rubber, 50 Shore A",
    "--force-limit", "100 N", "--surface-distance", "3 mm", "--procedure", "retract=8 mm",
]  # fmt: skip


def stepload(*words):
    """Exit code and output of the command; its errors are raised."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.output


@pytest.fixture
def rig_file(tmp_path):
    rig = Rig()
    path = tmp_path / "rig.yaml"
    set_up(path, Answers(ARM, Hands(rig), yes=True), press=press_nothing, until="way", today=DAY,
           open_devices=opener(rig))  # fmt: skip
    return path


def test_init_writes_a_plan_that_preflight_lets_through(rig_file, tmp_path):
    plan = tmp_path / "plans" / "ball.yaml"
    plan.parent.mkdir()
    code, told = stepload("init", rig_file, "--plan", plan, *BALL)
    assert code == 0, told
    assert told.startswith("GO  ")
    assert load_plan(plan, today=DAY).rig.name == "bench"
    assert stepload("preflight", plan)[0] == 0
    with pytest.raises(BadInputError, match="is there already"):
        stepload("init", rig_file, "--plan", plan, *BALL)
    code, told = stepload(
        "init", rig_file, "--plan", plan, *BALL, "--force", "--top-force", "30 N", "--json"
    )
    assert json.loads(told[told.index("{") :])["verdict"] == "go"
    assert load_plan(plan, today=DAY).procedure.top_force_n == 30.0


def test_init_writes_nothing_that_preflight_refuses(rig_file, tmp_path):
    plan = tmp_path / "hard.yaml"
    with pytest.raises(RefusedError, match="preflight refuses the plan"):
        stepload("init", rig_file, "--plan", plan, *BALL, "--top-force", "99 N")
    assert not plan.exists()
    with pytest.raises(BadInputError, match="is no material"):
        stepload("init", rig_file, "--plan", plan, *BALL[:5], "cheese", *BALL[6:])
    with pytest.raises(BadInputError, match="--material is given twice"):
        stepload("init", rig_file, "--plan", plan, *BALL, "--material", "cheese")
    with pytest.raises(BadInputError, match="is no file"):
        stepload("init", tmp_path / "none.yaml", "--plan", plan, *BALL)


def test_init_calls_the_plan_by_the_name_that_it_was_given(rig_file, tmp_path):
    plan = tmp_path / "mine.yaml"
    with pytest.raises(BadInputError) as wrong:
        stepload("init", rig_file, "--plan", plan, *BALL, "--procedure", "hold=3 kg")
    assert f"{plan}, as the answers make it:" in wrong.value.message
    assert ".mine." not in wrong.value.message
    with pytest.raises(BadInputError, match=r"cannot write .*nowhere/mine\.yaml: No such"):
        stepload("init", rig_file, "--plan", tmp_path / "nowhere" / "mine.yaml", *BALL)


def test_setup_without_a_terminal_names_the_missing_flag(tmp_path):
    with pytest.raises(BadInputError, match="no terminal") as missing:
        stepload("setup", tmp_path / "rig.yaml")
    assert "--name ANSWER" in missing.value.hint
    with pytest.raises(BadInputError, match="'--hots' is no question"):
        stepload("setup", tmp_path / "rig.yaml", "--hots", "1")
    with pytest.raises(DeviceError):
        stepload("setup", tmp_path / "rig.yaml", "--name", "x", "--host", "127.0.98.98", "--yes")


def test_the_page_lists_every_question_as_it_is():
    from pathlib import Path

    from stepload.setup.questions import QUESTIONS

    page = (Path(__file__).parents[2] / "docs" / "setup.md").read_text()
    for question in QUESTIONS.values():
        assert f"| `{question.flag}` |" in page
        assert question.text in page


def test_calibrate_says_before_it_presses_that_a_rig_file_cannot_name_the_record(tmp_path):
    mine = tmp_path / "mine.yaml"
    mine.write_text("name: bench\n")
    plan = ["calibrate", tmp_path / "not-even-read.yaml", "--into", mine]
    with pytest.raises(BadInputError, match="somebody else wrote or changed it"):
        stepload(*plan)
    with pytest.raises(BadInputError, match="--into goes with no dry run"):
        stepload(*plan, "--dry-run")
    with pytest.raises(BadInputError, match="was not written by `stepload setup`"):
        stepload(*plan[:-1], tmp_path / "none.yaml")
    assert mine.read_text() == "name: bench\n"
