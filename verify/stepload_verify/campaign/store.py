"""Results on disk: one file per campaign, appended to run by run, so that it can go on later."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import TextIO

from stepload.errors import BadInputError, RefusedError
from stepload_verify.campaign.result import Result

HEADER, LINES = "campaign.json", "runs.jsonl"


class Store:
    """The results of one campaign in a directory; `results` holds those that were there already.

    A last line that was cut off by a crash is taken away; its run is done again.

    Args:
        directory: made where missing.
        header: what must be the same for results to belong together.

    Raises:
        RefusedError: the directory holds another campaign.
        BadInputError: it holds something that is none.
    """

    def __init__(self, directory: Path, header: dict[str, object]) -> None:
        directory.mkdir(parents=True, exist_ok=True)
        self._path = directory / LINES
        self._check_header(directory / HEADER, header)
        self.results = self._read()
        self._file: TextIO = self._path.open("a", encoding="utf-8")

    def _check_header(self, path: Path, header: dict[str, object]) -> None:
        text = json.dumps(header, indent=1)
        if not path.exists():
            if self._path.exists():
                raise BadInputError(f"{path}: missing beside {LINES}", hint="use a new directory")
            path.write_text(text + "\n", encoding="utf-8")
            return
        try:
            found = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise BadInputError(f"{path}: {error}", hint="use a new directory") from error
        if found != json.loads(text):
            names = ", ".join(name for name in header if found.get(name) != header[name])
            raise RefusedError(
                f"{path.parent} holds a campaign that differs in: {names}",
                hint="use a new directory, or go on with what that campaign was begun with",
            )

    def _read(self) -> list[Result]:
        if not self._path.exists():
            return []
        data = self._path.read_bytes()
        whole = data.rfind(b"\n") + 1
        if whole < len(data):
            os.truncate(self._path, whole)
        lines = data[:whole].decode("utf-8").splitlines()
        results = []
        for number, line in enumerate(lines, 1):
            try:
                results.append(Result.from_line(line))
            except ValueError as error:
                raise BadInputError(f"{self._path}:{number}: {error}") from error
        return results

    def add(self, results: Iterable[Result]) -> None:
        """Append finished runs."""
        self._file.write("".join(result.to_line() + "\n" for result in results))
        self._file.flush()

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()
