"""Mutated WebSocket messages for the two channels: JSON that is wrong in every way, and tagged frames with false
contents. Each is text or bytes as on the wire; text may be invalid UTF-8."""

from __future__ import annotations

import json
import random
import struct
from collections.abc import Callable
from typing import Any, Final, NamedTuple

from bench.fuzz_bytes import Mutator
from wire.control_messages import AutopilotState, HoldProgress, HoldStep, LossParameters, encode_message
from wire.dialect import build, mavlink
from wire.ids import DroneId
from wire.tagged import MAX_UPWARD_MESSAGE_BYTES, stamp, tag

MAX_READ_BYTES: Final = 64 * 1024
"""The tower's message limit: larger ones close the connection."""

_BROWSER: Final[tuple[dict[str, Any], ...]] = (
    {"type": "watch", "rate_hz": 5},
    {"type": "focus", "drone_id": 1},
    {"type": "focus", "drone_id": None},
    {"type": "pong", "sequence": 4},
)
_AGENT: Final[tuple[dict[str, Any], ...]] = tuple(
    json.loads(encode_message(message))
    for message in (
        AutopilotState(heard=True, armed=True, airborne=True),
        HoldProgress(order_id=1, epoch=1, step=HoldStep.MODE_REQUESTED, detail="ALT_HOLD", elapsed_ms=3.5),
        LossParameters(autopilot="ardupilot", values={"FS_THR_ENABLE": 1.0, "FS_GCS_ENABLE": 0.0}, complete=True),
    )
)
_VIEWER: Final[tuple[dict[str, Any], ...]] = (
    {"type": "clock", "sent": 12.5},
    {"type": "got", "sequence": 7},
    {"type": "want", "quality": "medium", "codec": "mpeg1"},
    {"type": "want", "quality": "low", "codec": "h264"},
)
_STRANGE: Final[tuple[str, ...]] = (
    *("null", "true", "-1", "0", "1.5", "1e308", "-1e308", "1e999", "NaN", "Infinity", "4294967296", "9" * 400),
    *('""', '"\\u0000"', '"\\ud800"', '"' + "空" * 60 + '"', "[]", "{}", '[[[["x"]]]]', '{"type":"watch"}', '"5"'),
)


class TextMessage(NamedTuple):
    """UTF-8, or an imitation of it."""

    data: bytes


class BinaryMessage(NamedTuple):
    """Tagged frames, or an imitation of them."""

    data: bytes


