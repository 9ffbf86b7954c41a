"""Whether the autopilot follows the holder's latest command to fly without sticks. No I/O; takes `now`.

A command is only a request until the autopilot shows the new mode. An autopilot without a position refuses to brake, to
return or to go to a place, and flies on with its present sticks. Releasing them on the command alone would leave the
drone with its last deflection, and some seconds later with the radio's values, perhaps with the throttle at the bottom.

Rules, each tested:
- Granted when a heartbeat after the command shows a mode that needs no sticks and is not the mode it was given in.
- Refused when COMMAND_ACK refuses it, or when no such mode is shown within PATIENCE_S of the first pending command.
- The agent requests the heartbeat, because PX4 sends only one a second.
"""

from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, request_message
from wire.dialect import mavlink

PATIENCE_S: Final = 1.5
"""Longer than the interval of an autopilot that sends one heartbeat a second."""

SHOW_AFTER_S: Final = 0.1
"""A granted mode is shown after a few milliseconds."""

SHOW_RETRY_S: Final = 0.25

_GOOD: Final = frozenset({mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_IN_PROGRESS})


class CommandRequest:
    """Call `ask` for each such command. Then one of `granted`, `refused`, `accepted`, `lapsed` is True once."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self._commands: set[int] = set()
        self._from_mode: int | None = None
        self._until: float | None = None
        self._next_show_at = 0.0

    @property
    def open(self) -> bool:
        """Whether a command is pending: the autopilot has neither followed nor refused it."""
        return self._until is not None

    def ask(self, command: int | None, now: float, *, from_mode: int | None = None) -> None:
        """The holder sends a command. `command`: MAV_CMD, or None for a message that is never acknowledged.

        `from_mode`: custom_mode of a hold that needs no sticks either, so that the same mode again grants nothing.
        """
        if self._until is None:  # repeats do not extend the deadline
            self._until = now + PATIENCE_S
            self._next_show_at = now + SHOW_AFTER_S
        self._from_mode = from_mode
        if command is not None:
            self._commands.add(command)

    def over(self) -> None:
        """Drops the request."""
        self._until = None
        self._commands.clear()

    def granted(self, *, needs_sticks: bool, custom_mode: int) -> bool:
        """Whether this heartbeat shows that the request is granted."""
        if self._until is None or needs_sticks or custom_mode == self._from_mode:
            return False
        self.over()
        return True

    def refused(self, ack: Any) -> bool:
        """Whether this COMMAND_ACK, which may answer the holder, refuses the request."""
        if self._until is None or ack.command not in self._commands or ack.result in _GOOD:
            return False
        self.over()
        return True

    def accepted(self, ack: Any) -> bool:
        """Whether this COMMAND_ACK, which may answer the holder, grants the request in the current mode."""
        if self._until is None or self._from_mode is None or ack.command not in self._commands:
            return False
        if ack.result not in _GOOD or ack.command == mavlink.MAV_CMD_DO_SET_MODE:
            return False
        self.over()
        return True

    def lapsed(self, now: float) -> bool:
        """Whether the deadline of the request has passed."""
        if self._until is None or now < self._until:
            return False
        self.over()
        return True

    def due(self, now: float, *, vehicle_system_id: int) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if self._until is None or now < self._next_show_at:
            return []
        self._next_show_at = now + SHOW_RETRY_S
        message = request_message(vehicle_system_id, mavlink.MAVLINK_MSG_ID_HEARTBEAT, confirmation=0)
        return [self._maker.make(message, agent_sender(vehicle_system_id))]
