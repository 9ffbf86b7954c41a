"""Addresses, token files and autopilot names: what is accepted, and the one-line reason for each refusal."""

from pathlib import Path

import pytest

from onboard_agent.autopilot_port.peer import FAITHFUL_FOR_S, PeerChoice
from onboard_agent.autopilot_port.schemes import SCHEMES, help_text, make_port
from onboard_agent.autopilot_port.serial_line import SerialLine
from onboard_agent.autopilot_port.tcp import TcpIn, TcpOut
from onboard_agent.autopilot_port.udp import UdpIn, UdpOut
from onboard_agent.link.identity_file import read_identity, token_file_warning
from onboard_agent.link.tower_url import parse_tower_url
from onboard_agent.sockets.uplinks import parse_uplinks
from onboard_agent.unusable import Unusable
from wire.dialect import build, mavlink


@pytest.mark.parametrize(
    ("text", "channel"),
    [
        ("https://tower.example.org", "wss://tower.example.org:443/api/v1/agent"),
        ("https://tower.example.org:8443/", "wss://tower.example.org:8443/api/v1/agent"),
        ("http://127.0.0.1:8000", "ws://127.0.0.1:8000/api/v1/agent"),
        ("http://localhost:8000", "ws://localhost:8000/api/v1/agent"),
        ("http://[::1]:8000", "ws://[::1]:8000/api/v1/agent"),
    ],
)
def test_addresses_of_a_tower(text: str, channel: str) -> None:
    assert parse_tower_url(text).channel == channel


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("http://tower.example.org", "plain http"),
        ("http://192.168.1.5:8000", "plain http"),
        ("http://127.0.0.1.example.org", "plain http"),
        ("tower.example.org", "must look like"),
        ("ftp://tower.example.org", "must look like"),
        ("https://", "must look like"),
        ("https://tower.example.org/console", "must be only"),
        ("https://user:word@tower.example.org", "must be only"),
        ("https://tower.example.org:99999", "is not an address"),
        ("", "must look like"),
    ],
)
def test_addresses_that_are_refused(text: str, why: str) -> None:
    with pytest.raises(Unusable, match=why):
        parse_tower_url(text)


GOOD = "twd_7_" + "s" * 43


def test_a_token_file(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text(GOOD + "\n")
    file.chmod(0o600)
    assert str(read_identity(file).credential) == GOOD
    assert token_file_warning(file) is None
    file.chmod(0o644)
    assert "chmod 600" in str(token_file_warning(file))


@pytest.mark.parametrize("content", [b"", b"twd_7_short", b"\xff\xfe", b"x" * 5000, GOOD.encode() + b"!"])
def test_a_malformed_token_is_refused_and_not_repeated(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "token"
    file.write_bytes(content)
    with pytest.raises(Unusable, match="does not contain a drone's key") as caught:
        read_identity(file)
    assert "s" * 43 not in str(caught.value)


def test_a_missing_token_file(tmp_path: Path) -> None:
    with pytest.raises(Unusable, match="cannot be read: No such file"):
        read_identity(tmp_path / "nothing")
    with pytest.raises(Unusable, match="cannot be read: Is a directory"):
        read_identity(tmp_path)


@pytest.mark.parametrize(
    ("text", "kind", "speaks_first"),
    [
        ("udpin:0.0.0.0:14550", UdpIn, False),
        ("udpout:127.0.0.1:14550", UdpOut, True),
        ("tcp:autopilot.local:5760", TcpOut, False),
        ("tcpin:[::1]:5760", TcpIn, False),
        ("serial:/dev/ttyAMA0:921600", SerialLine, False),
        ("serial:/dev/ttyACM0", SerialLine, False),
    ],
)
def test_autopilots(text: str, kind: type, speaks_first: bool) -> None:
    port = make_port(text)
    assert isinstance(port, kind)
    assert port.name == text
    assert port.speaks_first is speaks_first


def test_the_baud_rate_is_read_and_has_a_default() -> None:
    fast, usual = make_port("serial:/dev/ttyAMA0:921600"), make_port("serial:/dev/serial/by-id/usb-x")
    assert isinstance(fast, SerialLine)
    assert isinstance(usual, SerialLine)
    assert (fast._device, fast._baud) == ("/dev/ttyAMA0", 921_600)
    assert (usual._device, usual._baud) == ("/dev/serial/by-id/usb-x", 57_600)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "udp:1.2.3.4:5",
        "udpin",
        "udpin:14550",
        "udpin:host:",
        "udpin:host:70000",
        "udpin:host:x",
        "tcp::5760",
        "serial:",
        "serial:/dev/ttyAMA0:fast",
        "serial:/dev/ttyAMA0:0",
    ],
)
def test_autopilots_that_are_refused(text: str) -> None:
    with pytest.raises(Unusable) as caught:
        make_port(text)
    assert "\n" not in str(caught.value)


def test_every_transport_is_in_the_help() -> None:
    assert all(scheme.form in help_text() for scheme in SCHEMES.values())


FRAME = build(mavlink.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3), system_id=1, component_id=1, sequence=7)
ONE, TWO = ("127.0.0.1", 1111), ("127.0.0.1", 2222)


def test_the_peer_is_who_sends_a_valid_frame() -> None:
    choice = PeerChoice()
    assert not choice.accepts(ONE, b"hello", 0.0)
    assert not choice.accepts(ONE, FRAME[:-1] + b"\0", 0.0)
    assert choice.address is None
    assert choice.accepts(TWO, FRAME, 0.1)
    assert choice.address == TWO


def test_the_peer_stays_until_it_is_silent() -> None:
    choice = PeerChoice()
    choice.accepts(ONE, FRAME, 0.0)
    assert choice.accepts(ONE, b"half a fr", 2.0), "its bytes may be cut anywhere"
    assert not choice.accepts(TWO, FRAME, 2.0 + FAITHFUL_FOR_S - 0.1)
    assert not choice.accepts(TWO, b"noise", 2.0 + FAITHFUL_FOR_S)
    assert choice.accepts(TWO, FRAME, 2.0 + FAITHFUL_FOR_S)
    assert not choice.accepts(ONE, FRAME, 2.1 + FAITHFUL_FOR_S)


@pytest.mark.parametrize(
    ("words", "uplinks"),
    [
        ([], ("",)),
        (["wlan0"], ("wlan0",)),
        (["wlan0", "wwan0"], ("wlan0", "wwan0")),
        (["wlan0, 10.0.0.2", "fd00::2"], ("wlan0", "10.0.0.2", "fd00::2")),
    ],
)
def test_uplinks(words: list[str], uplinks: tuple[str, ...]) -> None:
    assert parse_uplinks(words) == uplinks


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["an-interface-with-a-long-name"], "neither the name"),
        (["10.0.0.300/8"], "neither the name"),
        (["wlan0", "wlan0"], "twice"),
        (["a,b,c,d,e"], "more than the 4"),
    ],
)
def test_uplinks_that_cannot_be(words: list[str], why: str) -> None:
    with pytest.raises(Unusable, match=why):
        parse_uplinks(words)
