"""The agent's own frames: their senders, and the builders of every message. Pure; nothing is sent here."""

from collections import Counter
from typing import Any, Final, NamedTuple

from wire.dialect import build, mavlink

AGENT_COMPONENT: Final = 191
"""MAV_COMP_ID_ONBOARD_COMPUTER."""

GROUND_STATION_COMPONENT: Final = 190
"""MAV_COMP_ID_MISSIONPLANNER, which ground stations use."""

_AUTOPILOT_COMPONENT: Final = 1
_INVALID_AXIS: Final = 32767


class Sender(NamedTuple):
    """The ids under which a frame is sent."""

    system_id: int
    component_id: int


def agent_sender(vehicle_system_id: int) -> Sender:
    """Returns the agent's own ids: a component of the vehicle."""
    return Sender(vehicle_system_id, AGENT_COMPONENT)


def ground_station_sender(ground_station_system_id: int) -> Sender:
    """Returns the ids of the ground station, for sticks and heartbeats only: no other sender may send these."""
    return Sender(ground_station_system_id, GROUND_STATION_COMPONENT)


def may_answer_agent(ack: Any, vehicle_system_id: int | None) -> bool:
    """Whether a COMMAND_ACK is addressed to the agent or has no addressee."""
    return ack.target_system in (0, vehicle_system_id) and ack.target_component in (0, AGENT_COMPONENT)


def answers_agent_alone(ack: Any, vehicle_system_id: int | None) -> bool:
    """Whether a COMMAND_ACK is addressed to the agent alone."""
    return (ack.target_system, ack.target_component) == (vehicle_system_id, AGENT_COMPONENT)


class FrameMaker:
    """Packs messages, with a sequence number for each sender."""

    def __init__(self) -> None:
        self._sequences: Counter[Sender] = Counter()

    def make(self, message: Any, sender: Sender) -> bytes:
        """Returns the message as a MAVLink 2 frame."""
        sequence = self._sequences[sender]
        self._sequences[sender] = sequence + 1 & 0xFF
        return build(message, system_id=sender.system_id, component_id=sender.component_id, sequence=sequence)


def command_long(target_system: int, command: int, *parameters: float, confirmation: int = 0) -> Any:
    """COMMAND_LONG to the autopilot; parameters that are not given are 0."""
    padded = [*parameters, *([0.0] * (7 - len(parameters)))]
    return mavlink.MAVLink_command_long_message(
        target_system, _AUTOPILOT_COMPONENT, command, confirmation & 0xFF, *padded
    )


def set_message_interval(target_system: int, message_id: int, interval_us: int, *, confirmation: int) -> Any:
    """Requests a message at an interval."""
    return command_long(
        target_system, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, interval_us, confirmation=confirmation
    )


def request_message(target_system: int, message_id: int, *, confirmation: int) -> Any:
    """Requests a message once."""
    return command_long(target_system, mavlink.MAV_CMD_REQUEST_MESSAGE, message_id, confirmation=confirmation)


def set_mode(target_system: int, parameters: tuple[float, float], *, confirmation: int) -> Any:
    """MAV_CMD_DO_SET_MODE with the custom-mode flag, without which ArduPilot denies it."""
    flag = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    return command_long(target_system, mavlink.MAV_CMD_DO_SET_MODE, flag, *parameters, confirmation=confirmation)


def centred_sticks(target_system: int) -> Any:
    """MANUAL_CONTROL with every axis in the middle. Unlike RC channels, it depends on no parameter."""
    return mavlink.MAVLink_manual_control_message(target_system, 0, 0, 500, 0, 0)


def climbing_sticks(target_system: int) -> Any:
    """MANUAL_CONTROL with the throttle at the top: a full climb in modes that hold height."""
    return mavlink.MAVLink_manual_control_message(target_system, 0, 0, 1000, 0, 0)


def released_sticks(target_system: int) -> Any:
    """MANUAL_CONTROL with every axis invalid: ArduPilot gives these channels back to its receiver at once."""
    return mavlink.MAVLink_manual_control_message(target_system, *[_INVALID_AXIS] * 4, 0)


def resting_sticks(target_system: int) -> Any:
    """MANUAL_CONTROL with the throttle at the bottom, as autopilots require for arming."""
    return mavlink.MAVLink_manual_control_message(target_system, 0, 0, 0, 0, 0)


def read_parameter(target_system: int, name: str) -> Any:
    """PARAM_REQUEST_READ by name."""
    return mavlink.MAVLink_param_request_read_message(target_system, _AUTOPILOT_COMPONENT, name.encode(), -1)


def timesync_request(ts1: int) -> Any:
    """Asks for the time; it has no addressee. `ts1`: any number, which the answer repeats."""
    return mavlink.MAVLink_timesync_message(0, ts1)


def setup_signing(target_system: int, key: bytes, initial_ticks: int) -> Any:
    """SETUP_SIGNING, which carries a key in the clear: for the line to the autopilot alone. No key takes it away."""
    return mavlink.MAVLink_setup_signing_message(
        target_system, _AUTOPILOT_COMPONENT, key.ljust(32, b"\0"), initial_ticks
    )


def agent_heartbeat() -> Any:
    """The agent's own heartbeat."""
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
    )


def ground_station_heartbeat() -> Any:
    """A ground station's heartbeat, which shows that somebody is at the controls."""
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
    )
