"""Blocks mission starts while the mission on board may be incomplete. No I/O; takes `now`.

Inspects the frames from the tower's side. The sender gets the answer that the autopilot would give: COMMAND_ACK denied,
with the reason in a STATUSTEXT. A pilot's own switch, and a ground station beside the drone, do not pass through here.

Rules, each tested:
- Every known way to start the mission is refused, and nothing else.
- Each command is answered; the reason is sent once a second at most.
- A start that has passed counts as flown until a heartbeat shows it, or until one would have.
"""

from struct import Struct
from typing import Final

from onboard_agent.autopilot.flight_modes import commanded_mode
from onboard_agent.autopilot.mode_names import mission_modes
from onboard_agent.autopilot.own_frames import FrameMaker, Sender, agent_sender
from wire.autopilots.registry import FAMILIES
from wire.dialect import mavlink
from wire.frames import message_id, payload, source

_COMMAND: Final = Struct("<fffffffH")  # the same offsets in COMMAND_LONG and COMMAND_INT
_SET_MODE: Final = Struct("<IBB")  # custom_mode, target_system, base_mode

_COMMANDS: Final = frozenset({mavlink.MAVLINK_MSG_ID_COMMAND_LONG, mavlink.MAVLINK_MSG_ID_COMMAND_INT})
INSPECTED: Final = _COMMANDS | {mavlink.MAVLINK_MSG_ID_SET_MODE, mavlink.MAVLINK_MSG_ID_MISSION_SET_CURRENT}
"""Ids of the messages that can start a mission."""

STARTS: Final = frozenset(
    {
        mavlink.MAV_CMD_MISSION_START,
        mavlink.MAV_CMD_DO_SET_MISSION_CURRENT,
        mavlink.MAV_CMD_DO_JUMP_TAG,
        mavlink.MAV_CMD_DO_LAND_START,
        mavlink.MAV_CMD_DO_RETURN_PATH_START,
    }
)
"""Commands that start the mission, or continue it from some item."""

_STANDARD_MODE: Final = mavlink.MAV_CMD_DO_SET_STANDARD_MODE
_OVERRIDE: Final = mavlink.MAV_CMD_OVERRIDE_GOTO
_SWITCH: Final = mavlink.MAV_CMD_DO_AUX_FUNCTION
_ASKED_OTHERWISE: Final = frozenset(
    {mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, _STANDARD_MODE, _OVERRIDE, _SWITCH}
)
"""Commands that start the mission with some parameters, or in some modes."""

_MISSION_SWITCHES: Final = frozenset[float]().union(*(one.mission_switches for one in FAMILIES.values()))
_ARMING_SWITCHES: Final = frozenset[float]().union(*(one.arming_switches for one in FAMILIES.values()))
"""param1 of DO_AUX_FUNCTION, of any autopilot."""
_CUSTOM: Final = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
_AUTO: Final = mavlink.MAV_MODE_FLAG_AUTO_ENABLED
_OLD_MODE: Final = mavlink.MAVLINK_MSG_ID_SET_MODE
_AUTOPILOT: Final = 1
_TEXT_BYTES: Final = 50
SAY_EVERY_S: Final = 1.0
SHOWN_WITHIN_S: Final = 3.0
"""Two heartbeats of an autopilot that sends one per second, plus the transit time."""


def starts_mission(frame: bytes, *, autopilot_kind: int, vehicle_type: int, custom_mode: int) -> bool:
    """Whether a whole frame of INSPECTED would start the mission. `custom_mode`: the autopilot's current one."""
    missions = mission_modes(autopilot_kind, vehicle_type)
    msgid = message_id(frame)
    if msgid == mavlink.MAVLINK_MSG_ID_MISSION_SET_CURRENT:
        return True
    if msgid == mavlink.MAVLINK_MSG_ID_SET_MODE:
        mode, _, base_mode = _SET_MODE.unpack_from(payload(frame).ljust(_SET_MODE.size, b"\0"))
        return bool(mode in missions if base_mode & _CUSTOM else base_mode & _AUTO)
    param1, param2, param3, *_, command = _COMMAND.unpack_from(payload(frame).ljust(_COMMAND.size, b"\0"))
    if command in STARTS:
        return True
    if command == mavlink.MAV_CMD_DO_PAUSE_CONTINUE:
        return bool(param1 != 0.0)
    if command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
        return bool(param1 != 0.0) and custom_mode in missions
    if command == _SWITCH:
        return param1 in _MISSION_SWITCHES or (param1 in _ARMING_SWITCHES and custom_mode in missions)
    if command == _STANDARD_MODE:  # PX4 rounds it
        return bool(abs(param1 - mavlink.MAV_STANDARD_MODE_MISSION) <= 0.5)
    if command == _OVERRIDE:
        return bool(param1 >= mavlink.MAV_GOTO_DO_CONTINUE - 0.5)
    return command == mavlink.MAV_CMD_DO_SET_MODE and _is_mission_mode(
        param1, param2, param3, missions, autopilot_kind=autopilot_kind
    )


