"""Conditions of an identification, from a plan or from a record's conditions.json."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, replace

from stepload.contact.law_names import LAW_NAMES
from stepload.envelope.conditions import conditions_of
from stepload.envelope.envelope import Envelope
from stepload.errors import BadInputError
from stepload.estimators.conditions import BRANCHES, Conditions
from stepload.estimators.deflection_rows import table_problem
from stepload.results.press_data import PressData

FILE = "conditions.json"


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
    from pydantic import TypeAdapter, ValidationError

    raw = attachments.get(FILE)
    if raw is None:
        raise BadInputError(f"the record has no {FILE}", hint="it was not made by stepload run")
    try:
        found = TypeAdapter(Conditions).validate_json(raw, strict=True)
        _check(found)
        # No default is safe: a key that another version did not write shows here.
        if json.loads(json.dumps(asdict(found), allow_nan=False)) != json.loads(raw):
            raise ValueError("another version has written it")
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = ".".join(map(str, first["loc"]))
        raise BadInputError(f"{FILE} in the record is damaged: {name}: {first['msg']}") from None
    except (ValueError, RecursionError) as error:
        raise BadInputError(f"{FILE} in the record is damaged: {error}") from None
    return found


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
            if isinstance(value, float) and name != "temperature_c" and not value >= least:
                raise ValueError(f"{name} is {value!r}, which is too small")
