"""Text messages that wait for one browser, in order. Those that say how something is are conflated; no I/O.

A newer `drone` takes the place of one of the same drone that still waits, and so does `links`: a browser that is slow
for a while has at most one for each drone. What happened (control, hold, notice, ...) waits in full, up to MOST_EVENTS.
"""

from collections.abc import Hashable
from typing import Final

from server.relay.live_messages import DroneChanged, DroneRemoved, Links, ToBrowser

MOST_EVENTS: Final = 2000
"""Of those that cannot be conflated. A browser that lets so many pile up has long stopped reading."""


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
        if isinstance(event, DroneChanged):
            self._put_newest(("drone", event.drone.id), event)
        elif isinstance(event, Links):
            self._put_newest("links", event)
        else:
            if isinstance(event, DroneRemoved):
                # What was said of it before is over; what may be said after comes after.
                self._conflated -= self._waiting.pop(("drone", event.drone_id), None) is not None
            if len(self._waiting) - self._conflated >= MOST_EVENTS:
                return False
            self._serial += 1
            self._waiting[self._serial] = event
        return True

    def _put_newest(self, key: Hashable, event: ToBrowser) -> None:
        self._conflated += key not in self._waiting
        self._waiting[key] = event

    def take(self) -> list[ToBrowser]:
        """All that wait, in order."""
        if not self._waiting:
            return []
        taken = list(self._waiting.values())
        self._waiting.clear()
        self._conflated = 0
        return taken
