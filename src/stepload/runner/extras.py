"""Optional libraries, installed only as extras of the package."""

from __future__ import annotations

import importlib
from typing import Any

from stepload.errors import BadInputError


def extra(name: str, wanted_for: str, extra_name: str, or_else: str = "") -> Any:
    """Import a library of an extra of the package.

    Raises:
        BadInputError: it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise BadInputError(
            f"{wanted_for} needs {name}, which is not installed",
            hint=f'pip install "stepload[{extra_name}]"{or_else}',
        ) from error
