"""Those who are sent a drone's video: their stream, and how to write to them. Pure.

Viewers of one stream that are in step (calm and fully served) form a lockstep group: each unit goes to all of them.
Nearly always that is nearly everybody, and the tower touches none of them per picture: for fifty viewers, their state
exceeds the processor's cache between two pictures. The group keeps one list of what was sent. It is copied to a
member's account (pacing.py) when the member leaves: with each `got`, and before anything else about it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import Final

from server.kernel.people import Principal
from server.link.core.token_bucket import TokenBucket
from server.video.core.pacing import PICTURE_AGE_S, SentUnit, ViewerPace
from server.video.core.situation import VideoSituation
from server.video.core.streams import Relayed, Stream, StreamKey
from server.video.core.traffic import VideoTraffic
from server.video.core.viewer_messages import SkippedMessage, ToViewer, encode_to_viewer, state_message
from wire.ids import DroneId

MAX_MEMBERS: Final = 32
"""They are written to at one go: some tenths of a millisecond."""
_MAX_LOG: Final = 200
"""Units: beyond this, those on every member's account are dropped."""
REQUESTS_PER_S: Final = 150.0
REQUESTS_BURST: Final = 600
"""Text messages of a viewer: one for each picture drawn, and a few more."""
REPORT_SKIPPED_EVERY_S: Final = 1.0
TOO_SLOW: Final = 4408
DEAF_AFTER_S: Final = 20.0
"""A viewer without a report for this long is gone, whatever its connection's state."""


class Recipient(ABC):
    """Whoever is sent one stream at a pace of their own: a viewer, or another tower.

    `write`: sends a whole WebSocket message, as bytes; `has_room`: whether the other side reads; `held_up`: called when
    pictures wait behind overdue ones (server.video.core.pacing).
    """

    weight: Final = 1

    def __init__(
        self,
        number: int,
        drone_id: DroneId,
        key: StreamKey,
        *,
        write: Callable[[bytes], None],
        has_room: Callable[[], bool],
        held_up: Callable[[], None] = lambda: None,
    ) -> None:
        self.number = number
        self.drone_id = drone_id
        self.key = key
        self.people = 1
        """Who see it."""
        self.pace = ViewerPace()
        self.stream: Stream | None = None
        """That it watches, as the pace has it."""
        self.lockstep: LockstepGroup | None = None
        """The one that it is in."""
        self.is_due = False
        """The service is about to pump it."""
        self.ended = False
        self.write = write
        self._has_room = has_room
        self._held_up = held_up
        self._pending_state: VideoSituation | None = None

    def pump(self, traffic: VideoTraffic, now: float) -> None:
        """Writes what is due. Not for one who is in a lockstep group."""
        if self.ended:
            return
        has_room = self._has_room
        if self._pending_state is not None and has_room():
            self.situation(self._pending_state)
        next_unit, write = self.pace.next_unit, self.write
        group = self.stream.group if self.stream is not None else ()
        while has_room():
            unit = next_unit(now)
            if unit is None:
                if self.pace.is_held_up:
                    self._held_up()
                return
            framed = unit.framed
            write(framed)
            traffic.wait.observe(now - unit.at)
            traffic.units_out += 1
            traffic.bytes_out += len(framed)
            if group and unit is group[-1]:
                return  # the newest there is: nothing can be due after it

    def is_in_step(self, now: float) -> bool:
        """Nothing waits for it, and the next unit needs no check."""
        return not self.ended and self._pending_state is None and self.pace.is_in_step(now) and self._has_room()

    def situation(self, situation: VideoSituation) -> None:
        """Tells it; the newest only, if it does not read."""
        if self._has_room():
            self._pending_state = None
            self._tell(situation)
        else:
            self._pending_state = situation

    @abstractmethod
    def _tell(self, situation: VideoSituation) -> None:
        """It reads."""


