"""The directory that `--out` names: a picture in two forms, and the figures behind it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from stepload.errors import BadInputError


def check_sheet(out: Path, name: str) -> None:
    """Refuse, before anything is computed, to write over what is there.

    Raises:
        BadInputError: `out` is a file, holds such files already, or has no room.
    """
    from stepload.plan.room_to_write import check_room

    if out.exists() and not out.is_dir():
        raise BadInputError(f"--out {out}: that is a file", hint="name a directory")
    for path in _files(out, name):
        if path.exists():
            raise BadInputError(f"{path} is there already", hint="name another directory")
    check_room("--out", out)


def write_sheet(
    out: Path,
    name: str,
    svg: Callable[[], str],
    png: Callable[[], bytes],
    said: dict[str, object],
) -> str:
    """Write the picture and the figures as `name`; the line that says so."""
    from stepload.record.plain import json_text

    out.mkdir(parents=True, exist_ok=True)
    vector, raster, figures = files = _files(out, name)
    vector.write_text(svg(), encoding="utf-8")
    raster.write_bytes(png())
    figures.write_text(json_text(said) + "\n", encoding="utf-8")
    return f"written: {', '.join(map(str, files))}"


def _files(out: Path, name: str) -> tuple[Path, Path, Path]:
    return out / f"{name}.svg", out / f"{name}.png", out / f"{name}.json"
