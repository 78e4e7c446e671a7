"""Conditions of an identification, from a plan or from a record's conditions.json."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

from stepload.contact.law_names import LAW_NAMES
from stepload.envelope.conditions import ARM_MISALIGNMENT_RAD, conditions_of
from stepload.envelope.envelope import Envelope
from stepload.errors import BadInputError
from stepload.estimators.across import Across
from stepload.estimators.conditions import BRANCHES, UNKNOWN_OFFSET_M, Conditions
from stepload.estimators.deflection_rows import table_problem
from stepload.estimators.sources import ASSUMED_NONLINEARITY, Sources
from stepload.results.press_data import PressData

FILE = "conditions.json"
UNTOLD_STRUCTURE = (
    "the record is of an earlier version and does not say whether a serial arm pressed or a guided "
    "axis: it counts as an arm of which nothing is known; press again to have it told"
)


def planned(envelope: Envelope) -> Conditions:
    """The conditions of a plan, with the rig's figures; see `measured`."""
    return conditions_of(envelope.plan, envelope.theory)


def measured(conditions: Conditions, data: PressData) -> Conditions:
    """The same with noise and lag as measured in the run."""
    sources = conditions.sources
    lag_sigma_s = data.lag.sigma_s
    if data.lag_corrected_s == 0.0:
        lag_sigma_s = min(lag_sigma_s, sources.lag_sigma_s)
    return replace(
        conditions,
        sources=replace(
            sources,
            force_noise_n=max(data.noise_n, sources.force_noise_n),
            position_noise_m=math.hypot(
                sources.position_noise_m, conditions.across.noise_m(data.lateral_noise_n)
            ),
            lag_sigma_s=lag_sigma_s,
        ),
    )


def to_bytes(conditions: Conditions) -> bytes:
    """As a file of the record."""
    return json.dumps(asdict(conditions)).encode()


def from_attachments(attachments: Mapping[str, bytes]) -> Conditions:
    """Read a record's conditions; the content of the record is not trusted.

    Raises:
        BadInputError: they are missing or invalid.
    """
    raw = attachments.get(FILE)
    if raw is None:
        raise BadInputError(f"the record has no {FILE}", hint="it was not made by stepload run")
    try:
        data = _as_arm(json.loads(raw))
        data.pop("stuck_ratio", None)  # of records that have it
        laws = tuple(data.get("laws", ()))
        across = _across(data.get("across"))
        sources = _sources(data["sources"])
        beside = data.get("arm_sources")
        arm_sources = None if beside is None else _sources(beside)
        made = {"sources": sources, "laws": laws, "across": across, "arm_sources": arm_sources}
        found = Conditions(**{**data, **made})
        _check(found)
        if arm_sources is not None:
            _check(replace(found, sources=arm_sources, arm_sources=None))
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise BadInputError(f"{FILE} in the record is damaged: {error}") from None
    return found


_NO_NUMBERS = ("sources", "kind", "laws", "pose", "temperature_c", "system_stiffness_note",
               "across", "arm", "structure_note", "arm_sources", "branch")  # fmt: skip
_TABLE = ("deflection_force_n", "deflection_m", "deflection_sigma_m")
_NO_LONGER = ("zero_sigma_m", "force_rate_n_per_s")
"""Sources of earlier records that no figure depends on."""


def _as_arm(data: dict[str, Any]) -> dict[str, Any]:
    """Conservative defaults for a record that does not state what pressed, or how well an arm was
    aligned: a serial arm whose plan states nothing."""
    told = "arm" in data
    if not (data.get("arm", True) and ("misalignment_rad" not in data or not told)):
        return data
    stiffness = data["sources"]["system_stiffness_n_per_m"]
    careful = {
        "misalignment_rad": ARM_MISALIGNMENT_RAD,
        "yields_m_per_n": 1.0 / stiffness if stiffness else data.get("yields_m_per_n", 0.0),
        "gauge_offset_m": 0.0 if stiffness else UNKNOWN_OFFSET_M,
    }
    if not told:
        careful |= {"arm": True, "structure_note": UNTOLD_STRUCTURE}
    return data | careful


