"""Text messages that wait for one browser, in order. State messages are conflated. No I/O.

A newer `drone` replaces a waiting one of the same drone, and so do `links`, `operation`, `plan_on_board`, `parameters`
and `separation`: a slow browser has at most one of each drone, operation or pair waiting. Events (control, hold,
notice, ...) all wait, up to MAX_EVENTS. Operations count as events, because their number has no bound.
"""

from collections.abc import Hashable
from typing import Final

from server.live.live_messages import (
    DroneChanged,
    DroneRemoved,
    Links,
    OperationChanged,
    ParametersChanged,
    PlanOnBoardChanged,
    Separation,
    ToBrowser,
)

MAX_EVENTS: Final = 2000
"""Maximum number of waiting events. A browser with this many has long stopped reading."""


class EventQueue:
    """Put messages in; take all that wait."""

    def __init__(self) -> None:
        self._waiting: dict[Hashable, ToBrowser] = {}
        self._serial = 0
        self._conflated = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, event: ToBrowser) -> bool:
        """False if it is full: the message was not taken."""
        key = _key(event)
        if key is not None:
            if key not in self._waiting:
                if isinstance(event, OperationChanged):
                    if self._is_full:
                        return False
                else:
                    self._conflated += 1
            self._waiting[key] = event
        else:
            if isinstance(event, DroneRemoved):
                # Earlier messages about it are void; later ones follow.
                for said in [one for one in self._waiting if isinstance(one, tuple) and one[1] == event.drone_id]:
                    self._conflated -= not isinstance(self._waiting.pop(said), OperationChanged)
            if self._is_full:
                return False
            self._serial += 1
            self._waiting[self._serial] = event
        return True

    @property
    def _is_full(self) -> bool:
        return len(self._waiting) - self._conflated >= MAX_EVENTS

    def take(self) -> list[ToBrowser]:
        """All that wait, in order."""
        if not self._waiting:
            return []
        taken = list(self._waiting.values())
        self._waiting.clear()
        self._conflated = 0
        return taken


def _key(event: ToBrowser) -> Hashable | None:
    """The key by which a newer message replaces this one, with the drone if it is about one. None: every copy is
    sent."""
    match event:
        case DroneChanged():
            return "drone", event.drone.id
        case Links():
            return "links"
        case OperationChanged():
            return "operation", event.operation.drone_id, event.operation.id
        case PlanOnBoardChanged():
            return "plan_on_board", event.drone_id, event.kind
        case ParametersChanged():
            return "parameters", event.drone_id
        case Separation():
            return "separation", event.drones[0], event.number
        case _:
            return None
