"""What is plugged in is looked for on this computer, and nowhere else."""

from __future__ import annotations

import can
import pytest

from stepload.setup.devices import can_adapters


def test_adapters_are_named_and_the_network_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def detect(interfaces: list[str]) -> list[dict[str, str]]:
        asked.extend(interfaces)
        return [{"interface": "pcan", "channel": "PCAN_USBBUS1"}]

    monkeypatch.setattr(can, "detect_available_configs", detect)
    assert can_adapters() == ["pcan PCAN_USBBUS1"]
    assert "gs_usb" in asked
    assert not {"socketcand", "udp_multicast", "virtual", "serial"} & set(asked)


def test_an_adapters_library_that_fails_leaves_none(monkeypatch: pytest.MonkeyPatch) -> None:
    def detect(interfaces: list[str]) -> list[dict[str, str]]:
        raise OSError("half installed")

    monkeypatch.setattr(can, "detect_available_configs", detect)
    assert can_adapters() == []
