"""Two writers of one file never mix; what was there stays until the new one is whole."""

from __future__ import annotations

import os
import threading

import pytest

from stepload.plan.whole_file import replace_file


def test_two_writers_at_once_leave_one_of_the_two(tmp_path):
    path = tmp_path / "rig.yaml"
    texts = [bytes([letter]) * 200_000 for letter in b"ab"]
    failed = []

    def write(text):
        try:
            for _ in range(20):
                replace_file(path, text)
        except OSError as error:
            failed.append(error)

    threads = [threading.Thread(target=write, args=(text,)) for text in texts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failed == []
    assert path.read_bytes() in texts
    assert os.listdir(tmp_path) == ["rig.yaml"]


def test_what_cannot_be_written_leaves_what_was_there(tmp_path, monkeypatch):
    path = tmp_path / "rig.yaml"
    path.write_text("old")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        replace_file(path, b"new")
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["rig.yaml"]


def test_the_mode_of_the_file_is_kept(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text("old")
    path.chmod(0o640)
    replace_file(path, b"new")
    assert path.stat().st_mode & 0o777 == 0o640
