"""Live view of a run over the network, and a layout for the viewer: `--live`, layout."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from stepload.errors import BadInputError
from stepload.results.terminal import Output

DEFAULT_ADDRESS = "127.0.0.1:8765"


@contextmanager
def shown_live(address: str, output: Output) -> Iterator[Callable[[Path], None] | None]:
    """A view of the run at an address for the time of the block; "" for none.

    Raises:
        BadInputError: the address is invalid, or the server cannot be started there.
    """
    if not address:
        yield None
        return
    from stepload.live.view import address_of, live_view

    with live_view(address_of(address)) as view:
        output.line(
            f"live: {view.address.url} (Foxglove or Lichtblick: open a Foxglove WebSocket"
            " connection; `stepload layout FILE` writes a layout for it)"
        )
        if not view.address.loopback:
            output.line("live: everybody on this network can watch; nobody can command")
        yield view.follow


def layout(
    file: Annotated[Path, typer.Argument(help="The file to write.")] = Path("stepload-layout.json"),
) -> None:
    """Write a layout for Foxglove and Lichtblick: force and limits, curve, phase, margins.

    Example: stepload layout stepload-layout.json
    """
    from importlib import resources

    text = (resources.files("stepload.live") / "layout.json").read_text()
    try:
        with file.open("x", encoding="utf-8") as out:
            out.write(text)
    except FileExistsError:
        raise BadInputError(f"{file} exists already", hint="name another file") from None
    except OSError as error:
        raise BadInputError(f"cannot write {file}: {error.strerror}") from error
    print(f"{file}: import it as a layout in Foxglove or Lichtblick")
