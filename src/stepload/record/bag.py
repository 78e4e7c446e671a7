"""The metadata.yaml that makes the directory of a record a rosbag2, for `ros2 bag` and readers."""

from __future__ import annotations

import json
from pathlib import Path

from mcap.reader import SeekingReader

METADATA = "metadata.yaml"


def bag_metadata(record: Path) -> str:
    """The text of metadata.yaml, in version 5 of its format, for a record of ours that is whole.

    It is written as JSON, which is YAML too.

    Raises:
        OSError: it cannot be read.
    """
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
    return json.dumps({"rosbag2_bagfile_information": bag}, indent=1) + "\n"
