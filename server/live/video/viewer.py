"""Viewers of a drone's video as the service sees them: who each is, which stream, how to write to it. Pure.

Those of one stream who are in step (calm, and sent everything up to now) form a lockstep group: what goes to one of
them goes to all. Nearly always that is nearly everybody, and the tower looks at none of them when a picture comes: for
fifty viewers, the state of each is more than a processor's cache keeps until the next picture. The group writes down
once what was sent. It goes to the account of each (pacing.py) when it leaves: with each `got`, and before
anything else that concerns it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final

from server.domain.people import Principal
from server.live.relay.token_bucket import TokenBucket
from server.live.video.pacing import PICTURE_AGE_S, SentUnit, ViewerPace
from server.live.video.situation import VideoSituation
from server.live.video.streams import Relayed, Stream, StreamKey
from server.live.video.traffic import VideoTraffic
from server.live.video.viewer_messages import SkippedMessage, ToViewer, encode_to_viewer, state_message
from wire.ids import DroneId

MAX_MEMBERS: Final = 32
"""They are written to at one go: some tenths of a millisecond."""
_MAX_LOG: Final = 200
"""Units: with so many in it, those that everybody has on its account are dropped."""
REQUESTS_PER_S: Final = 150.0
REQUESTS_BURST: Final = 600
"""Text messages of a viewer: one for each picture drawn, and a few more."""
REPORT_SKIPPED_EVERY_S: Final = 1.0
TOO_SLOW: Final = 4408
DEAF_AFTER_S: Final = 20.0
"""A viewer that does not say for so long what it has drawn is gone, whatever its connection says."""


class VideoViewer:
    """`write`: a whole WebSocket message, as bytes; `send_text`: the payload of a text message; `has_room`: whether the
    other side reads what it is sent; `close`: ends it with a code and words; `held_up`: told when pictures wait because
    those before them are overdue (server.live.video.pacing)."""

    weight: Final = 1

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
        self.number = number
        self.viewer = principal
        self.drone_id = drone_id
        self.key = key
        self.address = address
        self.pace = ViewerPace()
        self.stream: Stream | None = None
        """That it watches, as the pace has it."""
        self.lockstep: LockstepGroup | None = None
        """The one that it is in."""
        self.requests = TokenBucket(REQUESTS_PER_S, REQUESTS_BURST, now)
        self.is_due = False
        """The service is about to pump it."""
        self.ended = False
        self.write = write
        self._send_text = send_text
        self._has_room = has_room
        self._close = close
        self._held_up = held_up
        self._pending_state: VideoSituation | None = None
        self._skipped_reported = 0
        self._skipped_reported_at = float("-inf")

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
        """Nothing waits for it, and nothing has to be asked before it is sent what comes next."""
        return not self.ended and self._pending_state is None and self.pace.is_in_step(now) and self._has_room()

    def situation(self, situation: VideoSituation) -> None:
        """Tells it; the newest only, if it does not read."""
        if self._has_room():
            self._pending_state = None
            self.notify(state_message(situation, self.key))
        else:
            self._pending_state = situation

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
    """`left`: told of each member that it puts out itself, before that one is pumped."""

    weight: Final = MAX_MEMBERS

    def __init__(self, stream: Stream, left: Callable[[VideoViewer], None]) -> None:
        self.is_due = False
        """The service is about to pump it."""
        self._stream = stream
        self._left = left
        self._members: dict[VideoViewer, int] = {}
        """And how many units had been sent when they joined."""
        self._writes: tuple[Callable[[bytes], None], ...] = ()
        self._unsent: list[Relayed] = []
        self._log: deque[SentUnit] = deque()
        self._logged = 0
        """Units that were sent, those included that are no longer in the log."""
        self._trusted_until = float("inf")
        """At least so long, all of them."""

    def __len__(self) -> int:
        return len(self._members)

    def has_place(self) -> bool:
        """For one who has been sent all that has come."""
        return len(self._members) < MAX_MEMBERS and not self._unsent

    def join(self, viewer: VideoViewer) -> None:
        """Whoever is in step (ViewerPace.is_in_step), where there `has_place`."""
        if not self._members:
            self._log.clear()
            self._trusted_until = float("inf")
        self._members[viewer] = self._logged
        self._trusted_until = min(self._trusted_until, viewer.pace.trusted_until)
        self._writes = tuple(member.write for member in self._members)

    def leave(self, viewer: VideoViewer) -> None:
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
        """Writes what is due to all. Puts out who is not to be trusted any more, and everybody where it comes late."""
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