class MessageFuzzer:
    """`drone_ids`: valid tags; the sender has the controls of the first."""

    def __init__(self, chance: random.Random, drone_ids: tuple[int, ...]) -> None:
        self._chance = chance
        self._mutator = Mutator(chance)
        self._drone_ids = drone_ids

    def browser_text(self) -> TextMessage:
        """Occasionally valid, usually wrong."""
        return TextMessage(self._text(_BROWSER))

    def agent_text(self) -> TextMessage:
        """For the agent's channel, usually valid: the tower looks at so many a second."""
        if self._chance.random() < 0.85:
            return TextMessage(self._with_strange_values(self._chance.choice(_AGENT), self._chance.random() < 0.05))
        return TextMessage(self._text(_AGENT))

    def viewer_text(self) -> TextMessage:
        """For a viewer of video, usually valid: a wrong one closes the connection."""
        if self._chance.random() < 0.7:
            return TextMessage(json.dumps(self._chance.choice(_VIEWER)).encode())
        return TextMessage(self._text(_VIEWER))

    def binary(self) -> BinaryMessage:
        """Tagged frames with one mutation: in the tags, the frames, the ends or the stamp, or none."""
        makers: tuple[Callable[[], bytes], ...] = (
            self._tagged,
            lambda: self._mutator.mutate(self._tagged()),
            lambda: self._tagged()[: self._chance.randrange(200)],
            lambda: self._mutator.noise(300),
            lambda: stamp(self._chance.getrandbits(32)) + self._tagged(),
            lambda: stamp(self._chance.getrandbits(32)) + self._mutator.mutate(self._tagged()),
        )
        if self._chance.random() < 0.005:
            return BinaryMessage(self._chance.randbytes(self._chance.randint(MAX_UPWARD_MESSAGE_BYTES, 60_000)))
        return BinaryMessage(self._chance.choice(makers)())

    def _text(self, genuine: tuple[dict[str, Any], ...]) -> bytes:
        chance = self._chance
        message = chance.choice(genuine)
        pick = chance.random()
        if pick < 0.3:
            return self._with_strange_values(message, True)
        if pick < 0.6:
            return self._mutator.mutate(json.dumps(message).encode())
        if pick < 0.7:
            return json.dumps({**message, "type": chance.choice(("", "hello", "fly", "welcome", "t" * 5000))}).encode()
        if pick < 0.78:
            opening = chance.choice(("[", '{"a":', '[{"b":'))
            return (json.dumps(message)[:-1] + ', "more": ' + opening * chance.choice((10, 500, 5000))).encode()
        if pick < 0.8:
            return b'{"type":"' + b"g" * chance.choice((1000, 60_000, MAX_READ_BYTES + 1)) + b'"}'
        if pick < 0.84:
            return chance.randbytes(chance.randint(0, 60))
        if pick < 0.9:
            return chance.choice(_STRANGE).encode()
        return json.dumps(message).encode()

    def _with_strange_values(self, message: dict[str, Any], truly: bool) -> bytes:
        """Returns the same fields, one of them with an invalid value; or unchanged except for a number."""
        parts = {key: json.dumps(value) for key, value in message.items()}
        if truly:
            parts[self._chance.choice(list(parts))] = self._chance.choice(_STRANGE)
        elif "elapsed_ms" in parts:
            parts["elapsed_ms"] = str(self._chance.random() * 1e3)
        return ("{" + ",".join(f'"{key}":{value}' for key, value in parts.items()) + "}").encode()

    def _tagged(self) -> bytes:
        return b"".join(self._tagged_frame() for _ in range(self._chance.randint(1, 4)))

    def _tagged_frame(self) -> bytes:
        drone_id = self._chance.choice((*self._drone_ids, self._chance.getrandbits(32)))
        frame = self._frame()
        if self._chance.random() < 0.3:
            frame = self._mutator.mutate(frame)
        return tag(DroneId(drone_id), frame)

    def _frame(self) -> bytes:
        chance = self._chance
        numbers = [self._float() for _ in range(7)]
        message = chance.choice(
            (
                lambda: mavlink.MAVLink_command_long_message(
                    chance.randrange(256),
                    1,
                    chance.choice((400, 22, 176, 185, 512, 0xFFFF)),
                    chance.randrange(3),
                    *numbers,
                ),
                lambda: mavlink.MAVLink_command_int_message(1, 1, 3, 192, 0, 0, *numbers[:4], 1, -1, numbers[6]),
                lambda: mavlink.MAVLink_manual_control_message(
                    1, *(chance.randint(-32768, 32767) for _ in range(4)), 0
                ),
                lambda: mavlink.MAVLink_param_set_message(1, 1, chance.randbytes(16), self._float(), 9),
                lambda: mavlink.MAVLink_ping_message(chance.getrandbits(64), 1, 1, 1),
                lambda: mavlink.MAVLink_setup_signing_message(1, 1, chance.randbytes(32), 1),
                lambda: mavlink.MAVLink_mission_count_message(1, 1, 3, 0),
            )
        )()
        return build(message, system_id=255, component_id=190, sequence=chance.randrange(256))

    def _float(self) -> float:
        strange = float(struct.unpack("<f", self._chance.randbytes(4))[0])
        return self._chance.choice((0.0, 1.0, -1.0, float("nan"), float("inf"), 21196.0, strange))
