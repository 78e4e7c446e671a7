"""The lines of a table in a file: text of any encoding, or one sheet of a workbook."""

from __future__ import annotations

import codecs
import re
import zipfile
from dataclasses import dataclass, field
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

from stepload.errors import BadInputError
from stepload.record.curve_mapping import CurveMapping, Refusal

MAX_BYTES = 1 << 26
MAX_LINE = 4096
MAX_UNZIPPED = 1 << 28
"""Largest size of a workbook's parts together."""
MAX_SHEET_ROWS, MAX_SHEET_COLUMNS = 1 << 20, 256
_BOMS = (
    (codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"),
)  # fmt: skip
_ENCODINGS = ("cp1252", "cp1250", "cp1251", "cp1254", "cp932", "gb18030", "euc_jp", "euc_kr", "big5",
              "cp850", "cp437", "mac_roman")  # fmt: skip
"""What instruments write, the most common first."""
_SAMPLE = 1 << 14
_CHAOS = 0.15
"""Of what charset-normalizer counts as plausible at most."""
_HIDDEN = re.compile(rb'<(?:row|col) [^>]*hidden="(?:1|true)"')
_FORMULA = re.compile(rb"<f(?: [^>]*)?(?:/>|>[^<]*</f>)(?:<v/>|<v></v>)?</c>")


@dataclass(frozen=True, slots=True)
class Lines:
    """The lines of a file.

    Attributes:
        texts: without line ends.
        encoding: of the text, "xlsx" of a workbook.
        sheet: its name; "" for text.
        delimiter: where the file or its kind states one.
        begin: index of the first line of the table.
        notes: what is unusual about the workbook.
    """

    texts: list[str]
    encoding: str
    sheet: str = ""
    delimiter: str | None = None
    begin: int = 0
    notes: tuple[str, ...] = field(default=())


def read_bytes(path: Path) -> bytes:
    """The bytes of a file of bounded size; raises BadInputError."""
    if not path.is_file():
        raise BadInputError(f"{path}: no such file" if not path.exists() else f"{path}: not a file")
    try:
        if (size := path.stat().st_size) > MAX_BYTES:
            raise BadInputError(
                f"{path}: {size} bytes, limit {MAX_BYTES}",
                hint="thin the data out or cut them to the loading",
            )
        return path.read_bytes()
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror}") from error


def encodings(data: bytes, stated: str) -> list[str]:
    """The encodings that a text may have: one where BOM, UTF-8 or the user says it.

    Raises:
        Refusal: it has none that is known.
    """
    if stated:
        try:
            data.decode(stated)
        except (LookupError, UnicodeError) as error:
            hint = "such as utf-8, utf-16-le, cp1252, shift_jis"
            raise Refusal(f"--encoding {stated}: {error}", encoding="?", hint=hint) from None
        return [stated]
    for bom, name in _BOMS:
        if data.startswith(bom):
            return ["utf-8-sig" if name == "utf-8" else name]
    head = data[:_SAMPLE]
    if head.count(0) > len(head) // 4:
        odd = head[1::2].count(0) > head[::2].count(0)
        raise Refusal("no text, or UTF-16 without its mark", encoding=f"utf-16-{'lb'[not odd]}e")
    try:
        data.decode()
        return ["utf-8"]
    except UnicodeDecodeError as error:
        place = error
    from charset_normalizer import from_bytes

    told = b"\n".join(line for line in data.splitlines() if not line.isascii())[:_SAMPLE]
    told = told[: told.rfind(b"\n")] if len(told) == _SAMPLE else told
    matches = from_bytes(told, cp_isolation=list(_ENCODINGS), threshold=_CHAOS)
    found = {name for match in matches for name in match.could_be_from_charset}
    plausible = [name for name in _ENCODINGS if name in found and _decodes(data, name)]
    if not plausible:
        line = data[: place.start].count(b"\n") + 1
        raise Refusal(
            f"byte 0x{data[place.start]:02x} is not UTF-8, and no other encoding is certain", line,
            encoding="?", hint="such as cp1252, shift_jis, utf-16-le",
        )  # fmt: skip
    return plausible


def _decodes(data: bytes, name: str) -> bool:
    try:
        data.decode(name)
    except UnicodeDecodeError:
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
    stated = re.fullmatch(r'"?sep=(.)"?;*,*', lines[0].strip("\ufeff "), re.IGNORECASE)
    if stated:
        return Lines(lines, encoding, delimiter=stated[1], begin=1)
    return Lines(lines, encoding.removesuffix("-sig"))


