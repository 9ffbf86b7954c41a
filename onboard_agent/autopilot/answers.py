"""Whether the autopilot hears the agent. No I/O; takes `now`.

A line may carry one direction only, and an autopilot with signing answers nobody without the key: heartbeats and
telemetry look as ever, every command times out, and a hold cannot work. So the agent asks for the time (TIMESYNC) where
nothing else has been answered. Both ArduPilot and PX4 answer that.
"""

from collections import deque
from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, timesync_request
from wire.autopilots import registry
from wire.dialect import mavlink

ASK_EVERY_S: Final = 3.0
DEAF_AFTER_S: Final = 10.0
"""Three questions."""
_REMEMBERED: Final = 8
"""Questions: an answer that takes longer than these is none."""

TIMESYNC: Final = mavlink.MAVLINK_MSG_ID_TIMESYNC


def may_answer(autopilot_kind: int) -> bool:
    """Whether an autopilot of this kind answers such a question."""
    family = registry.FAMILIES.get(autopilot_kind)
    return family is not None and family.answers_timesync


class Answers:
    """Report every answer to the agent, and send what `due` returns."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self._since: float | None = None
        """Since when the autopilot is heard, without an answer on an earlier line."""
        self._answered_at: float | None = None
        self._asked_at = float("-inf")
        self._asked: deque[int] = deque(maxlen=_REMEMBERED)

    def came(self, now: float) -> None:
        """The autopilot is heard, for the first time or again."""
        self._since, self._answered_at = now, None
        self._asked.clear()

    def answered(self, now: float) -> None:
        """It answered a question of the agent."""
        self._answered_at = now
        self._asked.clear()

    def timesync(self, message: Any, now: float) -> bool:
        """Returns whether a TIMESYNC answers the agent."""
        if not message.tc1 or message.ts1 not in self._asked:
            return False
        self.answered(now)
        return True

    def hears(self, now: float) -> bool | None:
        """Whether it hears the agent; None: not known yet, or nobody knows what it would answer."""
        if self._since is None:
            return None
        silent_s = now - (self._since if self._answered_at is None else self._answered_at)
        if silent_s >= DEAF_AFTER_S:
            return False
        return None if self._answered_at is None else True

    def due(self, now: float, *, autopilot_kind: int, vehicle_system_id: int) -> list[bytes]:
        """Returns the question to send now, if any."""
        if not may_answer(autopilot_kind):
            self._since = None
            return []
        last = self._asked_at if self._answered_at is None else max(self._asked_at, self._answered_at)
        if self._since is None or now - last < ASK_EVERY_S:
            return []
        self._asked_at = now
        stamp = int(now * 1e9)
        self._asked.append(stamp)
        return [self._maker.make(timesync_request(stamp), agent_sender(vehicle_system_id))]
