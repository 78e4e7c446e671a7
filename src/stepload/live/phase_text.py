"""What a run is doing, in words."""

from __future__ import annotations

from stepload.record.rows import Phase, TickRow

KEYS = "p pauses; Ctrl+C unloads and ends, twice retracts"


def where(row: TickRow) -> str:
    """Cycle, phase, and the load level where there is one."""
    name = Phase(row.phase).name.replace("_", " ").lower()
    level = f", step {row.step} ({row.level_n:.4g} N)" if row.level_n else ""
    cycle = f"cycle {row.cycle}" if row.cycle else "before the first cycle"
    return f"{cycle}, {name}{level}"


def clock(seconds: float) -> str:
    """A time as people say it: 48 s, 2 min 05 s."""
    whole = round(seconds)
    return f"{whole} s" if whole < 100 else f"{whole // 60} min {whole % 60:02} s"
