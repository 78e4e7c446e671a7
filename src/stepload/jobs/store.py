"""Rows on disk in one file, appended row by row, so that a campaign can be resumed."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Generic, Protocol, TextIO, TypeVar

from stepload.errors import BadInputError, RefusedError


class Row(Protocol):
    """The stored result of one run, identified by its series and number in that; one JSON line."""

    @property
    def series(self) -> str: ...

    @property
    def index(self) -> int: ...

    def to_line(self) -> str: ...


RowT = TypeVar("RowT", bound=Row)


class Store(Generic[RowT]):
    """The rows of one campaign in a directory; `rows` holds those that were already stored.

    A last line that was cut off by a crash is removed; its run is done again. A run that is stored
    twice counts once.

    Args:
        directory: made where missing.
        files: names of the header (JSON) and of the rows (JSON lines).
        header: settings that must be equal for rows to belong together.
        from_line: decodes a row from its line; raises ValueError where it is invalid.

    Raises:
        RefusedError: the directory holds another campaign, or another command is at work there.
        BadInputError: it holds invalid rows.
    """

    def __init__(
        self,
        directory: Path,
        files: tuple[str, str],
        header: dict[str, object],
        from_line: Callable[[str], RowT],
    ) -> None:
        directory.mkdir(parents=True, exist_ok=True)
        self._path = directory / files[1]
        self._from_line = from_line
        self._file: TextIO = self._path.open("a", encoding="utf-8")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._check_header(directory / files[0], json.loads(json.dumps(header)))
            self.rows = self._read()
        except BlockingIOError as error:
            self._file.close()
            raise RefusedError(
                f"{directory}: another command is at work there",
                hint="wait for its end, or use another directory",
            ) from error
        except BaseException:
            self._file.close()
            raise

    def _check_header(self, path: Path, header: dict[str, object]) -> None:
        if not path.exists():
            if self._path.stat().st_size:
                raise BadInputError(
                    f"{path}: missing beside {self._path.name}", hint="use a new directory"
                )
            path.write_text(json.dumps(header, indent=1) + "\n", encoding="utf-8")
            return
        try:
            found = dict(json.loads(path.read_text(encoding="utf-8")))
        except (ValueError, TypeError) as error:
            raise BadInputError(f"{path}: {error}", hint="use a new directory") from error
        if found != header:
            names = ", ".join(name for name in header if found.get(name) != header[name])
            raise RefusedError(
                f"{path.parent} holds a campaign that differs in: {names}",
                hint="use a new directory, or go on with what that campaign was begun with",
            )

    def _read(self) -> list[RowT]:
        data = self._path.read_bytes()
        whole = data.rfind(b"\n") + 1
        if whole < len(data):
            os.truncate(self._path, whole)
        rows: dict[tuple[str, int], RowT] = {}
        for number, line in enumerate(data[:whole].splitlines(), 1):
            try:
                row = self._from_line(line.decode("utf-8"))
                if rows.setdefault((row.series, row.index), row) != row:
                    raise ValueError(f"another {row.series} {row.index} than before")
            except ValueError as error:
                raise BadInputError(
                    f"{self._path}:{number}: {error}", hint="use a new directory"
                ) from error
        return list(rows.values())

    def add(self, rows: Iterable[RowT]) -> None:
        """Append finished runs."""
        self._file.write("".join(row.to_line() + "\n" for row in rows))
        self._file.flush()

    def __enter__(self) -> Store[RowT]:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
