"""Lost workers: their batches are repeated, up to a limit."""

from __future__ import annotations

from stepload.errors import RefusedError

MOST_IN_A_ROW = 5
"""Largest number of losses in a row, without a finished batch; beyond it the batch is to blame."""


class Losses:
    """Counts losses in a row."""

    def __init__(self) -> None:
        self._in_a_row = 0

    def none(self) -> None:
        """A batch was finished."""
        self._in_a_row = 0

    def one(self, what: str) -> None:
        """A worker was lost.

        Raises:
            RefusedError: it was one too many in a row.
        """
        self._in_a_row += 1
        if self._in_a_row > MOST_IN_A_ROW:
            raise RefusedError(
                f"{what} {self._in_a_row} times in a row, and no batch was finished",
                hint="look for a worker that was killed for its memory; what is done is kept",
            )
