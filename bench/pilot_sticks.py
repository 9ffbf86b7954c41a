"""A pilot's part in the benchmarks: takes control, sends numbered sticks, answers the tower's pings."""

from __future__ import annotations

import asyncio
import json
import time
from struct import Struct
from typing import Final

import httpx

from bench.lean_browser import LeanBrowser
from bench.load_tower import LoadTower
from wire.dialect import build, mavlink
from wire.frames import message_id
from wire.ids import DroneId
from wire.lateness import stamp_ms
from wire.tagged import stamp, tag

STICKS_S: Final = 0.02
START_S: Final = 60.0
_MANUAL_CONTROL: Final = mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL
_BUTTONS: Final = Struct("<H")
_BUTTONS_AT: Final = 10 + 8


def stick(drone_id: DroneId, number: int) -> bytes:
    """Returns a MANUAL_CONTROL as a browser sends it now. Its `buttons` are the number, 1 to 65,535."""
    message = mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, number)
    frame = build(message, system_id=255, component_id=190, sequence=number & 0xFF)
    return stamp(stamp_ms(time.monotonic())) + tag(drone_id, frame)


def stick_number(frame: bytes) -> int | None:
    """Returns the number in such a frame; None if it is another message."""
    if message_id(frame) != _MANUAL_CONTROL:
        return None
    return int(_BUTTONS.unpack_from(frame.ljust(32, b"\0"), _BUTTONS_AT)[0])


def answer_ping(browser: LeanBrowser, text: bytes) -> None:
    """Answers if the text is the tower's ping."""
    event = json.loads(text)
    if event["type"] == "ping":
        browser.send_text(json.dumps({"type": "pong", "sequence": event["sequence"]}))


async def take(tower: LoadTower, drone_id: int, how: str = "take") -> None:
    """Waits for the heartbeats of the drone's autopilot, then takes control, or acquires them, which orders no
    hold."""
    async with httpx.AsyncClient(
        base_url=f"{tower.url}/api/v1", headers={"Cookie": tower.cookie}, trust_env=False
    ) as client:
        async with asyncio.timeout(START_S):
            while not (await client.get(f"/drones/{drone_id}")).json()["autopilot_heard"]:  # noqa: ASYNC110
                await asyncio.sleep(0.1)
            while True:
                answer = await client.post(f"/drones/{drone_id}/control/{how}", json={"reason": "bench"})
                if answer.status_code != httpx.codes.SERVICE_UNAVAILABLE:
                    break
                await asyncio.sleep(1.0)  # the disk of a busy machine can take seconds for one write
        answer.raise_for_status()
