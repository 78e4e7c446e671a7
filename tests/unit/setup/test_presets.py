"""Plans that begin with a preset: preflight lets them through, their comments say what is true."""

from __future__ import annotations

from pathlib import Path

import pytest
from bench_fakes import Hands, Rig

from stepload.errors import BadInputError
from stepload.feasibility.reason import PlanVerdict
from stepload.plan.load import load_plan
from stepload.setup.answers import Answers
from stepload.setup.first_plan import first_plan
from stepload.setup.questions import PRESETS, preset

LIMIT = {"force_limit": "300 N"}
MORE: dict[str, dict[str, str]] = {
    "sphere": {},
    "cone": {},
    "pyramid": {},
    "flat-punch": LIMIT,
    "unknown": {"shape": "sphere", "radius": "20 mm", "modulus": "1 GPa to 4 GPa", **LIMIT},
}


def plan_of(name: str, path: Path, given: dict[str, str]) -> str:
    answers = Answers(given, Hands(Rig()), preset=preset(name))
    text, preflight = first_plan(answers, "stvf", path)
    assert preflight.verdict is not PlanVerdict.REFUSED
    path.write_text(text)
    return text


@pytest.mark.parametrize("name", list(PRESETS))
def test_every_preset_is_a_plan_that_preflight_lets_through(name: str, tmp_path: Path) -> None:
    assert set(MORE) == set(PRESETS)
    path = tmp_path / "plan.yaml"
    text = plan_of(name, path, MORE[name])
    assert load_plan(path).procedure.top_force_n > 0.0
    assert max(map(len, text.splitlines())) < 140


@pytest.mark.parametrize("name", ["flat-punch", "unknown"])
def test_no_preset_states_an_elastic_limit(name: str, tmp_path: Path) -> None:
    given = {key: text for key, text in MORE[name].items() if key != "force_limit"}
    with pytest.raises(BadInputError, match="a person must declare it"):
        plan_of(name, tmp_path / "plan.yaml", given)
    assert not any("force_limit" in answers for answers in PRESETS.values())
