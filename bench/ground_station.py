"""For `bench missions --case "ground station"`: QGroundControl's requests on connecting, through `tower connect`.

The order, the number of retries and the batches are its own: AUTOPILOT_VERSION, flight modes, component metadata,
camera and gimbal; all parameters by the list, then missing ones ten at a time once nothing has arrived for a second;
all by the file, as a burst whose holes are requested; the counts of the three plans.
"""

from __future__ import annotations

import asyncio
import re
import struct
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

from bench.rig import wait_for
from wire.dialect import build, decode, mavlink
from wire.frame_stream import FrameStream
from wire.frames import message_id

REQUESTED: Final = {"version": 148, "modes": 435, "metadata": 397, "camera": 259, "gimbal": 280}
PAYLOADS: Final = (
    (100, "CAMERA_INFORMATION"),
    (100, "CAMERA_SETTINGS"),
    (100, "STORAGE_INFORMATION"),
    (100, "CAMERA_CAPTURE_STATUS"),
    (154, "GIMBAL_DEVICE_INFORMATION"),
    (154, "GIMBAL_DEVICE_ATTITUDE_STATUS"),
    (1, "GIMBAL_MANAGER_INFORMATION"),
    (1, "GIMBAL_MANAGER_STATUS"),
)
"""The messages that a vehicle with a camera and a gimbal sends on request, and the component of each."""
METADATA: Final = 397
TRIES: Final = 5
ANSWER_S: Final = 1.5
SILENCE_S: Final = 1.0
BATCH: Final = 10
LIST_S: Final = 60.0
OPEN, READ, BURST, TERMINATE, ACK = 4, 5, 15, 1, 128
_HEAD: Final = struct.Struct("<HBBBBBxI")
_BLOCK: Final = 239
_FILE_HEAD: Final = struct.Struct("<HHH")
_SIZES: Final = {1: 1, 2: 2, 3: 4, 4: 4}
_PAYLOAD: Final = 251
FILE: Final = b"@PARAM/param.pck?withdefaults=1"


class NotAnswered(Exception):
    """A requested message never arrived."""