class VideoViewer(Recipient):
    """A person's window or program. `send_text`: sends a text message; `close`: ends it with code and words."""

    def __init__(
        self,
        number: int,
        principal: Principal,
        drone_id: DroneId,
        key: StreamKey,
        now: float,
        *,
        write: Callable[[bytes], None],
        send_text: Callable[[bytes], None],
        has_room: Callable[[], bool],
        close: Callable[[int, str], None],
        held_up: Callable[[], None] = lambda: None,
        address: str = "",
    ) -> None:
        super().__init__(number, drone_id, key, write=write, has_room=has_room, held_up=held_up)
        self.viewer = principal
        self.address = address
        self.requests = TokenBucket(REQUESTS_PER_S, REQUESTS_BURST, now)
        self._send_text = send_text
        self._close = close
        self._skipped_reported = 0
        self._skipped_reported_at = float("-inf")

    def _tell(self, situation: VideoSituation) -> None:
        self.notify(state_message(situation, self.key))

    def notify(self, message: ToViewer) -> None:
        """A text message, if it reads what it is sent."""
        if not self.ended and self._has_room():
            self._send_text(encode_to_viewer(message))

    def tick(self, traffic: VideoTraffic, now: float) -> None:
        """Several times a second."""
        skipped = self.pace.skipped - self._skipped_reported
        if skipped and now - self._skipped_reported_at >= REPORT_SKIPPED_EVERY_S and self._has_room():
            self._skipped_reported, self._skipped_reported_at = self.pace.skipped, now
            traffic.skipped += skipped
            self.notify(SkippedMessage(skipped))
        if self.pace.silent_for(now) > DEAF_AFTER_S:
            self.end(TOO_SLOW, "this viewer does not acknowledge pictures")

    def end(self, code: int, why: str) -> None:
        """Nothing more is written to it from this instant."""
        if not self.ended:
            self.ended = True
            self._close(code, why)


class LockstepGroup:
    """`left`: called for each member that the group removes, before that one is served again."""

    weight: Final = MAX_MEMBERS

    def __init__(self, stream: Stream, left: Callable[[Recipient], None]) -> None:
        self.is_due = False
        """The service is about to pump it."""
        self._stream = stream
        self._left = left
        self._members: dict[Recipient, int] = {}
        """And how many units had been sent when they joined."""
        self._writes: tuple[Callable[[bytes], None], ...] = ()
        self._unsent: list[Relayed] = []
        self._log: deque[SentUnit] = deque()
        self._logged = 0
        """Units that were sent, those included that are no longer in the log."""
        self._trusted_until = float("inf")
        """All of them are at least this large."""

    def __len__(self) -> int:
        return len(self._members)

    def has_place(self) -> bool:
        """For one who has been sent all that has come."""
        return len(self._members) < MAX_MEMBERS and not self._unsent

    def join(self, viewer: Recipient) -> None:
        """Whoever is in step (ViewerPace.is_in_step), where there `has_place`."""
        if not self._members:
            self._log.clear()
            self._trusted_until = float("inf")
        self._members[viewer] = self._logged
        self._trusted_until = min(self._trusted_until, viewer.pace.trusted_until)
        self._writes = tuple(member.write for member in self._members)

    def leave(self, viewer: Recipient) -> None:
        """What it was sent since it joined goes to its account."""
        since = self._members.pop(viewer)
        self._writes = tuple(member.write for member in self._members)
        count = self._logged - since
        start = len(self._log) - count
        viewer.pace.was_in_step([self._log[place] for place in range(max(0, start), len(self._log))], len(self._unsent))

    def comes(self, unit: Relayed) -> None:
        """A unit came; it goes when it is pumped."""
        self._unsent.append(unit)

    def pump(self, traffic: VideoTraffic, now: float) -> None:
        """Writes what is due to all members. Removes those no longer trusted, or everybody if it runs late."""
        if self._unsent and (now >= self._trusted_until or now - self._unsent[0].at >= PICTURE_AGE_S):
            self._put_out(traffic, now)
        writes, unsent = self._writes, self._unsent
        self._unsent = []
        for unit in unsent:
            framed = unit.framed
            # Before it is written: who cannot be written to leaves meanwhile, and has been sent it.
            self._log.append((unit.head.sequence, len(framed), now))
            self._logged += 1
            for write in writes:
                write(framed)
            traffic.wait.observe(now - unit.at, len(writes))
            traffic.units_out += len(writes)
            traffic.bytes_out += len(framed) * len(writes)
        oldest = min(self._members.values(), default=self._logged) if len(self._log) > _MAX_LOG else 0
        while len(self._log) > self._logged - oldest:
            self._log.popleft()

    def _put_out(self, traffic: VideoTraffic, now: float) -> None:
        late = now - self._unsent[0].at >= PICTURE_AGE_S
        for viewer in list(self._members):
            if late or now >= viewer.pace.trusted_until:
                self.leave(viewer)
                self._left(viewer)
                viewer.pump(traffic, now)
        self._trusted_until = min((one.pace.trusted_until for one in self._members), default=float("inf"))
