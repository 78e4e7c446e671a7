"""The lines of a table in a file: text of any encoding, or one sheet of a workbook."""

from __future__ import annotations

import codecs
import re
import zipfile
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
_ENCODINGS = (
    "cp1252", "cp1250", "cp1251", "cp1254", "cp932", "gb18030", "euc_jp", "euc_kr", "big5", "cp850",
    "cp437", "mac_roman",
)  # fmt: skip
"""What instruments write, the most common first."""
_SAMPLE = 1 << 14
_CHAOS = 0.15
"""Of what charset-normalizer counts as plausible at most."""
_NOTES = {
    "hidden rows or columns are read like the others": re.compile(
        rb'<(?:row|col) [^>]*hidden="(?:1|true)"'),
    "formulas without a stored value: save the file in Excel": re.compile(
        rb"<f(?: [^>]*)?(?:/>|>[^<]*</f>)(?:<v */>|<v></v>)?</c>"),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Lines:
    """The lines of a file: `encoding` "xlsx" and the `sheet` of a workbook; the `delimiter` where
    it is stated, `begin` the index of the first line of the table, `notes` on what is unusual."""

    texts: list[str]
    encoding: str
    sheet: str = ""
    delimiter: str | None = None
    begin: int = 0
    notes: tuple[str, ...] = ()


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


def encodings(data: bytes, stated: str) -> list[str]:
    """The encodings that a text may have: one where BOM, UTF-8 or the user says it.

    Raises:
        Refusal: it has none that is certain.
    """
    hint = "such as cp1252, shift_jis, utf-16-le"
    if stated:
        if not _decodes(data, stated):
            raise Refusal(f"no text in the encoding {stated!r}", encoding="?", hint=hint)
        return [stated]
    for bom, name in _BOMS.items():
        if data.startswith(bom):
            return [name]
    head = data[:_SAMPLE]
    if head.count(0) > len(head) // 4:
        little = head[1::2].count(0) > head[::2].count(0)
        raise Refusal("UTF-16 without its mark, or no text",
                      encoding="utf-16-le" if little else "utf-16-be")  # fmt: skip
    try:
        data.decode()
        return ["utf-8"]
    except UnicodeDecodeError as error:
        at = error.start
    from charset_normalizer import from_bytes

    told = b"\n".join(line for line in data.splitlines() if not line.isascii())[:_SAMPLE]
    told = told.rpartition(b"\n")[0] if len(told) == _SAMPLE else told
    matches = from_bytes(told, cp_isolation=list(_ENCODINGS), threshold=_CHAOS)
    found = {name for match in matches for name in match.could_be_from_charset}
    plausible = [name for name in _ENCODINGS if name in found and _decodes(data, name)]
    if not plausible:
        raise Refusal(f"byte 0x{data[at]:02x} is not UTF-8, and no other encoding is certain",
                      data.count(b"\n", 0, at) + 1, encoding="?", hint=hint)  # fmt: skip
    return plausible


def _decodes(data: bytes, name: str) -> bool:
    try:
        data.decode(name)
    except (LookupError, UnicodeError):
        return False
    return True


def text_lines(data: bytes, encoding: str) -> Lines:
    """The lines of a text; raises Refusal where one is too long."""
    try:
        text = data.decode(encoding)
    except UnicodeError as error:
        raise Refusal(f"not {encoding}: {error}") from None
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    if max(map(len, lines)) > MAX_LINE:
        at = next(at for at, line in enumerate(lines, 1) if len(line) > MAX_LINE)
        raise Refusal(f"a line of more than {MAX_LINE} characters", at, MAX_LINE)
    encoding = encoding.removesuffix("-sig")
    if stated := re.fullmatch(r'"?sep=(.)"?[;,\t]*', lines[0], re.IGNORECASE):
        return Lines(lines, encoding, delimiter=stated[1], begin=1)
    return Lines(lines, encoding)


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
    try:
        notes = _inspect(path)
        book: Any = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
        with book._archive:
            sheet = _sheet(book, stated)
            size = 0
            for row in sheet.iter_rows(values_only=True, **MAX_SHEET):
                texts.append("\t".join(map(_cell, row)))
                size += len(texts[-1]) + 1
                if size > 2 * MAX_BYTES or len(texts[-1]) > MAX_LINE:
                    raise Refusal(f"a sheet of more than {2 * MAX_BYTES} characters, or a row of "
                                  f"more than {MAX_LINE}", len(texts))  # fmt: skip
    except Refusal:
        raise
    except Exception as error:  # whatever a damaged workbook makes zipfile and openpyxl raise
        raise Refusal(f"no workbook that can be read: {type(error).__name__}: {error}") from None
    width = max((line.rstrip("\t").count("\t") for line in texts), default=0)
    whole = [line[: len(line) - max(line.count("\t") - width, 0)] for line in texts]
    return Lines([x if x.strip() else "" for x in whole], "xlsx", sheet.title, "\t", notes=notes)


def _inspect(path: Path) -> tuple[str, ...]:
    """Notes on a workbook's parts; raises Refusal where they are too large or refer outside."""
    notes: dict[str, None] = {}
    with zipfile.ZipFile(path) as archive:
        size = sum(info.file_size for info in archive.infolist())
        if size > MAX_UNZIPPED:
            raise Refusal(f"{size} bytes unzipped, limit {MAX_UNZIPPED}")
        for info in archive.infolist():
            if info.filename.endswith((".xml", ".rels")):
                data = archive.read(info)
                if b"<!" in data.replace(b"<!--", b"") or data[:2] in _BOMS:
                    raise Refusal(f"{info.filename[:60]} declares entities")
                if info.filename.startswith("xl/worksheets/"):
                    notes |= {note: None for note, each in _NOTES.items() if each.search(data)}
    return tuple(notes)


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
