"""One signed-in browser as the hub sees it: who it is, what waits to be sent to it, how to wake and close it."""

from collections.abc import Callable, Sequence
from typing import Final

from server.control.core.frame_refusals import RefusalNotices
from server.control.core.policy import RepeatConfirmation
from server.kernel.people import Principal
from server.link.core.event_queue import EventQueue
from server.link.core.flood_gate import PATIENCE, PATIENCE_PER_S, REQUESTS_BURST, REQUESTS_PER_S
from server.link.core.outbox import Outbox
from server.link.core.rtt_meter import RttMeter
from server.link.core.token_bucket import TokenBucket
from server.link.core.viewport import Viewport
from server.live.live_messages import Lost, Notice, ToBrowser
from wire.drops import DropReason
from wire.ids import DroneId
from wire.lateness import Lateness
from wire.state_messages import StateKey

TOO_SLOW: Final = 4408


class Browser:
    """Owned by the hub while attached; the live channel empties it. `wake` is called when something is due at once."""

    is_visitor = False
    """Whether it is connected to another tower (`live/towers/visitors.py`)."""

    def __init__(
        self,
        number: int,
        viewer: Principal,
        now: float,
        *,
        wake: Callable[[], None],
        close: Callable[[int, str], None],
        address: str = "",
    ) -> None:
        self.number = number
        self.viewer = viewer
        self.outbox = Outbox(now)
        self.viewport: Viewport | None = None
        """The part of the map that it shows."""
        self.refusals = RefusalNotices()
        self.repeat_confirmation = RepeatConfirmation()
        self.lateness = Lateness()
        """How late its messages come."""
        self.trip = RttMeter()
        """How long the way to it and back is."""
        self.address = address
        self.close = close
        self.ended = False
        """It is being closed for what it did: nothing that it still sends counts."""
        self.requests = TokenBucket(REQUESTS_PER_S, REQUESTS_BURST, now)
        """For its text messages."""
        self.patience = TokenBucket(PATIENCE_PER_S, PATIENCE, now)
        """For what it sends beyond what it may."""
        self._wake = wake
        self._events = EventQueue()

    def woken_by(self, wake: Callable[[], None]) -> None:
        """From here on `wake` is called when something is due at once."""
        self._wake = wake

    def notify(self, event: ToBrowser) -> None:
        """Puts a text message in the queue."""
        if self._events.put(event):
            self._wake()
        else:
            self.close(TOO_SLOW, "this browser does not read its messages")

    def end(self, code: int, why: str) -> None:
        """Closes it for what it did."""
        self.ended = True
        self.close(code, why)

    def waiting(self) -> tuple[int, int, int]:
        """(text messages, transactional frames, state frames) that wait at this moment."""
        return len(self._events), *self.outbox.waiting()

    def offer(self, drone_id: DroneId, state: Sequence[tuple[StateKey, bytes]], transactional: Sequence[bytes]) -> None:
        """Puts tagged frames of one drone in the outbox."""
        if self.outbox.offer_all(drone_id, state, transactional):
            self._wake()

    def offer_at_once(
        self, drone_id: DroneId, state: Sequence[tuple[StateKey, bytes]], transactional: Sequence[bytes]
    ) -> None:
        """The same, due at once: another tower has conflated them already."""
        self.outbox.offer_at_once(drone_id, state, transactional)
        self._wake()

    def refuse(self, reason: DropReason, drone_id: DroneId | None, name: str, now: float, words: str) -> None:
        """Tells that a frame from here was refused, now or in the next sum."""
        notice: Notice | None = self.refusals.refuse(reason, drone_id, name, now, words)
        if notice is not None:
            self.notify(notice)

    def take_events(self) -> list[ToBrowser]:
        """The text messages that wait, in order, with what was lost at the end."""
        events = self._events.take()
        events.extend(Lost(drone_id, count) for drone_id, count in self.outbox.take_lost().items())
        return events
