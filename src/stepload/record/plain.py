"""Anything stepload knows, as JSON types."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any


def plain(value: Any, non_finite: Callable[[float], str | None] = lambda _: None) -> Any:
    """`value` as JSON types: dataclasses become objects, NaN and infinities null.

    Args:
        non_finite: what stands for NaN and infinities instead.
    """
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, float):
        return value if math.isfinite(value) else non_finite(value)
    if value is None or isinstance(value, str | int | bool):
        return value
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name), non_finite) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item, non_finite) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist(), non_finite)
    if isinstance(value, Sequence | set | frozenset):
        return [plain(item, non_finite) for item in value]
    return str(value)


def _texts(value: Any) -> Any:
    return plain(value, lambda number: repr(float(number)))


def to_json(data: Mapping[str, object], indent: int | None = None) -> bytes:
    """Strict JSON for a record; NaN and infinities become the texts "nan", "inf" and "-inf"."""
    try:
        return json.dumps(data, allow_nan=False, default=_texts, indent=indent).encode()
    except ValueError:
        return json.dumps(_texts(data), allow_nan=False, indent=indent).encode()


def json_text(value: Any, indent: int | None = None) -> str:
    """`value` as one JSON text; NaN and infinities become null."""
    return json.dumps(plain(value), indent=indent, allow_nan=False)
