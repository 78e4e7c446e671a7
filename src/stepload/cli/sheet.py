"""The directory of `--out`: a picture in two formats, and its figures."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

from stepload.errors import BadInputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def check_sheet(out: Path, name: str) -> None:
    """Refuse to overwrite files, before anything is computed.

    Raises:
        BadInputError: `out` is a file, holds such files already, or has no room.
    """
    from stepload.plan.room_to_write import check_room

    if (out.exists() or out.is_symlink()) and not out.is_dir():
        raise BadInputError(f"--out {out}: that is a file", hint="name a directory")
    for path in _files(out, name):
        if path.exists() or path.is_symlink():
            raise _there_already(path)
    check_room("--out", out)


def write_sheet(
    out: Path,
    name: str,
    drawn: Callable[[], AbstractContextManager[Figure]],
    said: dict[str, object],
) -> str:
    """Write the picture and the figures as `name`; returns a line that says so.

    Args:
        drawn: draws the picture, once for each form.

    Raises:
        BadInputError: a file has appeared since the check; it is not changed.
    """
    from stepload.record.plain import json_text
    from stepload.results.figures import png_of, svg_of

    out.mkdir(parents=True, exist_ok=True)
    files = _files(out, name)
    with drawn() as figure:
        svg = svg_of(figure).encode()
    with drawn() as figure:
        png = png_of(figure)
    contents = svg, png, f"{json_text(said)}\n".encode()
    for path, content in zip(files, contents, strict=True):
        try:
            with path.open("xb") as file:
                file.write(content)
        except FileExistsError as error:
            raise _there_already(path) from error
    return f"written: {', '.join(map(str, files))}"


def _there_already(path: Path) -> BadInputError:
    return BadInputError(f"{path} is there already", hint="name another directory")


def _files(out: Path, name: str) -> tuple[Path, Path, Path]:
    return out / f"{name}.svg", out / f"{name}.png", out / f"{name}.json"
