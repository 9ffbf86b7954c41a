"""Viewers of one stream who are in step: calm, and sent everything up to now. What goes to one of them goes to all.

Pure. Nearly always that is nearly everybody, and nothing has to be looked at of any of them when a picture comes: for
fifty viewers, what is kept of each is more than a processor's cache keeps until the next picture. What was sent is
written down once for all, and goes to the account of each (server.video.pacing) when it leaves: with each `got`, and
before anything else that concerns it.
"""

from collections import deque
from collections.abc import Callable
from typing import Final

from server.video.pacing import PICTURE_AGE_S, SentUnit
from server.video.streams import Relayed, Stream
from server.video.traffic import VideoTraffic
from server.video.viewer import VideoViewer

MAX_MEMBERS: Final = 32
"""They are written to at one go: some tenths of a millisecond."""
_LOOK_AT_LOG: Final = 200
"""Units: with so many in it, those that everybody has on its account are dropped."""


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
        oldest = min(self._members.values(), default=self._logged) if len(self._log) > _LOOK_AT_LOG else 0
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
