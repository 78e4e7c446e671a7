"""Workers that are lost: their batches are done again, but not for ever."""

from __future__ import annotations

from stepload.errors import RefusedError

MOST_IN_A_ROW = 5
"""After so many losses without one finished batch between them it is the batch and not the host."""


class Losses:
    """Counts losses in a row."""

    def __init__(self) -> None:
        self._in_a_row = 0

    def none(self) -> None:
        """A batch has come back."""
        self._in_a_row = 0

    def one(self, what: str) -> None:
        """Something that worked on a batch is gone.

        Raises:
            RefusedError: it was one too many in a row.
        """
        self._in_a_row += 1
        if self._in_a_row > MOST_IN_A_ROW:
            raise RefusedError(
                f"{what} {self._in_a_row} times in a row, and no batch was finished",
                hint="look for a worker that was killed for its memory; what is done is kept",
            )
