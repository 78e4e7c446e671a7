"""Columns into a Parquet file, and the optional libraries: the extra `data` of the package."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from stepload.errors import BadInputError


def library(name: str, wanted_for: str) -> Any:
    """Import an optional library.

    Raises:
        BadInputError: it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise BadInputError(
            f"{wanted_for} needs {name}, which is not installed",
            hint=f'pip install "stepload[data]", or {name} alone',
        ) from error


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
        BadInputError: as `check_parquet`, or the file cannot be written.
    """
    check_parquet(path)
    pa, parquet = library("pyarrow", "Parquet"), library("pyarrow.parquet", "Parquet")
    try:
        parquet.write_table(pa.table(dict(columns)), path, compression="zstd")
    except OSError as error:
        raise BadInputError(f"cannot write {path}: {error.strerror or error}") from error