def may_start(frame: bytes) -> bool:
    """Whether a whole frame of INSPECTED would start the mission of any autopilot, for one that is still unknown."""
    command = _command(frame)
    if command == mavlink.MAV_CMD_DO_PAUSE_CONTINUE:
        return bool(_COMMAND.unpack_from(payload(frame).ljust(_COMMAND.size, b"\0"))[0] != 0.0)
    return command is None or command in STARTS | _ASKED_OTHERWISE


def _is_mission_mode(base: float, main: float, sub: float, missions: frozenset[int], *, autopilot_kind: int) -> bool:
    try:
        flags = int(base)
        mode = commanded_mode(autopilot_kind, main, sub)
    except (ValueError, OverflowError):  # not a number, or infinite: the autopilot will refuse it
        return False
    return mode in missions if flags & _CUSTOM else bool(flags & _AUTO)


class LatestStart:
    """The last start sent to the autopilot, for as long as its heartbeats may not show it yet."""

    def __init__(self) -> None:
        self._at = float("-inf")
        self._arms = False

    def passed(self, frame: bytes, now: float) -> None:
        """Records a start (`starts_mission`) sent now. Ignores a choice of item, which starts nothing new."""
        command = _command(frame)
        if command == mavlink.MAV_CMD_DO_SET_MISSION_CURRENT or message_id(frame) not in _COMMANDS | {_OLD_MODE}:
            return
        self._at = now
        self._arms = command not in (None, mavlink.MAV_CMD_DO_SET_MODE, _STANDARD_MODE, _OVERRIDE)

    def is_pending(self, now: float, *, mode_shown: bool, armed: bool) -> bool:
        """`mode_shown`: the latest heartbeat shows a mission mode. `armed`: it shows the drone armed."""
        if mode_shown and (armed or not self._arms):
            self._at = float("-inf")
        return now - self._at < SHOWN_WITHIN_S


def _command(frame: bytes) -> int | None:
    """Returns the MAV_CMD of a command frame, else None."""
    if message_id(frame) not in _COMMANDS:
        return None
    *_, command = _COMMAND.unpack_from(payload(frame).ljust(_COMMAND.size, b"\0"))
    return int(command)


class StartGate:
    """Refuses in the autopilot's name. `answers` go to the tower."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self._say_again_at = float("-inf")
        self._texts = 0

    def answers(self, frame: bytes, why: str, now: float, *, vehicle_system_id: int) -> list[bytes]:
        """Returns frames that inform the sender of `frame` of the refusal and its reason."""
        said: list[bytes] = []
        command = _command(frame)
        if command is not None:
            ack = mavlink.MAVLink_command_ack_message(command, mavlink.MAV_RESULT_DENIED, 0, 0, *source(frame))
            said.append(self._maker.make(ack, Sender(vehicle_system_id, _AUTOPILOT)))
        if now >= self._say_again_at:
            self._say_again_at = now + SAY_EVERY_S
            said += self.say(why, vehicle_system_id=vehicle_system_id)
        return said

    def say(self, text: str, *, vehicle_system_id: int) -> list[bytes]:
        """Makes a warning of the agent: as many STATUSTEXT chunks as needed, under one id (0 means a single chunk)."""
        raw = text.encode("ascii", "replace")
        self._texts = self._texts % 0xFFFF + 1
        chunks = [raw[at : at + _TEXT_BYTES] for at in range(0, len(raw), _TEXT_BYTES)]
        if len(chunks[-1]) == _TEXT_BYTES:
            chunks.append(b"")  # a zero byte marks the last chunk
        sender = agent_sender(vehicle_system_id)
        return [
            self._maker.make(
                mavlink.MAVLink_statustext_message(mavlink.MAV_SEVERITY_WARNING, chunk, self._texts, number), sender
            )
            for number, chunk in enumerate(chunks)
        ]
