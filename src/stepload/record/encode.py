"""Rows of a stream → MCAP message records of its topics, in bulk."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stepload.record.container import INDEX_ENTRY
from stepload.record.layout import EVENTS, Stream, Topic, row_dtype, string_record
from stepload.rig.clockmap import ClockMap

Group = tuple[int, NDArray[np.void], bytes | bytearray]
MAX_NS = 1 << 62
MOST_LATENCY_S = 1.0
"""No sample is under way for longer: its device's clock has jumped."""


def to_ns(time_s: NDArray[np.float64], offset_ns: int) -> NDArray[np.int64]:
    """Nanoseconds on the record's time axis; what is not a time becomes the axis' start."""
    ns = np.rint(time_s * 1e9)
    bad = ~(np.abs(ns) < MAX_NS)
    if bad.any():
        ns = np.where(bad, -float(offset_ns), ns)
    whole: NDArray[np.int64] = ns.astype(np.int64) + offset_ns
    return np.maximum(whole, 0)


class _Encoder:
    """Makes message records of one topic from the rows of its stream."""

    def __init__(self, topic: Topic, row: np.dtype[np.void]) -> None:
        assert topic.dtype is not None
        self._topic = topic
        self._dtype = topic.dtype
        self._template = topic.template()
        assert row.fields is not None
        starts = [(row.fields[name][1] // 8, kind.words) for name, kind in topic.fields.items()]
        self._words = np.array([start + i for start, words in starts for i in range(words)])

    def encode(
        self,
        rows: NDArray[np.void],
        sequence: NDArray[np.int64],
        log_ns: NDArray[np.int64],
        publish_ns: NDArray[np.int64],
    ) -> Group:
        """Message records with their index entries (see Appender.add_chunk)."""
        raw = bytearray(self._template * len(rows))
        out = np.frombuffer(raw, self._dtype)
        out["sequence_u4"] = sequence & 0xFFFFFFFF
        out["log_ns"] = log_ns
        out["publish_ns"] = publish_ns
        if self._topic.frame is not None:
            out["stamp_s"], out["stamp_ns"] = np.divmod(publish_ns, 1_000_000_000)
        out["words"] = rows.view("<u8").reshape(len(rows), -1).take(self._words, axis=1)
        return self._topic.channel, _index(log_ns, self._dtype.itemsize), raw


def _index(log_ns: NDArray[np.int64], stride: int) -> NDArray[np.void]:
    index = np.empty(len(log_ns), INDEX_ENTRY)
    index["log_ns"] = log_ns
    index["offset"] = np.arange(len(log_ns), dtype=np.uint64) * stride
    return index


class Channel:
    """Encodes the rows of one stream, or the events; remembers what must not go backwards.

    Args:
        stream: what the rows are and what is made of them; None for the events.
        offset_ns: from the run's clock to the record's time axis.
        count: of its rows that the file has already.
    """

    def __init__(self, stream: Stream | None, offset_ns: int, count: int = 0) -> None:
        self._encoders = (
            [_Encoder(topic, row_dtype(stream.row)) for topic in stream.topics] if stream else []
        )
        self._offset_ns = offset_ns
        self._last_ns, self._latest_ns = 0, MAX_NS
        self._count = count
        self._clock = ClockMap()

    def within(self, earliest_ns: int, latest_ns: int) -> None:
        """Log nothing outside of these times from now on: chunks do not overlap."""
        self._last_ns, self._latest_ns = max(self._last_ns, earliest_ns), latest_ns

    def _log_ns(self, time_s: NDArray[np.float64]) -> NDArray[np.int64]:
        ns = np.minimum(to_ns(time_s, self._offset_ns), self._latest_ns)
        ns = np.maximum(np.maximum.accumulate(ns), self._last_ns)
        self._last_ns = int(ns[-1])
        return ns

    def encode_samples(self, rows: NDArray[np.void]) -> list[Group]:
        """Device samples: logged at their receive time, stamped with their mapped device time.

        One whose device time is none, or has jumped, is stamped with its receive time.
        """
        receive_s, device_s = rows["receive_time_s"], rows["device_time_s"]
        latency_s = receive_s - device_s
        stamp_s = receive_s
        first = int(latency_s.argmin())
        if np.isfinite(latency_s[first]):
            self._clock.add(float(device_s[first]), float(receive_s[first]))
            start_s = self._clock.to_host(0.0)
            mapped_s = start_s + device_s * (self._clock.to_host(1.0) - start_s)
            mapped_s = np.minimum(mapped_s, receive_s)
            stamp_s = np.where(receive_s - mapped_s < MOST_LATENCY_S, mapped_s, receive_s)
        log_ns = self._log_ns(receive_s)
        publish_ns = to_ns(stamp_s, self._offset_ns)
        sequence = rows["sequence"]
        return [e.encode(rows, sequence, log_ns, publish_ns) for e in self._encoders]

    def encode_ticks(self, rows: NDArray[np.void]) -> list[Group]:
        """Ticks: logged and stamped with their own time, numbered from 0."""
        log_ns = self._log_ns(rows["time_s"])
        sequence = np.arange(self._count, self._count + len(rows), dtype=np.int64)
        self._count += len(rows)
        return [e.encode(rows, sequence, log_ns, log_ns) for e in self._encoders]

    def encode_events(self, events: Sequence[tuple[float, bytes]]) -> list[Group]:
        """Texts with their times."""
        log_ns = self._log_ns(np.array([time_s for time_s, _ in events]))
        index = np.empty(len(events), INDEX_ENTRY)
        index["log_ns"] = log_ns
        parts: list[bytes] = []
        offset = 0
        for i, (_, text) in enumerate(events):
            index["offset"][i] = offset
            part = string_record(EVENTS, self._count + i, int(log_ns[i]), text)
            parts.append(part)
            offset += len(part)
        self._count += len(events)
        return [(EVENTS.channel, index, b"".join(parts))]
