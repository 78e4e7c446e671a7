"""The `--json` objects of version 1: every key, every type, every figure that a seed decides.

The expected objects stand in json_version_1/. What the host, the clock or chance decides is masked
there by its type: it must be there, and of that type. To write them anew after a wanted change:
`python tests/system/test_json_version_1.py`; a key that goes or changes its meaning breaks who
reads it.
"""

from __future__ import annotations

import json
import tempfile
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from real_runs import QUICK, ROOT, in_process, stepload

from stepload.design import map as cells
from stepload.design import plan_design

EXPECTED = Path(__file__).parent / "json_version_1"
PAYLOADS = ROOT / "procedures" / "payloads"
SPHERE = PAYLOADS / "plastic-sphere.yaml"
RELATIVE, ABSOLUTE = 1e-3, 1e-9
"""Fits go through linear algebra that differs from build to build in the last digits."""
SMOOTH = QUICK.replace("profile: stvf", "profile: stvf\n  simulation: {law: smooth}")
CYCLES = SMOOTH.replace("unload: false\n  cycles: 1", "unload: true\n  cycles: 2")
FLAT = QUICK.replace("plastic-sphere", "stiff-flat") + "identify: {kind: system}\n"
TOO_MUCH = QUICK.replace("top_force: 300 N", "top_force: 900 N")
CURVE = "displacement_m,force_n\n" + "".join(
    f"{i * 1e-6},{6.5e8 * (i * 1e-6) ** 1.5 + 0.1 * (7 * i % 11)}\n" for i in range(60)
)
MASKED = (
    "*.directory", "*.path", "*.run_id", "*.why_it_ended", "*.safing.duration_s",
    "*.run.started", "*.run.files.*", "*.run.stepload", "*.versions.*",
    "compare.headline", "compare.runs.name",
    "compare.curve.run", "compare.results.name", "compare.bounds.name", "compare.groups",
    "compare.differences.first",
    "compare.differences.second", "compare.differences.why", "calibrate*.record",
    "*.calibration.run", "*.measured_on", "*.valid_until", "campaign.elapsed_s", "bad_input.error",
    "snippet.snippet", "pose.answers", "design.plan",
)  # fmt: skip
AS_A_PROCESS = ("identify_curve",)
"""Where whatever a library writes past Python's streams would be seen too."""
EXIT_CODES = {"preflight_refused": 3, "bad_input": 2}
"""Of the verbs that do not end with 0."""
OF_THE_HOST = ("disk", "real-time")


def masked(place: str, value: Any) -> Any:
    """`value` with the type in place of what another run or another machine changes."""
    if isinstance(value, dict):
        if "mark" in value and value["name"].startswith(OF_THE_HOST):
            return {key: v if key == "name" else type(v).__name__ for key, v in value.items()}
        return {key: masked(f"{place}.{key}", item) for key, item in value.items()}
    if isinstance(value, list):
        return [masked(place, item) for item in value]
    return type(value).__name__ if any(fnmatch(place, mask) for mask in MASKED) else value


def objects(directory: Path) -> dict[str, Any]:
    """What every verb says with `--json`."""
    made = {}
    for name, text in {
        "one.yaml": CYCLES, "two.yaml": SMOOTH, "flat.yaml": FLAT, "much.yaml": TOO_MUCH,
        "curve.csv": CURVE,
    }.items():  # fmt: skip
        (directory / name).write_text(text)

    def verb(name: str, *words: object) -> None:
        say = stepload if name in AS_A_PROCESS else in_process
        done = say(*words, "--json", cwd=directory)
        assert done.returncode == EXIT_CODES.get(name, 0), done.stderr
        assert done.stdout.count("\n") == 1, done.stderr
        made[name] = masked(name, json.loads(done.stdout))

    dry = ("--dry-run", "--quiet", "--seed")
    verb("preflight", "preflight", "one.yaml")
    verb("preflight_refused", "preflight", "much.yaml")
    verb("run", "run", "one.yaml", *dry, 1, "--out", "one")
    verb("run_again", "run", "two.yaml", *dry, 2, "--out", "two")
    verb("identify", "identify", "one/run.mcap")
    verb("snippet", "snippet", "one/run.mcap", "--for", "mujoco", "--at", "150 N")
    verb("identify_curve", "identify", "curve.csv")
    verb("compare", "compare", "one", "two", "--curve", "curve.csv")
    verb("calibrate", "calibrate", "flat.yaml", *dry, 3, "--out", "flat")
    verb("calibrate_from", "calibrate", "--from", "flat", "--record", "flat.json")
    verb("identify_system", "identify", "flat/run.mcap", "--kind", "system")
    verb("doctor", "doctor", "two.yaml", "--dry-run", "--seconds", 1)
    verb(
        "campaign", "campaign", ROOT / "procedures" / "campaign.yaml", "--runs", 2,
        "--seed", 20, "--processes", 1,
    )  # fmt: skip
    verb("pose", "pose", "ur5e", "--radius", "300 mm to 360 mm", "--height", "0 mm")
    with pytest.MonkeyPatch.context() as few:
        few.setattr(cells, "PANELS", ("exponent",))
        few.setattr(cells, "EXPONENTS", (1.5,))
        few.setattr(cells, "COLUMNS", 2)
        few.setattr(cells, "shipped_payloads", lambda: [PAYLOADS / "plastic-cone.yaml"])
        verb("map", "map", "stvf", "--payload", SPHERE)
        few.setattr(plan_design, "STEPS", (4,))
        few.setattr(plan_design, "HOLDS_S", (5.0,))
        verb("design", "design", SPHERE, "stvf")
    verb("bad_input", "identify", "nothing.csv")
    return made


