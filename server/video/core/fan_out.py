"""A unit of video from one to many: nobody waits for anybody, and frames of flight go first. Pure; takes `now`."""

from collections import deque
from collections.abc import Callable
from typing import Final

from server.video.core.drone_video import Flow
from server.video.core.streams import Relayed
from server.video.core.traffic import VideoTraffic
from server.video.core.viewer import LockstepGroup, Recipient

AT_ONCE: Final = 32
"""Viewers written to before anything else has its turn: some tenths of a millisecond."""

Later = Callable[[Callable[[float], None]], object]
"""Calls back soon, with the time that it is then."""


class FanOut:
    """One for the service."""

    def __init__(self, traffic: VideoTraffic) -> None:
        self._traffic = traffic
        self._due: deque[Recipient | LockstepGroup] = deque()
        self.later: Later = lambda call: None
        """How those beyond AT_ONCE are reached."""

    def send(self, flow: Flow, unit: Relayed, now: float) -> None:
        """To everybody who watches this stream."""
        due = self._due
        waited = bool(due)
        for lockstep in flow.lockstep_groups:
            lockstep.comes(unit)
            if not lockstep.is_due:
                lockstep.is_due = True
                due.append(lockstep)
        for viewer in flow.alone.values():
            if not viewer.is_due:
                viewer.is_due = True
                due.append(viewer)
        if not waited:
            self._pump_some(now)

    def _pump_some(self, now: float) -> None:
        due, traffic, room = self._due, self._traffic, AT_ONCE
        while due and room > 0:
            one = due.popleft()
            one.is_due = False
            room -= one.weight
            if isinstance(one, LockstepGroup) or one.lockstep is None:
                one.pump(traffic, now)
        if due:
            self.later(self._pump_some)
