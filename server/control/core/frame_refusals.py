"""Tells a browser what became of the frames that were refused: at once the first time, then once a second in sum.

Refusals are never silent, and a flood of them must not become a flood of answers. Takes `now`, does no I/O.
"""

from collections.abc import Callable
from typing import Final

from server.control.core.policy import CommandSeen
from server.live.live_messages import Notice
from wire.dialect import build, mavlink
from wire.drops import DropReason
from wire.frames import source
from wire.ids import DroneId

PERIOD_S: Final = 1.0

MAX_OPEN: Final = 64
"""Different refusals kept at one time. A browser that invents drone ids gets one sum for the rest."""

_TEXTS: Final[dict[DropReason, Callable[[str], str]]] = {
    DropReason.MALFORMED: lambda _: "A message from this browser was malformed. Nothing was sent.",
    DropReason.BAD_FRAME: lambda name: f"A frame for {name} was damaged and was not sent.",
    DropReason.UNKNOWN_DRONE: lambda _: "There is no such drone in your squad.",
    DropReason.NOT_IN_CONTROL: lambda name: f"You do not have the controls of {name}. Nothing was sent to it.",
    DropReason.OFFLINE: lambda name: f"{name} is offline. Nothing was sent to it, and nothing will be sent later.",
    DropReason.NOT_ALLOWED: lambda name: f"This kind of message may not be sent to {name} through the tower.",
    DropReason.OTHER_VEHICLE: lambda name: (
        f"This was addressed to another vehicle than {name}. Nothing was sent to either of them."
    ),
    DropReason.ASSISTED: lambda name: f"An admin is assisting {name}: your commands wait until they have finished.",
    DropReason.ASK_TWICE: lambda name: (
        f"This would make {name} fall. Send it again within 5 s if you really want that."
    ),
    DropReason.LOSS_CHECK: lambda name: f"Read and acknowledge what a loss would do to {name} before arming it.",
    DropReason.LOAN: lambda name: f"{name} is lent to you ",  # the limit follows
    DropReason.ZONE: lambda name: f"Nothing was sent to {name}: its way ",  # the zone follows
    DropReason.FLOOD: lambda name: (
        f"This was more than you may send{f' to {name}' if name else ''} at once. The rest of it was not sent."
    ),
    DropReason.OTHER_HANDS: lambda name: (
        f"Another window or program of yours flies {name} by hand: its sticks count, and these were not sent."
    ),
    DropReason.LATE: lambda name: f"Your link stalled. Late messages were not sent to {name}.",
}

NOT_IN_CONTROL: Final = 10
"""MAV_RESULT_NOT_IN_CONTROL of common.xml, newer than the dialect that is installed."""

_TOWER_SEQUENCE: Final = 0


def denied_command(frame: bytes, command: CommandSeen, reason: DropReason) -> bytes:
    """A COMMAND_ACK that refuses a command, as if the drone's own component had answered it."""
    foreign = reason in (DropReason.NOT_IN_CONTROL, DropReason.ASSISTED)
    asker_system, asker_component = source(frame)
    ack = mavlink.MAVLink_command_ack_message(
        command.command,
        NOT_IN_CONTROL if foreign else mavlink.MAV_RESULT_DENIED,
        target_system=asker_system,
        target_component=asker_component,
    )
    return build(
        ack,
        system_id=command.target_system or 1,
        component_id=command.target_component or mavlink.MAV_COMP_ID_AUTOPILOT1,
        sequence=_TOWER_SEQUENCE,
    )


_Key = tuple[DropReason, DroneId | None, str]


class RefusalNotices:
    """The refusals of one browser."""

    def __init__(self) -> None:
        self._open: dict[_Key, tuple[float, int, str]] = {}

    def refuse(
        self, reason: DropReason, drone_id: DroneId | None, name: str, now: float, words: str = ""
    ) -> Notice | None:
        """Counts one refusal. The notice to send now, or None if it goes into the next sum. `words` end its text."""
        key: _Key = (reason, drone_id, words)
        if key not in self._open and len(self._open) >= MAX_OPEN:
            key = (reason, None, words)
        entry = self._open.get(key)
        if entry is None:
            self._open[key] = (now + PERIOD_S, 0, name)
            return _notice(key, name, 1)
        due, count, _ = entry
        self._open[key] = (due, count + 1, name)
        return None

    def due(self, now: float) -> list[Notice]:
        """The sums whose second is over."""
        notices: list[Notice] = []
        for key, (due, count, name) in list(self._open.items()):
            if now < due:
                continue
            if count:
                notices.append(_notice(key, name, count))
                self._open[key] = (now + PERIOD_S, 0, name)
            else:
                del self._open[key]
        return notices


def _notice(key: _Key, name: str, count: int) -> Notice:
    reason, drone_id, words = key
    severity: Final = "error" if reason in (DropReason.OFFLINE, DropReason.NOT_IN_CONTROL) else "warning"
    return Notice(
        severity=severity, code=reason.value, text=_TEXTS[reason](name) + words, drone_id=drone_id, count=count
    )