def _sources(data: dict[str, Any]) -> Sources:
    """The sources of a record. Older records without a table have a K_s without one, and older
    records without the force sensor's linearity get the assumed one.

    The smooth length of a record without a table is dropped: it was a constant of 50 N, not a
    measurement.
    """
    if not isinstance(data, dict):
        raise TypeError(f"sources are {data!r}")
    data = {name: value for name, value in data.items() if name not in _NO_LONGER}
    rows = {name: tuple(map(float, data.get(name, ()))) for name in _TABLE}
    sources = Sources(**{"nonlinearity": ASSUMED_NONLINEARITY, **data, **rows})
    if _TABLE[0] in data:
        return sources
    return replace(sources, smooth_length_n=None)


def _across(data: Any) -> Across:
    """Knowledge of lateral force in a record; none in earlier versions."""
    if data is None:
        return Across()
    told: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in data.items()}
    found = Across(**told)
    pairs = found.per_newton_m, found.sigma_m_per_n, found.at_share
    if any(pair is not None and len(pair) != 2 for pair in pairs):
        raise ValueError("two numbers are needed for the lateral force")
    numbers = [*(v for pair in pairs for v in pair or ()), found.correlation, found.reach]
    if not all(isinstance(v, int | float) and math.isfinite(v) for v in numbers):
        raise ValueError("a number of the lateral force is not finite")
    if not isinstance(found.stated, bool):
        raise ValueError(f"stated is {found.stated!r}")
    if min(*found.sigma_m_per_n, found.reach, 1.0 - abs(found.correlation)) < 0.0:
        raise ValueError("an uncertainty of the lateral force is impossible")
    return found


def _check(found: Conditions) -> None:
    if found.branch not in BRANCHES:
        raise ValueError(f"branch {found.branch!r}")
    if found.kind not in ("payload", "system"):
        raise ValueError(f"kind {found.kind!r}")
    if not isinstance(found.arm, bool):
        raise ValueError(f"arm is {found.arm!r}")
    if not isinstance(found.structure_note, str):
        raise ValueError(f"structure_note {found.structure_note!r}")
    if not isinstance(found.pose, str):
        raise ValueError(f"pose {found.pose!r}")
    if unknown := [word for word in found.laws if word not in LAW_NAMES]:
        raise ValueError(f"laws {unknown!r}")
    celsius = found.temperature_c
    if celsius is not None and not (isinstance(celsius, int | float) and math.isfinite(celsius)):
        raise ValueError(f"temperature_c is {celsius!r}")
    if not isinstance(found.sources.system_stiffness_note, str):
        raise ValueError(f"system_stiffness_note {found.sources.system_stiffness_note!r}")
    rows = [getattr(found.sources, name) for name in _TABLE]
    if any(rows) and (problem := table_problem(rows[0], rows[1], rows[2])):
        raise ValueError(problem)
    numbers = {**asdict(found.sources), **asdict(found)}
    optional = {"system_stiffness_n_per_m", "elastic_limit_n", "roughness_m",
                "rough_length_m", "smooth_length_n", "smooth_degrees", "theory_k", "theory_n",
                "modulus_pa", "plate_pa", "lever_m", "second_share"}  # fmt: skip
    positive = {"secant_force_n", "p", "s", "t", "system_stiffness_n_per_m", "elastic_limit_n",
                "position_resolution_m", "smooth_length_n", "theory_k", "theory_n", "modulus_pa",
                "plate_pa", "rough_length_sigma"}  # fmt: skip
    for name, value in numbers.items():
        if name in _NO_NUMBERS or name in _TABLE:
            continue
        if value is None and name in optional:
            continue
        if not isinstance(value, int | float) or not 0.0 <= value < math.inf:
            raise ValueError(f"{name} is {value!r}, must be finite and not negative")
        if name in positive and value == 0.0:
            raise ValueError(f"{name} is 0, must be positive")
