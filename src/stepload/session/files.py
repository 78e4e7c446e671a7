"""The files and the metadata that a run keeps beside its data."""

from __future__ import annotations

import json
import logging
import os
import platform
import re
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mcap.reader import SeekingReader

import stepload
from stepload.engine import replay
from stepload.errors import BadInputError
from stepload.feasibility.preflight import Preflight
from stepload.plan.compose import SIMULATED
from stepload.plan.model import Plan, Provenance, SecondForceSource
from stepload.plan.whole_file import write_whole
from stepload.record.plain import json_text
from stepload.record.recorder import NAME
from stepload.record.recovery import PART_SUFFIX
from stepload.report import conditions
from stepload.report.model import Document
from stepload.report.page import render
from stepload.rig.device import Identity

REPORT, RESULTS, METADATA = "report.html", "results.json", "metadata.yaml"
RECORD, PART = NAME, NAME + PART_SUFFIX
_log = logging.getLogger(__name__)


def run_directory(plan: Plan, *, dry_run: bool, out: Path | None) -> Path:
    """Where a run's files go: `out`, or a new directory below the plan's record directory."""
    if out is not None:
        return out
    stamp = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    slug = re.sub(r"[^a-z0-9]+", "-", plan.name.lower()).strip("-")[:40] or "run"
    name = f"{stamp}-{slug}{'-dry' if dry_run else ''}"
    directory, number = plan.record.directory / name, 1
    while os.path.lexists(directory):  # two runs within a second
        number += 1
        directory = plan.record.directory / f"{name}-{number}"
    return directory


def make_directory(directory: Path) -> None:
    """Make a run's directory, and refuse early one in which no record can be written.

    Raises:
        BadInputError: it cannot be made, is a symbolic link, or holds a record already.
    """
    if directory.is_symlink():
        raise BadInputError(
            f"{directory} is a symbolic link", hint="name the directory that it points to"
        )
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(
            f"cannot make the directory {directory}: {error.strerror}",
            hint="choose another with --out",
        ) from error
    for name in (RECORD, PART, RESULTS, REPORT, METADATA):
        if os.path.lexists(directory / name):
            raise BadInputError(
                f"{directory / name} exists already", hint="a run needs a directory of its own"
            )


def rescue_places(directory: Path) -> Iterator[Path]:
    """Where a run's files can go if its directory does not take them; made when asked for."""
    if directory.is_dir():
        yield directory
    with suppress(OSError):
        (beside := directory.with_name(f"{directory.name}-rescued")).mkdir()
        yield beside
        beside.rmdir()
    with suppress(OSError):
        yield Path(tempfile.mkdtemp(prefix=f"stepload-{directory.name}-"))


def metadata(plan: Plan, *, dry_run: bool, seed: int | None, started: datetime) -> dict[str, str]:
    """The record's metadata: who, when, with what; flat texts."""
    second = plan.rig.second_force
    sensor = second.sensor if second.source is SecondForceSource.SENSOR else None
    world = plan.rig.simulation.world
    return {
        "plan": plan.name,
        "started": started.isoformat(timespec="seconds"),
        "simulated": str(dry_run).lower(),
        "dry_run": str(dry_run).lower(),
        "seed": "" if seed is None else str(seed),
        "stepload": stepload.__version__,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "host": platform.node(),
        "operator": plan.record.operator,
        "notes": plan.record.notes,
        "specimen": plan.record.specimen,
        "batch": plan.record.batch,
        "tags": "\n".join(plan.record.tags),
        "force_axis": plan.rig.force.axis,
        "second_force_axis": sensor.axis if sensor else "",
        "rig": plan.rig.name,
        "calibration": _calibration(plan),
        "payload": plan.payload.name,
        "payload_file": "" if plan.payload_file is None else str(plan.payload_file),
        **({"world": world} if dry_run and world != SIMULATED else {}),
    }


def _calibration(plan: Plan) -> str:
    """The calibration that K_s comes from: the checksum of its file, or who declared it.

    Runs with the same one share its error, which cancels when they are compared.
    """
    stiffness = plan.rig.system_stiffness
    if stiffness.record is not None and stiffness.provenance is Provenance.MEASURED:
        name = str(stiffness.record)
        for source in plan.sources:
            if source.name == name:
                return f"sha256 {source.sha256}"
    return str(stiffness.provenance)


def device_metadata(identities: Mapping[str, Identity]) -> dict[str, str]:
    """The identity of each device as a text, by its role."""
    return {
        role: f"{each.driver}: {each.model} {each.serial_number}, firmware {each.firmware}, "
        f"calibration {each.calibration_revision}"
        for role, each in identities.items()
    }


def plan_files(plan: Plan) -> dict[str, bytes]:
    """The plan's texts by the names they have in a record."""
    return {
        "plan.yaml"
        if index == 0
        else f"plan-{index}-{Path(source.name).name}": source.text.encode()
        for index, source in enumerate(plan.sources)
    }


def attachments(preflight: Preflight) -> dict[str, bytes]:
    """The record's files: conditions, plan, limits, preflight."""
    reasons = [
        {"code": r.code, "severity": r.severity.value, "message": r.message, "remedy": r.remedy}
        for r in preflight.reasons
    ]
    told = {"verdict": preflight.verdict.value, "reasons": reasons}
    return {
        conditions.FILE: conditions.to_bytes(conditions.planned(preflight)),
        **plan_files(preflight.plan),
        replay.FILE: replay.limits_to_bytes(preflight.run_limits),
        "preflight.json": json.dumps(told).encode(),
    }


def write_results(directory: Path, data: Mapping[str, Any], document: Document | None) -> None:
    """Write results.json, and report.html where there is a document.

    Raises:
        OSError: one of them could not be written.
    """
    write_file(directory / RESULTS, json_text(data, indent=1) + "\n")
    if document is not None:
        write_file(directory / REPORT, render(document))


def write_bag_metadata(record: Path) -> None:
    """Make the directory of a whole record of ours a rosbag2, version 5; raises OSError."""
    with record.open("rb") as file:
        summary = SeekingReader(file).get_summary()
    assert summary is not None
    about = summary.statistics
    assert about is not None
    topics = [
        {
            "topic_metadata": {
                "name": channel.topic, "type": summary.schemas[channel.schema_id].name,
                "serialization_format": channel.message_encoding, "offered_qos_profiles": "",
            },
            "message_count": about.channel_message_counts.get(channel.id, 0),
        }
        for channel in summary.channels.values()
    ]  # fmt: skip
    span = {
        "starting_time": {"nanoseconds_since_epoch": about.message_start_time},
        "duration": {"nanoseconds": about.message_end_time - about.message_start_time},
        "message_count": about.message_count,
    }
    bag = {
        "version": 5, "storage_identifier": "mcap", "relative_file_paths": [record.name], **span,
        "topics_with_message_count": topics, "compression_format": "", "compression_mode": "",
        "files": [{"path": record.name, **span}],
    }  # fmt: skip
    text = json.dumps({"rosbag2_bagfile_information": bag}, indent=1)  # which is YAML too
    write_file(record.with_name(METADATA), text + "\n")


def write_file(path: Path, text: str) -> None:
    """Write a file that is there whole or not at all; a link of that name is not followed.

    Raises:
        OSError: it could not be written; what was there before still is.
    """
    write_whole(path, text.encode())
    _log.info("written: %s, %d characters", path, len(text))
