"""Columns of one length, as numpy arrays, and as the tables of pandas and Arrow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stepload.data.columns import library
from stepload.errors import BadInputError
from stepload.record.rows import Phase

if TYPE_CHECKING:
    import pandas
    import pyarrow

Column = NDArray[Any]
PHASE = "phase"
_PHASES = [phase.name.lower() for phase in sorted(Phase)]


class Table(Mapping[str, Column]):
    """Named columns of shape (N,), in the order of time.

    `table["force_n"]` is an array; the unit is in the name. The arrays are those of the run, not
    copies: change none of them in place. The column `phase` holds numbers of
    `stepload.record.rows.Phase`; tables of pandas and Arrow hold their names.

    Args:
        columns: by name, all of one length.
        time: name of the column that is the time on the run's clock, in s.
    """

    def __init__(self, columns: Mapping[str, Column], time: str = "time_s") -> None:
        lengths = {len(column) for column in columns.values()}
        if len(lengths) > 1 or time not in columns:
            raise ValueError(f"columns of lengths {sorted(lengths)}, time {time!r}")
        self._columns = dict(columns)
        self.time = time

    def __getitem__(self, name: str) -> Column:
        try:
            return self._columns[name]
        except KeyError:
            raise BadInputError(
                f"no column {name!r}", hint=f"there are {', '.join(self._columns)}"
            ) from None

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        """How many columns; see `rows`."""
        return len(self._columns)

    def __repr__(self) -> str:
        return f"Table of {self.rows} rows: {', '.join(self._columns)}"

    @property
    def rows(self) -> int:
        """N."""
        return len(self._columns[self.time])

    @property
    def time_s(self) -> Column:
        """The column that is the time on the run's clock, shape (N,), in s."""
        return self._columns[self.time]

    def where(self, mask: Column) -> Table:
        """The rows that a mask of shape (N,) or a slice chooses."""
        return Table({name: column[mask] for name, column in self._columns.items()}, self.time)

    def between(self, start_s: float, end_s: float) -> Table:
        """The rows with start_s <= time < end_s on the run's clock."""
        return self.where((self.time_s >= start_s) & (self.time_s < end_s))

    def to_arrow(self) -> pyarrow.Table:
        """The same as an Arrow table.

        Raises:
            BadInputError: pyarrow is not installed.
        """
        pa = library("pyarrow", "an Arrow table")
        arrays = {name: pa.array(column) for name, column in self._columns.items()}
        if PHASE in arrays:
            codes = pa.array(self._columns[PHASE].astype(np.int8))
            arrays[PHASE] = pa.DictionaryArray.from_arrays(codes, pa.array(_PHASES))
        return pa.table(arrays)

    def to_pandas(self) -> pandas.DataFrame:
        """The same as a pandas DataFrame; phases are a categorical.

        Raises:
            BadInputError: pandas is not installed.
        """
        pd = library("pandas", "a DataFrame")
        columns: dict[str, Any] = dict(self._columns)
        if PHASE in columns:
            columns[PHASE] = pd.Categorical.from_codes(columns[PHASE], _PHASES)
        frame: pandas.DataFrame = pd.DataFrame(columns)
        return frame
