"""Conditions of an identification, from a plan or from a record's conditions.json."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass, replace
from types import NoneType, UnionType
from typing import Any, TypeVar, cast, get_args, get_origin, get_type_hints

from stepload.contact.law_names import LAW_NAMES
from stepload.envelope.conditions import conditions_of
from stepload.envelope.envelope import Envelope
from stepload.errors import BadInputError
from stepload.estimators.conditions import BRANCHES, Conditions
from stepload.estimators.deflection_rows import table_problem
from stepload.results.press_data import PressData

FILE = "conditions.json"
T = TypeVar("T")


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
        BadInputError: they are missing, invalid, or of another version.
    """
    raw = attachments.get(FILE)
    if raw is None:
        raise BadInputError(f"the record has no {FILE}", hint="it was not made by stepload run")
    try:
        found = _read(Conditions, json.loads(raw))
        _check(found)
    except (ValueError, TypeError, RecursionError) as error:
        raise BadInputError(f"{FILE} in the record is damaged: {error}") from None
    return found


def _read(kind: type[T], data: Any) -> T:
    """A dataclass from its JSON object, which must have all its keys: no default is safe."""
    hints = get_type_hints(kind)
    if not isinstance(data, dict):
        raise ValueError(f"{kind.__name__} is {data!r}")
    if missing := hints.keys() - data.keys():
        raise ValueError(f"it lacks {', '.join(sorted(missing))}; another version has written it")
    return kind(**{name: _value(name, hints[name], data[name]) for name in hints})


def _value(name: str, hint: Any, value: Any) -> Any:
    """A value of JSON as the type of its field; every number finite."""
    kinds = get_args(hint) if isinstance(hint, UnionType) else (hint,)
    if value is None and NoneType in kinds:
        return None
    if is_dataclass(kinds[0]):
        return _read(cast(type, kinds[0]), value)
    if get_origin(kinds[0]) is tuple:
        if not isinstance(value, list):
            raise ValueError(f"{name} is {value!r}, not a list")
        item, *others = get_args(kinds[0])
        if others not in ([Ellipsis], [item] * (len(value) - 1)):
            raise ValueError(f"{name} has {len(value)} numbers")
        return tuple(_value(name, item, each) for each in value)
    if kinds[0] in (str, bool):
        valid = type(value) is kinds[0]
    else:
        valid = isinstance(value, int | float) and math.isfinite(value)
    if not valid:
        raise ValueError(f"{name} is {value!r}")
    return value


_POSITIVE = {
    "secant_force_n", "p", "s", "t", "system_stiffness_n_per_m", "elastic_limit_n",
    "position_resolution_m", "smooth_length_n", "theory_k", "theory_n", "modulus_pa",
    "plate_pa", "rough_length_sigma",
}  # fmt: skip


def _check(found: Conditions) -> None:
    """Refuse values that no run can have."""
    if found.branch not in BRANCHES:
        raise ValueError(f"branch {found.branch!r}")
    if found.kind not in ("payload", "system"):
        raise ValueError(f"kind {found.kind!r}")
    if unknown := [word for word in found.laws if word not in LAW_NAMES]:
        raise ValueError(f"laws {unknown!r}")
    across = found.across
    if min(*across.sigma_m_per_n, across.reach, 1.0 - abs(across.correlation)) < 0.0:
        raise ValueError("an uncertainty of the lateral force is impossible")
    for sources in filter(None, (found.sources, found.arm_sources)):
        rows = sources.deflection_force_n, sources.deflection_m, sources.deflection_sigma_m
        if any(rows) and (problem := table_problem(*rows)):
            raise ValueError(problem)
        for name, value in {**asdict(found), **asdict(sources)}.items():
            least = math.ulp(0.0) if name in _POSITIVE else 0.0
            if isinstance(value, int | float) and value < least and name != "temperature_c":
                raise ValueError(f"{name} is {value!r}, which is too small")
