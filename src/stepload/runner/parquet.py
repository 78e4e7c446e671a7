"""Rows as a Parquet file, for programs that read many of them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, get_args, get_origin, get_type_hints

from stepload.runner.extras import extra

GROUP = 100_000
"""Rows that are converted and written at a time, which limits the memory."""


def needs_parquet() -> Any:
    """The library for it.

    Raises:
        BadInputError: it is not installed.
    """
    extra("pyarrow", "a Parquet file", "data")
    return extra("pyarrow.parquet", "a Parquet file", "data")


def write_parquet(path: Path, kind: type[Any], rows: Sequence[Any]) -> None:
    """Write rows in their order; the same rows give the same file, and it is whole or not there.

    Args:
        path: overwritten if it exists.
        kind: the dataclass of the rows: text, integers, floats, booleans, tuples of one of these,
            each or None. The file has a column for each field, also where there is no row.
        rows: all of this kind.

    Raises:
        BadInputError: the library is not installed.
    """
    parquet, arrow = needs_parquet(), extra("pyarrow", "a Parquet file", "data")
    hints = get_type_hints(kind)
    names = [field.name for field in fields(kind)]
    schema = arrow.schema([(name, _column(arrow, hints[name])) for name in names])
    part = path.with_name(path.name + ".part")
    try:
        with parquet.ParquetWriter(part, schema) as writer:
            for start in range(0, len(rows), GROUP):
                group = rows[start : start + GROUP]
                columns = [[getattr(row, name) for row in group] for name in names]
                writer.write_table(arrow.table(columns, schema=schema))
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def _column(arrow: Any, hint: Any) -> Any:
    """The Arrow type of a field."""
    if isinstance(hint, UnionType):
        [hint] = set(get_args(hint)) - {NoneType}
    if get_origin(hint) is tuple:
        return arrow.list_(_column(arrow, get_args(hint)[0]))
    plain = {str: arrow.string, int: arrow.int64, float: arrow.float64, bool: arrow.bool_}
    return plain[hint]()
