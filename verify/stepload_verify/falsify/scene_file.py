"""A run on disk, with which it can be repeated exactly: its plan, its truth, its faults.

The limits are not in the file: they are derived from the plan by the program that replays it, so
that a counterexample is a test of every later program too.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from stepload.contact.materials import Geometry
from stepload.errors import BadInputError, RefusedError
from stepload.feasibility.preflight import derive
from stepload.plan.model import Plan
from stepload.plan.source import read_source
from stepload.rig.world import WorldSpec
from stepload_verify.campaign.mishaps import Incident
from stepload_verify.campaign.scenario import Scenario, hazard_of
from stepload_verify.campaign.truth import Anomaly

VERSION = 1
LARGEST_BYTES = 1_000_000


@dataclass(frozen=True, slots=True)
class SceneFile:
    """One run, and its result when it was written (`found`: figures by name)."""

    version: int
    series: str
    index: int
    found: Mapping[str, float]
    incidents: tuple[Incident, ...]
    anomalies: tuple[Anomaly, ...]
    truth: WorldSpec
    plan: Plan
    wrong: tuple[str, ...] = ()


@cache
def _converter() -> Any:
    from cattrs.preconf.json import make_converter
    from cattrs.strategies import configure_tagged_union

    converter = make_converter(forbid_extra_keys=True)
    converter.register_unstructure_hook(Path, str)
    converter.register_structure_hook(Path, lambda value, _: Path(str(value)))
    converter.register_structure_hook_func(lambda kind: kind is object, lambda value, _: value)
    configure_tagged_union(Geometry, converter, tag_name="geometry")
    return converter


def text_of(scenario: Scenario, found: Mapping[str, float]) -> str:
    """The file of a run, as JSON."""
    plan = replace(scenario.plan, sources=(), path=Path("scene"), payload_file=None)
    file = SceneFile(
        VERSION, scenario.series, scenario.index, found, scenario.incidents,
        scenario.anomalies, scenario.truth, plan, scenario.wrong,
    )  # fmt: skip
    return json.dumps(_converter().unstructure(file), indent=1) + "\n"


def read_scene(path: Path) -> tuple[Scenario, Mapping[str, float]]:
    """The run of a file with the limits of this program, and its result when it was written.

    Raises:
        BadInputError: not such a file.
        RefusedError: this program sees no room to press in it.
    """
    from cattrs.errors import BaseValidationError

    try:
        data = json.loads(_text(path), parse_constant=_constant)
    except (OSError, ValueError, RecursionError) as error:
        raise BadInputError(f"{path}: {error}", hint="give a file of stepload falsify") from error
    if not isinstance(data, dict) or data.get("version") != VERSION:
        raise BadInputError(f"{path}: no scene of version {VERSION}")
    try:
        file: SceneFile = _converter().structure(data, SceneFile)
        if file.truth.seed < 0:
            raise ValueError(f"truth.seed = {file.truth.seed} is below zero")
        preflight = derive(file.plan)
    except (BaseValidationError, TypeError, ValueError, ArithmeticError) as error:
        raise BadInputError(f"{path}: {_first(error)}", hint="it was changed by hand?") from error
    if preflight.limits is None:
        raise RefusedError(f"{path}: preflight sees no room to press in this plan any more")
    scenario = Scenario(
        series=file.series,
        index=file.index,
        preflight=preflight,
        truth=file.truth,
        wrong=file.wrong,
        anomalies=file.anomalies,
        incidents=file.incidents,
        hazard=hazard_of(file.wrong, file.truth.faults, file.plan, file.anomalies),
    )
    return scenario, file.found


def _text(path: Path) -> str:
    source = read_source(path)
    if len(source.data) > LARGEST_BYTES:
        raise BadInputError(f"{path}: more than {LARGEST_BYTES} bytes, no scene is that long")
    return source.text


def _constant(name: str) -> float:
    """An infinity, which a scene may hold; what is no number compares with no limit."""
    if name == "NaN":
        raise ValueError("NaN is no number of a scene")
    return float(name)


def _first(error: BaseException) -> str:
    from cattrs import transform_error
    from cattrs.errors import BaseValidationError

    return transform_error(error)[0] if isinstance(error, BaseValidationError) else str(error)
