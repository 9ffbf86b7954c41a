"""Servos and a sensor beside the autopilot, on one port."""

import asyncio
import contextlib
from pathlib import Path

import pytest

from onboard_agent.autopilot_port.port import AutopilotPort, OnBytes
from onboard_agent.autopilot_port.udp import UdpIn
from onboard_agent.payload.payload_port import PayloadPort, with_payload
from onboard_agent.payload.servo import Servo
from onboard_agent.payload.sysfs_pwm import SysfsPwm
from onboard_agent.unusable import Unusable
from wire.dialect import build, decode, mavlink
from wire.frame_stream import FrameStream

BEAT = build(mavlink.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3), system_id=5, component_id=1, sequence=7)
GIMBAL = build(mavlink.MAVLink_heartbeat_message(26, 8, 0, 0, 4, 3), system_id=9, component_id=154, sequence=7)


class Line(AutopilotPort):
    """A port of the test."""

    def __init__(self) -> None:
        super().__init__("line")
        self.sent: list[bytes] = []
        self.received: OnBytes = lambda data: None
        self.ends = asyncio.Event()

    async def run(self, received: OnBytes) -> None:
        self.received = received
        self.on_open()
        await self.ends.wait()

    def send(self, data: bytes) -> None:
        self.sent.append(data)


def command(number: int) -> bytes:
    message = mavlink.MAVLink_command_long_message(5, 1, 183, 0, number, 1900, 0, 0, 0, 0, 0)
    return build(message, system_id=255, component_id=190, sequence=0)


async def test_everything_finds_its_way(tmp_path: Path) -> None:
    channel = tmp_path / "pwmchip0" / "pwm1"
    channel.mkdir(parents=True)
    for path in (*(tmp_path / "pwmchip0" / name for name in ("export", "unexport")), *(channel / n for n in FILES)):
        path.touch()
    autopilot, sensor, came = Line(), Line(), bytearray()
    port = PayloadPort(autopilot, (Servo(15, 0, 1),), sensor, SysfsPwm(tmp_path))
    opened: list[bool] = []
    port.on_open = lambda: opened.append(True)
    running = asyncio.create_task(port.run(came.extend))
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert opened == [True]
    sensor.received(b'half a line\n{"lost": 1}\n')
    port.send(command(15))
    assert autopilot.sent == [command(15)], "before a vehicle is known everything is the autopilot's"
    autopilot.received(GIMBAL + BEAT[:9])
    sensor.received(b'{"lost": 2}\n')
    autopilot.received(BEAT[9:] + BEAT[:4])
    # In the middle of a frame of the autopilot.
    sensor.received(b'{"co2": 415}\n')
    port.send(command(15) + command(9))
    autopilot.received(BEAT[4:])
    messages = [decode(frame) for frame in FrameStream().feed(bytes(came))]
    kinds = [(one.get_type(), one.get_srcSystem(), one.get_srcComponent()) for one in messages]
    assert kinds == [
        ("HEARTBEAT", 9, 154),
        ("HEARTBEAT", 5, 1),
        ("NAMED_VALUE_FLOAT", 5, 191),
        ("COMMAND_ACK", 5, 1),
        ("HEARTBEAT", 5, 1),
    ]
    assert autopilot.sent == [command(15), command(9)]
    assert (channel / "duty_cycle").read_bytes() == b"1900000"
    running.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await running
    assert (channel / "enable").read_bytes() == b"0", "nobody drives it now"


FILES = ("period", "duty_cycle", "enable")


async def test_a_port_that_cannot_be_opened_ends_it() -> None:
    class Wrong(Line):
        async def run(self, received: OnBytes) -> None:
            raise Unusable("the port is used")

    with pytest.raises(Unusable, match="used"):
        await PayloadPort(Line(), (), Wrong(), SysfsPwm()).run(lambda data: None)


def test_only_what_is_configured_is_there() -> None:
    port = UdpIn("udpin:127.0.0.1:0", "127.0.0.1", 0)
    assert with_payload(port, (), None) is port
    assert isinstance(with_payload(port, (), "tcp:127.0.0.1:1"), PayloadPort)
    with pytest.raises(Unusable, match="known are serial"):
        with_payload(port, (), "msp:/dev/ttyUSB0")
