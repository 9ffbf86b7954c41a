"""A tap at the autopilot's port: between agent and simulator, it sees every frame in both directions, with the time.

It identifies the sender of a MANUAL_CONTROL by its `buttons`, which the simulator ignores and nothing on the path may
change. It requests a separate motion log from the autopilot, which it does not pass to the agent.
"""

from __future__ import annotations

import asyncio
import math
import socket
from dataclasses import dataclass
from typing import Any

from wire.dialect import build, decode, mavlink
from wire.frames import frame_length, message_id

OPERATOR, ADMIN, AGENT = 1, 2, 0
"""Values of `buttons`; the agent's own centred sticks press none."""

_ATTITUDE, _POSITION = mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED
_SETPOINTS = (
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
    mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT,
)
_MOVES = (
    *_SETPOINTS,
    mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE,
    mavlink.MAVLINK_MSG_ID_SET_MODE,
    mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET,
)
_ASKS = frozenset({mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, mavlink.MAV_CMD_REQUEST_MESSAGE})
MOTION_US = 20_000
_MAIN_MODE_FLAG = 0x80
_FORCE = 21196


@dataclass(frozen=True, slots=True)
class Stick:
    at: float
    who: int
    x: int
    y: int
    z: int
    r: int

    @property
    def centred(self) -> bool:
        return (self.x, self.y, self.z, self.r) == (0, 0, 500, 0)


@dataclass(frozen=True, slots=True)
class Act:
    """`what`: the message or the MAV_CMD. `who`: of sticks, by their buttons; a command may be anybody's."""

    at: float
    what: str
    who: int


@dataclass(frozen=True, slots=True)
class Motion:
    at: float
    alt_m: float
    speed_mps: float
    climb_mps: float
    north_m: float
    east_m: float


@dataclass(frozen=True, slots=True)
class ModeSeen:
    at: float
    custom_mode: int
    armed: bool


class Tap:
    """Call `open`; the simulator sends to `port`, the agent listens on the given port."""

    def __init__(self, agent: tuple[str, int]) -> None:
        self._agent = agent
        self._simulator: tuple[str, int] | None = None
        self._loop = asyncio.get_running_loop()
        self.port = 0
        self.sticks: list[Stick] = []
        self.motions: list[Motion] = []
        self.tilts: list[tuple[float, float]] = []
        """(time, degrees from level)."""
        self.modes: list[ModeSeen] = []
        self.setpoints: list[float] = []
        """When each SET_POSITION_TARGET_* came from the agent."""
        self.mode_requests: list[float] = []
        self.mode_answers: list[float] = []
        self.texts: list[str] = []
        self.acts: list[Act] = []
        """Everything from the agent that could move the vehicle or change its mode."""
        self.is_cut = False
        """Passes nothing from the agent on."""
        self._inner: socket.socket | None = None
        self._outer: socket.socket | None = None
        self._ask_at = 0.0

    def open(self) -> None:
        self._inner, self._outer = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        for sock in (self._inner, self._outer):
            sock.setblocking(False)
            sock.bind(("127.0.0.1", 0))
        self.port = self._inner.getsockname()[1]
        self._loop.add_reader(self._inner, self._from_simulator)
        self._loop.add_reader(self._outer, self._from_agent)

    def close(self) -> None:
        for sock in (self._inner, self._outer):
            if sock is not None:
                self._loop.remove_reader(sock)
                sock.close()

    def _from_simulator(self) -> None:
        assert self._inner is not None and self._outer is not None
        while True:
            try:
                data, self._simulator = self._inner.recvfrom(4096)
            except BlockingIOError:
                return
            now = self._loop.time()
            rest = b"".join(frame for frame in _frames(data) if not self._keep(frame, now))
            if rest:
                self._outer.sendto(rest, self._agent)
            if not self.motions and now > self._ask_at:
                self._ask_at = now + 1.0
                self._ask_for_motion()

    def _from_agent(self) -> None:
        assert self._inner is not None and self._outer is not None
        while True:
            try:
                data = self._outer.recv(4096)
            except BlockingIOError:
                return
            now = self._loop.time()
            if self.is_cut:
                continue
            if self._simulator is not None:
                self._inner.sendto(data, self._simulator)
            for frame in _frames(data):
                self._note(frame, now)

    def _keep(self, frame: bytes, now: float) -> bool:
        """Records the autopilot's messages; True for those that only the tap requested."""
        number = message_id(frame)
        if number not in (0, 77, 253, _ATTITUDE, _POSITION):
            return False
        message = decode(frame)
        if message is None:
            return False
        if number == 0:
            self.modes.append(ModeSeen(now, message.custom_mode, bool(message.base_mode & _MAIN_MODE_FLAG)))
        elif number == 77:
            if message.command == mavlink.MAV_CMD_DO_SET_MODE:
                self.mode_answers.append(now)
            return bool(message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL and message.target_system == 200)
        elif number == 253:
            self.texts.append(str(message.text))
        elif number == _POSITION:
            speed = math.hypot(message.vx, message.vy)
            self.motions.append(Motion(now, -message.z, speed, -message.vz, message.x, message.y))
            return True
        else:
            _, x, y, _ = message.q1, message.q2, message.q3, message.q4
            self.tilts.append((now, math.degrees(math.acos(max(-1.0, 1 - 2 * (x * x + y * y))))))
            return True
        return False

    def _note(self, frame: bytes, now: float) -> None:
        number = message_id(frame)
        if number in _SETPOINTS:
            self.setpoints.append(now)
        if number in _MOVES:
            self.acts.append(Act(now, mavlink.mavlink_map[number].msgname, AGENT))
        if number not in (69, 75, 76):
            return
        message = decode(frame)
        if message is None:
            return
        if number == 69:
            self.acts.append(Act(now, "MANUAL_CONTROL", message.buttons))
        elif message.command not in _ASKS:
            self.acts.append(Act(now, mavlink.enums["MAV_CMD"][message.command].name, AGENT))
        if number == 75:
            return
        if number == 69:
            self.sticks.append(Stick(now, message.buttons, message.x, message.y, message.z, message.r))
        elif message.command == mavlink.MAV_CMD_DO_SET_MODE:
            self.mode_requests.append(now)

    def _ask_for_motion(self) -> None:
        assert self._inner is not None
        for number in (_ATTITUDE, _POSITION):
            ask: Any = mavlink.MAVLink_command_long_message(
                1, 1, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0, number, MOTION_US, 0, 0, 0, 0, 0
            )
            if self._simulator is not None:
                self._inner.sendto(build(ask, system_id=200, component_id=1, sequence=0), self._simulator)

    def disarm(self) -> None:
        """Disarms in any state, under a system id that is no ground station's."""
        assert self._inner is not None
        ask: Any = mavlink.MAVLink_command_long_message(
            1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 0, _FORCE, 0, 0, 0, 0, 0
        )
        if self._simulator is not None:
            self._inner.sendto(build(ask, system_id=200, component_id=1, sequence=0), self._simulator)

    def forget(self) -> None:
        """Begins a new round: drops the records of the last."""
        for kept in (
            self.sticks,
            self.motions,
            self.tilts,
            self.modes,
            self.setpoints,
            self.mode_requests,
            self.mode_answers,
            self.acts,
        ):
            del kept[: len(kept) - 1]


def _frames(data: bytes) -> list[bytes]:
    frames, offset = [], 0
    while offset < len(data):
        length = frame_length(data, offset)
        if not length:
            break
        frames.append(data[offset : offset + length])
        offset += length
    return frames
