"""The true motion of a real autopilot's simulated vehicle, on a separate MAVLink port that no agent sees.

Its requests come from a system id that is no ground station's, so they do not affect a hold.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import socket
from typing import Any, Final

from bench.rig import HOME, wait_for
from bench.tap import ModeSeen, Motion
from wire.dialect import build, decode, mavlink
from wire.frames import MalformedFrame, message_id, source, split_frames

SYSTEM: Final = 200
MOTION_US: Final = 100_000
ASK_S: Final = 0.5
ARMED: Final = 0x80
POSITION_FLAGS: Final = mavlink.EKF_POS_HORIZ_ABS | mavlink.EKF_POS_VERT_ABS | mavlink.EKF_VELOCITY_HORIZ
NO_POSITION_FLAG: Final = mavlink.EKF_CONST_POS_MODE
FORCE: Final = 21196.0
_HEARTBEAT, _TEXT, _ACK = 0, 253, 77
_SIM_STATE, _EKF, _PARAMETER, _VERSION = 108, 193, 22, 148
_EARTH_M: Final = 6_378_137.0


class Truth:
    """Reads from the start on. Heights are metres above HOME; times are the loop's."""

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        self._loop = asyncio.get_running_loop()
        self._autopilot: tuple[str, int] | None = None
        self._sequence = 0
        self._asked_at = 0.0
        self.motions: list[Motion] = []
        self.state: Any = None
        """The newest SIM_STATE, which came at `state_at`."""
        self.state_at = 0.0
        self.tilts: list[tuple[float, float]] = []
        """(time, degrees from level)."""
        self.modes: list[ModeSeen] = []
        """One for each heartbeat."""
        self.texts: list[tuple[float, str]] = []
        self.answers: list[tuple[float, int, int]] = []
        """(time, command, MAV_RESULT) of commands that `command` sent."""
        self.parameters: dict[str, float] = {}
        self.firmware = 0
        """flight_sw_version of its AUTOPILOT_VERSION, once requested."""
        self.ekf_flags = 0
        self._uses_gps = False
        self._loop.add_reader(sock, self._read)

    @property
    def has_position(self) -> bool:
        """Whether the position suffices for arming: the estimator has one, based on GPS."""
        flags = self.ekf_flags
        return self._uses_gps and flags & POSITION_FLAGS == POSITION_FLAGS and not flags & NO_POSITION_FLAG

    @property
    def mode(self) -> int:
        """-1 before the first heartbeat."""
        return self.modes[-1].custom_mode if self.modes else -1

    @property
    def armed(self) -> bool:
        return bool(self.modes) and self.modes[-1].armed

    @property
    def alt_m(self) -> float:
        return self.motions[-1].alt_m if self.motions else math.nan

    def close(self) -> None:
        self._loop.remove_reader(self._sock)
        self._sock.close()

    def send(self, message: Any, *, system_id: int = SYSTEM, component_id: int = 1) -> None:
        if self._autopilot is not None:
            self._sequence += 1
            frame = build(message, system_id=system_id, component_id=component_id, sequence=self._sequence)
            self._sock.sendto(frame, self._autopilot)

    def send_frame(self, frame: bytes) -> None:
        """Sends what somebody else has made."""
        if self._autopilot is not None:
            self._sock.sendto(frame, self._autopilot)

    def command(self, number: int, *params: float) -> None:
        seven = (*params, *(0.0,) * (7 - len(params)))
        self.send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *seven))

    async def ask(self, number: int, *params: float, within_s: float = 3.0) -> int:
        """Returns the MAV_RESULT of the command. Raises TimeoutError."""
        count = len(self.answers)
        self.command(number, *params)
        await wait_for(f"the answer to {number}", lambda: any(a[1] == number for a in self.answers[count:]), within_s)
        return next(result for _, command, result in self.answers[count:] if command == number)

    async def set_parameter(self, name: str, value: float) -> None:
        """Waits until the autopilot reports this value. Raises TimeoutError."""
        asked_at = 0.0
        real = mavlink.MAV_PARAM_TYPE_REAL32

        def done() -> bool:
            nonlocal asked_at
            if self._loop.time() - asked_at > 1.0:
                asked_at = self._loop.time()
                self.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, real))
            return math.isclose(self.parameters.get(name, math.nan), value, rel_tol=1e-6)

        await wait_for(f"{name} to be {value:g}", done, 10)

    def disarm(self) -> None:
        """Disarms in any state."""
        self.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, FORCE)

    def _read(self) -> None:
        while True:
            try:
                data, self._autopilot = self._sock.recvfrom(4096)
            except (BlockingIOError, ConnectionError):
                return
            with contextlib.suppress(MalformedFrame):  # its start-up output is not MAVLink
                for frame in split_frames(data):
                    self._note(frame, self._loop.time())

    def _note(self, frame: bytes, now: float) -> None:
        number = message_id(frame)
        if number not in (_HEARTBEAT, _TEXT, _ACK, _SIM_STATE, _EKF, _PARAMETER, _VERSION) or source(frame) != (1, 1):
            return
        message = decode(frame)
        if message is None:
            return
        if number == _SIM_STATE:
            self.state, self.state_at = message, now
            self.motions.append(_motion(message, now))
            level = 1 - 2 * (message.q2**2 + message.q3**2)
            self.tilts.append((now, math.degrees(math.acos(max(-1.0, min(1.0, level))))))
        elif number == _HEARTBEAT:
            self.modes.append(ModeSeen(now, message.custom_mode, bool(message.base_mode & ARMED)))
            if not self.motions or now - self.motions[-1].at > 1.0:
                self._ask_for_motion(now)
        elif number == _VERSION:
            self.firmware = message.flight_sw_version
        elif number == _TEXT:
            self.texts.append((now, message.text))
            self._uses_gps |= "is using GPS" in message.text
        elif number == _ACK:
            self.answers.append((now, message.command, message.result))
        elif number == _EKF:
            self.ekf_flags = message.flags
        else:
            self.parameters[message.param_id] = message.param_value

    def _ask_for_motion(self, now: float) -> None:
        if now - self._asked_at > ASK_S:
            self._asked_at = now
            for number in (_SIM_STATE, _EKF):
                self.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, number, MOTION_US)


def _motion(state: Any, now: float) -> Motion:
    """SIM_STATE's own float latitude and longitude are too coarse; its integer fields are not."""
    lat = state.lat_int * 1e-7 if getattr(state, "lat_int", 0) else state.lat
    lon = state.lon_int * 1e-7 if getattr(state, "lon_int", 0) else state.lon
    north_m = math.radians(lat - HOME[0]) * _EARTH_M
    east_m = math.radians(lon - HOME[1]) * _EARTH_M * math.cos(math.radians(HOME[0]))
    return Motion(now, state.alt - HOME[2], math.hypot(state.vn, state.ve), -state.vd, north_m, east_m)
