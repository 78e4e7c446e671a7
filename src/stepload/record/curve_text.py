"""The lines of a table in a file: text of any encoding, or one sheet of a workbook."""

from __future__ import annotations

import codecs
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from stepload.errors import BadInputError
from stepload.record.curve_mapping import Refusal

MAX_BYTES = 1 << 26
MAX_LINE = 4096
MAX_UNZIPPED = 1 << 28
"""Largest size of a workbook's parts together."""
MAX_SHEET = {"max_row": 1 << 20, "max_col": 256}
_BOMS = {
    codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF32_LE: "utf-32", codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16",
}  # fmt: skip
_ENCODINGS = "utf-8", "cp1252", "cp1250", "cp932", "gb18030", "cp850"
"""What instruments write in the languages of curve_words.toml, the most common first."""


@dataclass(frozen=True, slots=True)
class Lines:
    """The lines of a file: `encoding` "xlsx" and the `sheet` of a workbook; the `delimiter` where
    it is stated."""

    texts: list[str]
    encoding: str
    sheet: str = ""
    delimiter: str | None = None


def read_bytes(path: Path) -> bytes:
    """The bytes of a file of bounded size; raises BadInputError."""
    if not path.is_file():
        raise BadInputError(f"{path}: no such file" if not path.exists() else f"{path}: not a file")
    try:
        if (size := path.stat().st_size) > MAX_BYTES:
            hint = "thin the data out or cut them to the loading"
            raise BadInputError(f"{path}: {size} bytes, limit {MAX_BYTES}", hint=hint)
        return path.read_bytes()
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror}") from error


def texts(data: bytes, stated: str) -> Iterator[Lines]:
    """A text in each encoding that it may have: the stated one, that of its mark, else several.

    Raises:
        Refusal: it has none, or a line is too long.
    """
    marked = [name for bom, name in _BOMS.items() if data.startswith(bom)][:1]
    if not (stated or marked) and (head := data[: 1 << 14]).count(0) > len(head) // 4:
        raise Refusal("UTF-16 without its mark, or no text", encoding="utf-16-le",
                      hint="or utf-16-be")  # fmt: skip
    several = [stated] if stated else marked or _ENCODINGS
    for encoding in several:
        try:
            text = data.decode(encoding)
        except (LookupError, ValueError):
            continue
        yield _lines(text, encoding.removesuffix("-sig"))
        if encoding == "utf-8" or several is not _ENCODINGS:
            return
    if several is not _ENCODINGS:
        raise Refusal(f"no text in the encoding {several[0]!r}", encoding="?",
                      hint="such as cp1252, shift_jis, utf-16-le")  # fmt: skip


def _lines(text: str, encoding: str) -> Lines:
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    if max(map(len, lines)) > MAX_LINE:
        at = next(at for at, line in enumerate(lines, 1) if len(line) > MAX_LINE)
        raise Refusal(f"a line of more than {MAX_LINE} characters", at, MAX_LINE)
    if stated := re.fullmatch(r'"?sep=(.)"?[;,\t]*', lines[0], re.IGNORECASE):
        lines[0] = ""
    return Lines(lines, encoding, delimiter=stated and stated[1])


def is_workbook(data: bytes) -> bool:
    """Whether a file is a workbook of Excel; raises Refusal for an old or encrypted one."""
    if data.startswith(b"\xd0\xcf\x11\xe0"):
        raise Refusal("an old or encrypted workbook", hint="save it as .xlsx or CSV, no password")
    return data.startswith(b"PK\x03\x04")


def workbook_lines(path: Path, stated: str) -> Lines:
    """The rows of a sheet, the stated one or the only one, as lines with tabs.

    Raises:
        Refusal: it is damaged, too large, or has several sheets and none is stated.
        BadInputError: openpyxl is not installed.
    """
    try:
        import openpyxl  # type: ignore[import-untyped, unused-ignore]
    except ImportError as error:
        raise BadInputError(
            f"{path}: a workbook needs openpyxl, which is not installed",
            hint='pip install "stepload[data]", or openpyxl alone',
        ) from error
    texts: list[str] = []
    size = width = 0
    try:
        _inspect(path)
        book: Any = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
        with book._archive:
            sheet = _sheet(book, stated)
            for row in sheet.iter_rows(values_only=True, **MAX_SHEET):
                texts.append("\t".join(map(_cell, row)))
                size += len(texts[-1]) + 1
                width = max(width, texts[-1].rstrip("\t").count("\t"))
                if size > 2 * MAX_BYTES or len(texts[-1]) > MAX_LINE:
                    raise Refusal(f"a sheet of more than {2 * MAX_BYTES} characters, or a row of "
                                  f"more than {MAX_LINE}", len(texts))  # fmt: skip
    except Refusal:
        raise
    except Exception as error:  # whatever a damaged workbook makes zipfile and openpyxl raise
        raise Refusal(f"no workbook that can be read: {type(error).__name__}: {error}") from None
    whole = [line[: len(line) - max(line.count("\t") - width, 0)] for line in texts]
    return Lines([x if x.strip() else "" for x in whole], "xlsx", sheet.title, "\t")


def _inspect(path: Path) -> None:
    """Raises Refusal where a workbook's parts are too large or declare entities."""
    with zipfile.ZipFile(path) as archive:
        if (size := sum(info.file_size for info in archive.infolist())) > MAX_UNZIPPED:
            raise Refusal(f"{size} bytes unzipped, limit {MAX_UNZIPPED}")
        for info in archive.infolist():
            if info.filename.endswith((".xml", ".rels")):
                data = archive.read(info)
                if b"<!" in data.replace(b"<!--", b"") or data[:2] in _BOMS:
                    raise Refusal(f"{info.filename[:60]} declares entities")


def _sheet(book: Any, stated: str) -> Any:
    """The sheet that is stated, else the only one that is shown and not empty; raises Refusal."""
    sheets = {sheet.title: sheet for sheet in book.worksheets}
    if stated in sheets:
        return sheets[stated]
    full = [name for name, each in sheets.items() if each.sheet_state == "visible"
            and next(each.iter_rows(max_row=1), None) is not None]  # fmt: skip
    if not stated and len(full) == 1:
        return sheets[full[0]]
    told = ", ".join(map(repr, sheets))[:200]
    what = f"no sheet is called {stated!r}" if stated else f"{len(full)} sheets"
    longest = max(full, key=lambda name: sheets[name].max_row or 0, default="?")
    raise Refusal(f"{what}: {told}", hint="or another of them", sheet=longest)


def _cell(value: object) -> str:
    """A cell as text."""
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value!r}" + "0" * ("e" not in repr(value))  # 1.2340 groups no thousands
    if isinstance(value, datetime):
        return value.isoformat(" ")
    return re.sub(r"[\t\r\n]+", " ", str(value))
