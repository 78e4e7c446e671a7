"""The metadata.yaml that makes the directory of a record a rosbag2, for `ros2 bag` and its readers.

Version 5 of the format (Humble), which later versions read as well.
"""

from __future__ import annotations

import io
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import SeekingReader

from stepload.errors import BadInputError

METADATA = "metadata.yaml"
VERSION = 5


def bag_metadata(record: Path) -> str:
    """The text of metadata.yaml for a finished record, from its summary.

    Raises:
        BadInputError: the record has no summary with statistics.
    """
    from ruamel.yaml import YAML

    try:
        with record.open("rb") as file:
            summary = SeekingReader(file).get_summary()
    except (OSError, McapError) as error:
        raise BadInputError(f"{record}: {error}") from error
    if summary is None or summary.statistics is None:
        raise BadInputError(f"{record}: it has no statistics", hint="`stepload recover` adds them")
    about, counts = summary.statistics, summary.statistics.channel_message_counts
    topics = [
        {
            "topic_metadata": {
                "name": channel.topic,
                "type": summary.schemas[channel.schema_id].name,
                "serialization_format": channel.message_encoding,
                "offered_qos_profiles": channel.metadata.get("offered_qos_profiles", ""),
            },
            "message_count": counts.get(channel.id, 0),
        }
        for channel in summary.channels.values()
    ]
    span = {
        "duration": {"nanoseconds": about.message_end_time - about.message_start_time},
        "starting_time": {"nanoseconds_since_epoch": about.message_start_time},
        "message_count": about.message_count,
    }
    yaml, text = YAML(typ="safe", pure=True), io.StringIO()
    yaml.default_flow_style = False
    yaml.sort_base_mapping_type_on_output = False
    yaml.dump(
        {
            "rosbag2_bagfile_information": {
                "version": VERSION,
                "storage_identifier": "mcap",
                **span,
                "topics_with_message_count": topics,
                "compression_format": "",
                "compression_mode": "",
                "relative_file_paths": [record.name],
                "files": [{"path": record.name, **span}],
            }
        },
        text,
    )
    return text.getvalue()
