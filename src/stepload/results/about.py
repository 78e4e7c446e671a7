"""Head of results.json: the run that a result belongs to, and the software that computed it."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from importlib import resources
from typing import Any

import numpy as np
import scipy

import stepload

SCHEMA = "stepload-results/1"
"""Name of the schema of results.json. Within a version keys are added, never removed or changed."""

_TEXTS = (
    "run_id", "started", "plan", "payload", "rig", "specimen", "batch", "operator", "notes",
    "calibration", "arm", "stepload",
)  # fmt: skip
_DEVICES = {
    "force": "force_sensor",
    "second_force": "second_force_sensor",
    "displacement": "displacement_sensor",
}
"""Keys of the results, by the record's names of the devices."""


def schema_text() -> str:
    """The JSON Schema of results.json."""
    return (resources.files("stepload.results") / "results.schema.json").read_text()


def about(metadata: Mapping[str, str], attachments: Mapping[str, bytes]) -> dict[str, Any]:
    """The head of the results of a run.

    Args:
        metadata: of the record.
        attachments: files of the record; those of the plan are named with their SHA-256.
    """
    tags = [tag for tag in metadata.get("tags", "").split("\n") if tag]
    sums = {
        name: hashlib.sha256(data).hexdigest()
        for name, data in attachments.items()
        if name.startswith("plan")
    }
    devices = {name: metadata.get(role, "") for name, role in _DEVICES.items()}
    texts = {name: metadata.get(name, "") for name in _TEXTS}
    return {
        "schema": SCHEMA,
        "run": texts | devices | {"tags": tags, "files": sums},
        "versions": {
            "stepload": stepload.__version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
            "scipy": scipy.__version__,
        },
    }
