"""The verbs of the first day on the command line."""

from __future__ import annotations

import json

import pytest
from bench_fakes import DAY, Hands, Rig, opener, press_nothing
from typer.testing import CliRunner

from stepload.cli.main import app
from stepload.errors import BadInputError, DeviceError
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
