"""The reference and the JSON Schema say what the loader does."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from stepload.declaration.sections import sections_below
from stepload.plan.load import json_schema, load_plan
from stepload.plan.model import Plan
from stepload.plan.reference import PAGES, with_tables

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs" / "plan.md"


def test_the_reference_is_up_to_date() -> None:
    text = "".join((ROOT / page).read_text(encoding="utf-8") for page in PAGES)
    assert with_tables(text) == text, "run: python -m stepload.plan.reference"
    assert all(f"<!-- keys: {kind.__name__} -->" in text for kind in sections_below(Plan))


def test_the_first_plan_of_the_reference_is_good(tmp_path: Path) -> None:
    example = re.search(r"```yaml\n(stepload: 1.*?)```", DOCS.read_text(), re.DOTALL)
    assert example
    path = tmp_path / "plan.yaml"
    path.write_text(example[1].replace("payloads/", f"{ROOT}/procedures/payloads/"))
    assert load_plan(path).procedure.top_force_n == 300.0


def _nodes(schema: Any) -> Iterator[dict[str, Any]]:
    if isinstance(schema, dict):
        yield schema
        for value in schema.values():
            yield from _nodes(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from _nodes(value)


def test_the_schema_is_whole() -> None:
    schema = json.loads(json.dumps(json_schema()))
    assert schema["required"] == ["stepload", "payload", "rig", "procedure"]
    for node in _nodes(schema):
        if isinstance(reference := node.get("$ref"), str):
            assert reference.removeprefix("#/$defs/") in schema["$defs"]
        if isinstance(node.get("pattern"), str):
            assert all(re.search(node["pattern"], example) for example in node["examples"])


@pytest.mark.parametrize("key", ["radius: 3", 'radius: "3"'])
def test_the_schema_refuses_a_number_without_unit(key: str) -> None:
    radius = json_schema()["$defs"]["SphereSection"]["properties"]["radius"]
    value = key.partition(": ")[2].strip('"')
    assert radius["type"] == "string"
    assert not re.search(radius["pattern"], value)


ARM = "arm: {driver: %s, options: {%s}}"


@pytest.mark.parametrize(
    ("rig", "good"),
    [
        (ARM % ("ur", "host: 10.0.0.7, lookahead: 50 ms"), True),
        (ARM % ("ur", "hots: 10.0.0.7"), False),
        (ARM % ("ur", "lookahead: 0.05"), False),
        (ARM % ("ur", "gain: 5"), False),
        (ARM % ("ur", "approach: [0, 0]"), False),
        ("arm: {options: {host: 10.0.0.7}}", True),
        ("arm: {options: {no_driver_has_it: 1}}", False),
        ("force: {driver: line_serial, options: {lookahead: 50 ms}}", False),
    ],
)
def test_an_editor_sees_a_driver_s_options_as_the_driver_does(rig: str, good: bool) -> None:
    text = (ROOT / "procedures" / "plastic-sphere.yaml").read_text()
    plan = yaml.safe_load(text) | {"rig": yaml.safe_load("{" + rig + "}")}
    assert jsonschema.Draft202012Validator(json_schema()).is_valid(plan) is good


def test_every_shipped_plan_is_one_for_an_editor() -> None:
    validator = jsonschema.Draft202012Validator(json_schema())
    for path in sorted((ROOT / "procedures").glob("*.yaml")):
        plan = json.loads(json.dumps(yaml.safe_load(path.read_text()), default=str))  # dates
        assert [error.message for error in validator.iter_errors(plan)] == [], path