def is_workbook(data: bytes) -> bool:
    """Whether a file is a workbook of Excel; raises Refusal for an old one."""
    if data.startswith(b"\xd0\xcf\x11\xe0"):
        raise Refusal("an old or encrypted workbook", hint="save it as .xlsx or CSV, no password")
    return data.startswith(b"PK\x03\x04")


def workbook_lines(path: Path, mapping: CurveMapping) -> Lines:
    """The rows of one sheet as lines with tabs.

    Raises:
        Refusal: it is damaged, too large, or has several sheets and none is stated.
        BadInputError: openpyxl is not installed.
    """
    notes = _inspect(path)
    try:
        import openpyxl
    except ImportError as error:
        raise BadInputError(
            f"{path}: a workbook needs openpyxl, which is not installed",
            hint='pip install "stepload[data]", or openpyxl alone',
        ) from error
    book: Any = None
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
        sheet = _sheet(book, mapping.sheet)
        texts: list[str] = []
        size = 0
        for row in sheet.iter_rows(
            max_row=MAX_SHEET_ROWS, max_col=MAX_SHEET_COLUMNS, values_only=True
        ):
            line = "\t".join(map(_cell, row)).rstrip("\t")
            size += len(line) + 64
            if size > 4 * MAX_BYTES or len(line) > MAX_LINE:
                raise Refusal(
                    f"a sheet or a row of more than {MAX_LINE} characters", len(texts) + 1
                )
            texts.append(line)
    except Refusal:
        raise
    except Exception as error:  # whatever a damaged workbook makes openpyxl raise
        raise Refusal(f"no workbook that can be read: {type(error).__name__}: {error}") from None
    finally:
        if book is not None:
            book.close()
    width = max((line.count("\t") for line in texts), default=0)
    full = [line + "\t" * (width - line.count("\t")) if line else "" for line in texts]
    return Lines(full, "xlsx", sheet.title, "\t", notes=notes)


def _inspect(path: Path) -> tuple[str, ...]:
    """Notes on the parts of a workbook; raises Refusal where they are too large or refer outside."""
    notes: dict[str, None] = {}
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(info.file_size for info in archive.infolist())
            if size > MAX_UNZIPPED:
                raise Refusal(f"{size} bytes unzipped, limit {MAX_UNZIPPED}")
            for info in archive.infolist():
                if not info.filename.endswith((".xml", ".rels")):
                    continue
                data = archive.read(info)
                if b"<!" in data.replace(b"<!--", b"") or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
                    raise Refusal(f"{info.filename[:60]} declares entities, which are refused")
                if info.filename.startswith("xl/worksheets/"):
                    if _HIDDEN.search(data):
                        notes["hidden rows or columns are read like the others"] = None
                    if _FORMULA.search(data):
                        notes["formulas without a stored value: save the file in Excel"] = None
    except (zipfile.BadZipFile, OSError, EOFError, NotImplementedError, RuntimeError) as error:
        raise Refusal(f"no workbook that can be read: {error}") from None
    return tuple(notes)


def _sheet(book: Any, stated: str) -> Any:
    """The sheet that is stated, else the only one that is shown and not empty."""
    sheets = {sheet.title: sheet for sheet in book.worksheets}
    if stated in sheets:
        return sheets[stated]
    shown = [name for name, each in sheets.items() if each.sheet_state == "visible"]
    full = [name for name in shown if next(sheets[name].iter_rows(max_row=1), None) is not None]
    if not stated and len(full) == 1:
        return sheets[full[0]]
    told = ", ".join(repr(name) for name in sheets)[:200]
    what = f"no sheet is called {stated!r}" if stated else f"{len(full)} sheets"
    raise Refusal(f"{what}: {told}", hint="or another of them", sheet=(full or shown or ["?"])[0])


def _cell(value: object) -> str:
    """A cell as text."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, (float, int)):
        return repr(value) + "0" * (
            "." in repr(value) and "e" not in repr(value)
        )  # 1.234 is no group of thousands
    if isinstance(value, datetime):
        return value.isoformat(" ")
    if isinstance(value, time):
        return value.isoformat("microseconds")
    if isinstance(value, date):
        return value.isoformat()
    return re.sub(r"[\t\r\n]+", " ", str(value))