class GroundStation:
    """One program at the TCP port of `tower connect`. Use `at`."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer
        self._sequence = 0
        self._files = 0
        self._heard: asyncio.Queue[Any] = asyncio.Queue()
        self._metadata_heard = 0
        """COMPONENT_METADATA, which the dialect lacks."""
        self._tasks = [asyncio.create_task(self._read()), asyncio.create_task(self._beat())]

    @classmethod
    async def at(cls, log: Path) -> GroundStation:
        """Connects to the port in this log of `tower connect`."""
        found: list[str] = []

        def there() -> bool:
            text = log.read_text(errors="replace")
            found[:] = re.findall(r" is at tcp 127\.0\.0\.1:(\d+)", text)
            return bool(found) and " is online" in text

        await wait_for("tower connect", there)
        return cls(*await asyncio.open_connection("127.0.0.1", int(found[0])))

    async def close(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._writer.close()

    async def _read(self) -> None:
        stream = FrameStream()
        while data := await self._reader.read(65536):
            for frame in stream.feed(data):
                self._metadata_heard += message_id(frame) == METADATA
                message = decode(frame)
                if message is not None:
                    self._heard.put_nowait(message)

    async def _beat(self) -> None:
        while True:
            self._say(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            await asyncio.sleep(1.0)

    def _say(self, message: Any) -> None:
        self._sequence = (self._sequence + 1) % 256
        self._writer.write(build(message, system_id=255, component_id=190, sequence=self._sequence))

    async def _until(self, look: Callable[[Any], bool], within_s: float) -> bool:
        """Returns whether a message satisfied `look`."""
        until = asyncio.get_running_loop().time() + within_s
        while (left := until - asyncio.get_running_loop().time()) > 0:
            try:
                message = await asyncio.wait_for(self._heard.get(), left)
            except TimeoutError:
                return False
            if look(message):
                return True
        return False

    async def _asked(self, what: str, message: Any, look: Callable[[Any], bool], within_s: float = ANSWER_S) -> None:
        for _ in range(TRIES):
            self._say(message)
            if await self._until(look, within_s):
                return
        raise NotAnswered(what)

    async def asks_for_messages(self) -> None:
        """Each request is answered, with the message or with a refusal. Raises NotAnswered."""
        for name, number in REQUESTED.items():
            ask = mavlink.MAVLink_command_long_message(1, 1, 512, 0, number, *[0.0] * 6)
            await self._asked(name, ask, lambda m: m.get_type() == "COMMAND_ACK" and m.command == 512)

    async def asks_payloads(self) -> None:
        """Camera, gimbal and metadata send the requested messages, not only acknowledgements. Raises NotAnswered."""
        for component, name in PAYLOADS:
            number = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
            ask = mavlink.MAVLink_command_long_message(1, component, 512, 0, number, *[0.0] * 6)
            await self._asked(name, ask, partial(_is_from, component, name))
        if not self._metadata_heard:
            raise NotAnswered("COMPONENT_METADATA")

    async def asks_for_plans(self) -> None:
        """Requests the counts of all three. Raises NotAnswered."""
        for kind in range(3):
            counted = partial(_is_count, kind)
            await self._asked(f"plan {kind}", mavlink.MAVLink_mission_request_list_message(1, 1, kind), counted)
            self._say(mavlink.MAVLink_mission_ack_message(1, 1, 0, kind))

    async def lists(self) -> tuple[int, int, int]:
        """Returns how many parameters arrived, how many exist, and how many of them were requested one by one."""
        lacking: set[int] = set()
        batch: set[int] = set()
        count = asked = 0

        def came(message: Any) -> bool:
            nonlocal count
            if message.get_type() != "PARAM_VALUE" or message.param_index >= message.param_count:
                return False
            if count != message.param_count:
                count = message.param_count
                lacking.update(range(count))
            lacking.discard(message.param_index)
            return True

        self._say(mavlink.MAVLink_param_request_list_message(1, 1))
        until = asyncio.get_running_loop().time() + LIST_S
        while (not count or lacking) and asyncio.get_running_loop().time() < until:
            silent = not await self._until(came, SILENCE_S)
            if (silent and count) or (batch and not batch & lacking):
                batch = set(sorted(lacking)[:BATCH])
                asked += len(batch)
                for index in batch:
                    self._say(mavlink.MAVLink_param_request_read_message(1, 1, b"", index))
            elif silent:
                self._say(mavlink.MAVLink_param_request_list_message(1, 1))
        return count - len(lacking), count, asked

    async def reads_file(self) -> tuple[int, int]:
        """Returns how many parameters the file has, and how many it claims. Raises NotAnswered."""
        blocks: dict[int, bytes] = {}
        ended = False

        def answer(message: Any, *wanted: int) -> tuple[int, int, int, bytes] | None:
            if message.get_type() != "FILE_TRANSFER_PROTOCOL" or message.target_system != 255:
                return None
            payload = bytes(message.payload).ljust(_PAYLOAD, b"\0")
            _, _, op, size, request, _, offset = _HEAD.unpack_from(payload)
            return (op, request, offset, payload[_HEAD.size : _HEAD.size + size]) if request in wanted else None

        def block(message: Any) -> bool:
            nonlocal ended
            one = answer(message, READ, BURST)
            if one is None:
                return False
            op, request, offset, data = one
            if op == ACK:
                blocks[offset] = data
            ended |= request == BURST and (op != ACK or len(data) < _BLOCK)
            return request == READ or ended

        await self._asked("file", self._file(TERMINATE), lambda m: answer(m, TERMINATE) is not None)
        await self._asked("file", self._file(OPEN, data=FILE), lambda m: (answer(m, OPEN) or (0,))[0] == ACK)
        at = 0
        for _ in range(TRIES):
            self._say(self._file(BURST, size=_BLOCK, offset=at))
            if await self._until(lambda m: block(m) and ended, 3.0):
                break
            at = max((offset + len(data) for offset, data in blocks.items()), default=0)
        end = max((offset + len(data) for offset, data in blocks.items()), default=0)
        while len(blocks.get(end - _BLOCK, b"")) == _BLOCK:  # the end was told, and the last blocks may have been lost
            await self._asked("end", self._file(READ, size=_BLOCK, offset=end), block)
            if end not in blocks:
                break
            end += len(blocks[end])
        for offset in range(0, end, _BLOCK):
            for _ in range(TRIES if offset not in blocks else 0):
                ask = self._file(READ, size=_BLOCK, offset=offset)
                await self._asked("hole", ask, block)
                if offset in blocks:
                    break
        await self._asked("file", self._file(TERMINATE), lambda m: answer(m, TERMINATE) is not None)
        return _entries(b"".join(blocks[offset] for offset in sorted(blocks)))

    def _file(self, op: int, *, size: int = 0, offset: int = 0, data: bytes = b"") -> Any:
        self._files += 1
        payload = _HEAD.pack(self._files & 0xFFFF, 0, op, len(data) or size, 0, 0, offset) + data
        return mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload.ljust(_PAYLOAD, b"\0"))


def _entries(data: bytes) -> tuple[int, int]:
    """Counts the entries of a parameter file, with defaults or without, and reads the count that it claims.

    Source: ArduPilot, AP_Filesystem_Param. Raises NotAnswered for a truncated or broken file.
    """
    magic, count, total = _FILE_HEAD.unpack_from(data.ljust(_FILE_HEAD.size, b"\0"))
    if magic not in (0x671B, 0x671C) or count != total:
        raise NotAnswered("a whole file of parameters")
    names: set[bytes] = set()
    name, at = b"", _FILE_HEAD.size
    while at < len(data):
        if data[at] == 0:
            at += 1
            continue
        size = _SIZES.get(data[at] & 0x0F)
        if size is None or at + 1 >= len(data):
            raise NotAnswered(f"a file of parameters that is not broken at byte {at}")
        end = at + 2 + (data[at + 1] >> 4) + 1
        name = name[: data[at + 1] & 0x0F] + data[at + 2 : end]
        names.add(name)
        at = end + size * (2 if data[at] >> 4 & 1 else 1)
    if at > len(data):
        raise NotAnswered("the end of the file of parameters")
    return len(names), total


def _is_from(component: int, name: str, message: Any) -> bool:
    return bool(message.get_type() == name and message.get_srcComponent() == component)


def _is_count(kind: int, message: Any) -> bool:
    return bool(message.get_type() == "MISSION_COUNT" and message.mission_type == kind)
