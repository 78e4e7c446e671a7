"""Optional libraries, installed only as the extra `data` of the package."""

from __future__ import annotations

import importlib
from typing import Any

from stepload.errors import BadInputError


def library(name: str, wanted_for: str) -> Any:
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