def differences(place: str, expected: Any, found: Any) -> list[str]:
    """Where two objects differ; numbers may by the tolerance."""
    if isinstance(expected, dict) and isinstance(found, dict):
        keys = sorted(set(expected) ^ set(found))
        inside = [
            line
            for key in expected.keys() & found.keys()
            for line in differences(f"{place}.{key}", expected[key], found[key])
        ]
        return [f"{place}.{key}: in one of them only" for key in keys] + inside
    if isinstance(expected, list) and isinstance(found, list) and len(expected) == len(found):
        return [
            line
            for i, pair in enumerate(zip(expected, found, strict=True))
            for line in differences(f"{place}[{i}]", *pair)
        ]
    if isinstance(expected, float) and isinstance(found, float):
        same = found == pytest.approx(expected, rel=RELATIVE, abs=ABSOLUTE)
    else:
        same = type(expected) is type(found) and expected == found
    return [] if same else [f"{place}: {expected!r} became {found!r}"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("json")


@pytest.fixture(scope="module")
def found(place: Path) -> dict[str, Any]:
    return objects(place)


def closed(schema: Any) -> Any:
    """The schema with every key that it does not name forbidden."""
    if isinstance(schema, list):
        return [closed(each) for each in schema]
    if not isinstance(schema, dict):
        return schema
    made = {key: closed(each) for key, each in schema.items()}
    return {"additionalProperties": False} | made if "properties" in made else made


@pytest.mark.parametrize("run", ["one", "two", "flat"])
def test_results_keep_to_their_schema(found: dict[str, Any], place: Path, run: str) -> None:
    schema = closed(json.loads(in_process("schema", "results").stdout))
    results = json.loads((place / run / "results.json").read_text())
    jsonschema.validate(results, schema)
    assert results["$schema"] == schema["$id"]


@pytest.mark.parametrize(
    ("name", "document"),
    [("compare", "comparison"), ("calibrate", "calibration"), ("preflight_refused", "preflight"),
     ("preflight", "preflight")],
)  # fmt: skip
def test_an_object_keeps_to_its_schema(found: dict[str, Any], name: str, document: str) -> None:
    schema = closed(json.loads(in_process("schema", document).stdout))
    of_the_verb = {key: value for key, value in found[name].items() if key != "record"}
    jsonschema.validate(of_the_verb, schema)


@pytest.mark.parametrize("name", sorted(path.stem for path in EXPECTED.glob("*.json")))
def test_the_object_of_a_verb_stays_what_it_was(name: str, found: dict[str, Any]) -> None:
    expected = json.loads((EXPECTED / f"{name}.json").read_text())
    assert differences(name, expected, found[name]) == []


def test_no_verb_is_forgotten(found: dict[str, Any]) -> None:
    assert {path.stem for path in EXPECTED.glob("*.json")} == found.keys()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as directory:
        for name, data in objects(Path(directory)).items():
            text = json.dumps(data, indent=1, ensure_ascii=False) + "\n"
            (EXPECTED / f"{name}.json").write_text(text)
