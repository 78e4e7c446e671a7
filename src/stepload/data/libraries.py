"""Optional libraries, needed only for their own kind of table."""

from __future__ import annotations

from typing import Any

from stepload.runner.extras import extra


def library(name: str, wanted_for: str) -> Any:
    """Import an optional library; raises as `extra`."""
    return extra(name, wanted_for, "data", f", or {name} alone")
