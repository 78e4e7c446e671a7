"""Columns into a Parquet file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from stepload.data.libraries import library
from stepload.errors import BadInputError


def check_parquet(path: Path) -> None:
    """Check that a Parquet file can be written, before its content is computed.

    Raises:
        BadInputError: pyarrow is not installed, or the file is there already.
    """
    if path.exists():
        raise BadInputError(f"{path} is there already", hint="name another file")
    library("pyarrow", "Parquet")


def write_columns(columns: Mapping[str, Sequence[object]], path: Path) -> None:
    """Write columns of equal length to a new Parquet file.

    Raises:
        BadInputError: pyarrow is not installed, or the file is there already or cannot be written.
    """
    check_parquet(path)
    pa, parquet = library("pyarrow", "Parquet"), library("pyarrow.parquet", "Parquet")
    try:
        parquet.write_table(pa.table(dict(columns)), path, compression="zstd")
    except OSError as error:
        raise BadInputError(f"cannot write {path}: {error.strerror or error}") from error
