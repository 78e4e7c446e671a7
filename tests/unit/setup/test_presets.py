"""Plans that begin with a preset: preflight lets them through, their comments say what is true."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from bench_fakes import Hands, Rig

from stepload.declaration.sections import keys, sections_below
from stepload.envelope.envelope import envelope_of
from stepload.envelope.reason import PlanVerdict
from stepload.errors import BadInputError
from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.setup.answers import Answers
from stepload.setup.first_plan import first_plan
from stepload.setup.plan_notes import NOTES
from stepload.setup.presets import PRESETS, preset

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
    text, envelope = first_plan(answers, "stvf", path)
    assert envelope.verdict is not PlanVerdict.REFUSED
    path.write_text(text)
    return text


def filled(text: str) -> dict[str, Any]:
    """The plan with every key that its comments offer."""
    plan, offer = text.split("# Often wanted")
    found, section = yaml.safe_load(plan), ""
    lines = offer.splitlines()[1:]
    for line in lines:
        body = line.removeprefix("# ").replace("(above)", "")
        if body.startswith(" "):
            found[section] = found.get(section, {}) | yaml.safe_load(body)
        else:
            section = body.strip().rstrip(":")
    return found


@pytest.mark.parametrize("name", list(PRESETS))
def test_every_preset_is_a_plan_that_preflight_lets_through(name: str, tmp_path: Path) -> None:
    assert set(MORE) == set(PRESETS)
    path = tmp_path / "plan.yaml"
    text = plan_of(name, path, MORE[name])
    plan = load_plan(path)
    assert max(map(len, text.splitlines())) < 140
    path.write_text(yaml.safe_dump(filled(text)))
    more = load_plan(path)
    assert envelope_of(more).verdict is not PlanVerdict.REFUSED
    assert more.record.specimen == "A-17"
    assert more.procedure.hold_s == plan.procedure.hold_s
    assert more.procedure.cycles == plan.procedure.cycles


@pytest.mark.parametrize("name", ["flat-punch", "unknown"])
def test_no_preset_states_an_elastic_limit(name: str, tmp_path: Path) -> None:
    given = {key: text for key, text in MORE[name].items() if key != "force_limit"}
    with pytest.raises(BadInputError, match="a person must declare it"):
        plan_of(name, tmp_path / "plan.yaml", given)
    assert not any("force_limit" in answers for answers in PRESETS.values())


def test_an_unknown_material_asks_for_its_range(tmp_path: Path) -> None:
    given = {key: text for key, text in MORE["unknown"].items() if key != "modulus"}
    with pytest.raises(BadInputError) as missing:
        plan_of("unknown", tmp_path / "plan.yaml", given)
    assert "--modulus" in missing.value.hint
    text = plan_of("unknown", tmp_path / "plan.yaml", MORE["unknown"])
    body = load_plan(tmp_path / "plan.yaml").payload.material
    assert body.youngs_modulus_ends_pa == (1e9, 4e9)
    assert body.poisson_ratio_ends == (0.0, 0.5)
    assert "nothing is known of it" in text


def test_a_comment_says_where_a_value_is_from(tmp_path: Path) -> None:
    text = plan_of("sphere", tmp_path / "plan.yaml", {"radius": "30 mm"})
    assert "radius: 30 mm # stated" in text
    assert "surface_distance: 5 mm # preset, change it" in text
    assert "surface_uncertainty: 1 mm # default" in text
    assert "youngs_modulus: 2.75 GPa # as in stepload's payload" in text


def test_notes_are_of_keys_that_there_are(tmp_path: Path) -> None:
    known = {key.name for kind in sections_below(Plan) for key in keys(kind)}
    assert {key.rpartition(".")[2] for key in NOTES} - {"stepload"} <= known
    for part in (f"  # {NOTES['payload.name']}\n  name:", f"# {NOTES['rig']}\nrig:"):
        assert part in plan_of("cone", tmp_path / "plan.yaml", {})


def test_another_name_is_no_preset() -> None:
    with pytest.raises(BadInputError, match="'spere' is no preset") as wrong:
        preset("spere")
    assert "did you mean sphere?" in wrong.value.hint
