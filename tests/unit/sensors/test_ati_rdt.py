"""RDT requests, records and status words, and the page of an Ethernet sensor."""

import pytest
from ati_page import PAGE

from stepload_drivers.ati import rdt
from stepload_drivers.ati.box import read_box
from stepload_drivers.ati.rdt import AXIA, NET_BOX, Command, Record, Scale
from stepload_verify.emulators.ati_net import encode, requested


@pytest.mark.parametrize(
    ("command", "count", "data"),
    [
        (Command.START, 0, "1234000200000000"),
        (Command.STOP, 0, "1234000000000000"),
        (Command.BIAS, 0, "1234004200000000"),
        (Command.START, 1000, "12340002000003e8"),
    ],
)
def test_requests(command, count, data):
    assert rdt.request(command, count).hex() == data
    assert requested(bytes.fromhex(data)) == (command, count)


def test_a_record():
    data = bytes.fromhex(
        "00000007" "0001e240" "80020000"
        "000f4240" "fff0bdc0" "ffffffff" "00000000" "7fffffff" "80000000"
    )  # fmt: skip
    counts = (1_000_000, -1_000_000, -1, 0, 2**31 - 1, -(2**31))
    record = rdt.decode(data)
    assert record == Record(7, 123456, 0x80020000, counts)
    assert encode(record) == data
    wrench = Scale(1e-6, 1e-3).wrench(counts)
    assert wrench == pytest.approx((1.0, -1.0, -1e-6, 0.0, 2147483.647, -2147483.648))


def test_counters_go_on_over_their_wrap_and_back():
    assert rdt.step(2**32 - 1, 0) == 1
    assert rdt.step(2**32 - 2, 1) == 3
    assert rdt.step(5, 5) == 0
    assert rdt.step(0, 2**32 - 1) == -1


def test_status_words_of_both_families():
    assert NET_BOX.text(0x80020000) == "transducer saturated or converter at its end"
    assert NET_BOX.text(0x80000000) == "error summary"
    assert AXIA.text(0xC8000000) == "gauge out of range, beyond the sensing range"
    assert NET_BOX.overload & 1 << 17
    assert not NET_BOX.overload & 1 << 27  # there the serial link, not the gauges
    assert AXIA.overload & 1 << 27


def test_the_page_of_a_real_box():
    box = read_box(PAGE, "box")
    assert box.scale == Scale(1e-6, 1e-6)
    assert (box.serial_number, box.firmware, box.internal_hz) == ("FT27462", "2.2.59", 7000.0)
    assert box.rated_n == (330.0, 330.0, 990.0)
    assert box.status is NET_BOX


@pytest.mark.parametrize(
    ("force", "torque", "scale"),
    [
        ("lbf", "lbf-in", (4.4482216152605e-6, 0.1129848290276167e-6)),
        ("kN", "N-mm", (1e-3, 1e-9)),
        ("kgf", "kgf-cm", (9.80665e-6, 0.0980665e-6)),
        ("N", "N-m", (1e-6, 1e-6)),
    ],
)
def test_units_are_the_pages_own(force, torque, scale):
    page = PAGE.replace("<scfgfu>N<", f"<scfgfu>{force}<").replace(">Nm<", f">{torque}<")
    box = read_box(page, "box")
    assert box.scale == pytest.approx(scale)
    assert box.rated_n[2] == pytest.approx(990.0 * scale[0] * 1e6)
