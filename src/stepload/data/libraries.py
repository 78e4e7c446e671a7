"""Optional libraries, needed only for their own kind of table."""

from __future__ import annotations

import importlib
from types import ModuleType

from stepload.errors import BadInputError


def library(name: str, wanted_for: str) -> ModuleType:
    """Import an optional library.

    Raises:
        BadInputError: it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise BadInputError(
            f"{wanted_for} needs {name}, which is not installed",
            hint=f'pip install "stepload[data]", or {name} alone',
        ) from error
