"""A rig's mount from the JSON of a world's file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stepload.rig.mount import Mount, SensorMount


def mount_from(data: Mapping[str, Any]) -> Mount:
    """What `dataclasses.asdict` and JSON made of a `Mount`.

    Raises:
        TypeError: an unknown field, or no mapping where one belongs.
    """
    told = {name: _frozen(value) for name, value in data.items()}
    for name in ("sensor", "second_sensor"):
        if name in told:
            told[name] = SensorMount(**{k: _frozen(v) for k, v in dict(told[name]).items()})
    return Mount(**told)


def _frozen(value: Any) -> Any:
    """Lists as tuples, at every depth."""
    return tuple(map(_frozen, value)) if isinstance(value, list) else value
