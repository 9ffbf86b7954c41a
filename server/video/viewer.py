"""One viewer of a drone's video as the service sees it: who it is, which stream, how to write to it. Pure."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from server.domain.people import Principal
from server.relay.token_bucket import TokenBucket
from server.video.pacing import ViewerPace
from server.video.situation import VideoSituation
from server.video.streams import Stream, StreamKey
from server.video.traffic import VideoTraffic
from server.video.viewer_messages import ToldSkipped, ToViewer, encode_to_viewer, state_message
from wire.ids import DroneId

if TYPE_CHECKING:
    from server.video.lockstep_group import LockstepGroup

REQUESTS_PER_S: Final = 150.0
REQUESTS_BURST: Final = 600
"""Text messages of a viewer: one for each picture drawn, and a few more."""
TELL_SKIPPED_EVERY_S: Final = 1.0
TOO_SLOW: Final = 4408
DEAF_AFTER_S: Final = 20.0
"""A viewer that does not say for so long what it has drawn is gone, whatever its connection says."""


class VideoViewer:
    """`write`: a whole WebSocket message, as bytes; `tell`: the payload of a text message; `has_room`: whether the
    other side reads what it is sent; `close`: ends it with a code and words; `held_up`: told when pictures wait because
    those before them are overdue (server.video.pacing)."""

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
        tell: Callable[[bytes], None],
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
        self.party: LockstepGroup | None = None
        """That it is in (server.video.lockstep_group)."""
        self.requests = TokenBucket(REQUESTS_PER_S, REQUESTS_BURST, now)
        self.is_due = False
        """The service is about to pump it."""
        self.ended = False
        self.write = write
        self._tell = tell
        self._has_room = has_room
        self._close = close
        self._held_up = held_up
        self._untold: VideoSituation | None = None
        self._skipped_told = 0
        self._skipped_told_at = float("-inf")

    def pump(self, traffic: VideoTraffic, now: float) -> None:
        """Writes what is due. Not for one who is in a party."""
        if self.ended:
            return
        has_room = self._has_room
        if self._untold is not None and has_room():
            self.situation(self._untold)
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
        return not self.ended and self._untold is None and self.pace.is_in_step(now) and self._has_room()

    def situation(self, situation: VideoSituation) -> None:
        """Tells it; the newest only, if it does not read."""
        if self._has_room():
            self._untold = None
            self.tell(state_message(situation, self.key))
        else:
            self._untold = situation

    def tell(self, message: ToViewer) -> None:
        """A text message, if it reads what it is sent."""
        if not self.ended and self._has_room():
            self._tell(encode_to_viewer(message))

    def tick(self, traffic: VideoTraffic, now: float) -> None:
        """Several times a second."""
        skipped = self.pace.skipped - self._skipped_told
        if skipped and now - self._skipped_told_at >= TELL_SKIPPED_EVERY_S and self._has_room():
            self._skipped_told, self._skipped_told_at = self.pace.skipped, now
            traffic.skipped += skipped
            self.tell(ToldSkipped(skipped))
        if self.pace.silent_for(now) > DEAF_AFTER_S:
            self.end(TOO_SLOW, "this viewer does not say what it has drawn")

    def end(self, code: int, why: str) -> None:
        """Nothing more is written to it from this instant."""
        if not self.ended:
            self.ended = True
            self._close(code, why)
