"""COMPONENT_METADATA of the simulated vehicle: which flavour offers it, and files over MAVLink FTP."""

from __future__ import annotations

import json
import lzma
import struct
from collections.abc import Callable
from typing import Any

import pytest

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.file_protocol import ACK, HEAD, NACK, NOT_FOUND, OPEN_TO_READ, PAYLOAD, READ, TERMINATE
from simulator.metadata import mavlink_crc32
from simulator.px4.flavour import PX4

MESSAGE = 397
SESSION = 3


def asked(ground: Any) -> tuple[int | None, list[bytes]]:
    """Returns the acknowledgement of a request for COMPONENT_METADATA, and the payloads received."""
    frames: list[bytes] = []
    hand_out = ground.vehicle.datagrams_to_send

    def heard() -> list[bytes]:
        sent = hand_out()
        frames.extend(frame for frame in sent if int.from_bytes(frame[7:10], "little") == MESSAGE)
        return [frame for frame in sent if frame not in frames]

    ground.vehicle.datagrams_to_send = heard
    result = ground.command(mavlink.MAV_CMD_REQUEST_MESSAGE, MESSAGE)
    del ground.vehicle.datagrams_to_send
    return result, [frame[10 : 10 + frame[1]].ljust(108, b"\0") for frame in frames]


def reported(ground: Any) -> tuple[int, str]:
    """Returns CRC and address."""
    result, payloads = asked(ground)
    assert result == mavlink.MAV_RESULT_ACCEPTED
    ((_, crc, address),) = [struct.unpack("<II100s", one) for one in payloads]
    return crc, address.rstrip(b"\0").decode()


class Ftp:
    def __init__(self, ground: Any) -> None:
        self._ground = ground
        self._sequence = 0

    def ask(self, op: int, *, offset: int = 0, size: int = 0, data: bytes = b"") -> tuple[int, bytes]:
        self._sequence += 2
        payload = HEAD.pack(self._sequence, SESSION, op, len(data) or size, 0, 0, offset) + data
        self._ground.send(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload.ljust(PAYLOAD, b"\0")))
        (answer,) = [m for m in self._ground.run(0.1) if m.get_type() == "FILE_TRANSFER_PROTOCOL"]
        _, _, kind, size, _, _, _ = HEAD.unpack_from(bytes(answer.payload))
        return kind, bytes(answer.payload)[HEAD.size : HEAD.size + size]

    def read(self, address: str) -> bytes:
        kind, size = self.ask(OPEN_TO_READ, data=address.removeprefix("mftp://").encode())
        assert kind == ACK, size
        whole = b""
        while len(whole) < struct.unpack("<I", size)[0]:
            kind, data = self.ask(READ, offset=len(whole), size=200)
            assert kind == ACK
            whole += data
        assert self.ask(READ, offset=len(whole), size=200)[0] == NACK
        self.ask(TERMINATE)
        return whole


@pytest.mark.parametrize("options", [{"flavour": PX4}, {"metadata": True}], ids=["px4", "asked-for"])
def test_both_files_are_there_whole_and_their_crcs_hold(ground: Callable[..., Any], options: dict[str, Any]) -> None:
    station = ground(**options)
    crc, address = reported(station)
    ftp = Ftp(station)
    general = ftp.read(address)
    assert mavlink_crc32(general) == crc
    offers = json.loads(general)
    assert offers["version"] == 1
    (parameters,) = [one for one in offers["metadataTypes"] if one["type"] == 1]
    packed = ftp.read(parameters["uri"])
    assert mavlink_crc32(packed) == parameters["fileCrc"]
    document = json.loads(lzma.decompress(packed))
    assert document["version"] == 1
    assert [one["name"] for one in document["parameters"]] == [one.name for one in station.vehicle.parameters]
    by_name = {one["name"]: one for one in document["parameters"]}
    if "flavour" in options:
        assert by_name["COM_RC_LOSS_T"] == {
            "name": "COM_RC_LOSS_T",
            "type": "Float",
            "group": "COM",
            "default": 0.5,
            "units": "s",
            "min": 0.0,
            "max": 35.0,
        }
        assert {one["value"] for one in by_name["NAV_RCL_ACT"]["values"]} == {0, 1, 2, 3, 5, 6}
    else:
        assert by_name["FLTMODE1"]["values"][0] == {"value": 0, "description": "STABILIZE"}
        assert by_name["SYSID_THISMAV"]["rebootRequired"] is True


@pytest.mark.parametrize("options", [{}, {"flavour": PX4, "metadata": False}], ids=["ardupilot", "switched-off"])
def test_where_it_is_not_offered_it_is_refused_at_once(ground: Callable[..., Any], options: dict[str, Any]) -> None:
    result, payloads = asked(ground(**options))
    assert (result, payloads) == (mavlink.MAV_RESULT_FAILED, [])


def test_it_can_be_missing_or_damaged(ground: Callable[..., Any]) -> None:
    station = ground(metadata=True, failures={Failure.METADATA_MISSING})
    ftp = Ftp(station)
    (offer,) = json.loads(ftp.read(reported(station)[1]))["metadataTypes"]
    name = offer["uri"].removeprefix("mftp://").encode()
    assert ftp.ask(OPEN_TO_READ, data=name) == (NACK, bytes([NOT_FOUND]))
    station.vehicle.failures = {Failure.METADATA_DAMAGED}
    packed = ftp.read(offer["uri"])
    assert mavlink_crc32(packed) != offer["fileCrc"]


def test_the_file_of_parameters_of_an_ardupilot_is_read_as_before(ground: Callable[..., Any]) -> None:
    station = ground(metadata=True)
    ftp = Ftp(station)
    assert ftp.ask(OPEN_TO_READ, data=b"@PARAM/param.pck")[0] == ACK
    assert ftp.ask(READ, size=239)[1][:2] == struct.pack("<H", 0x671B)
    assert ftp.ask(READ, size=100, offset=239)[0] == NACK, "the blocks of one session are of one size"
    ftp.ask(TERMINATE)
    px4 = Ftp(ground(flavour=PX4))
    assert px4.ask(OPEN_TO_READ, data=b"@PARAM/param.pck") == (NACK, bytes([NOT_FOUND]))
