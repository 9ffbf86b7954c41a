"""Whether a drone that was reported disarmed really is, when a hold is ordered. No I/O; takes `now`.

Heartbeats arrive once a second, so the last one may be older than an arming. Only one that is younger than the order is
a proof, and the agent requests it; an arming may also have been on its way when the order arrived.
"""

from typing import Final

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, request_message
from wire.dialect import mavlink

WATCH_S: Final = 5.0
"""An arming that was on its way when the hold was ordered has shown up by then."""
PROOF_WITHIN_S: Final = 1.5
"""By then an autopilot with one heartbeat a second has reported whether it is armed."""
ASK_BEAT_S: Final = 0.05


class DisarmProof:
    """`begin` with the order; ask `due` at each tick."""

    def __init__(self, maker: FrameMaker) -> None:
        self.proved = False
        """A heartbeat younger than the order reported it disarmed."""
        self._maker = maker
        self._began_at = 0.0
        self._next_at = 0.0

    def begin(self, now: float) -> None:
        """A hold was ordered."""
        self.proved = False
        self._began_at = self._next_at = now

    def over(self, now: float) -> bool:
        """Whether the order has been open for long enough."""
        return now - self._began_at >= WATCH_S

    def failed(self, now: float) -> bool:
        """Whether nothing came that proves it: the drone may well be in the air."""
        return not self.proved and now - self._began_at >= PROOF_WITHIN_S

    def due(self, now: float, *, vehicle_system_id: int) -> list[bytes]:
        """Frames to send now."""
        if now < self._next_at:
            return []
        self._next_at = now + ASK_BEAT_S
        ask = request_message(vehicle_system_id, mavlink.MAVLINK_MSG_ID_HEARTBEAT, confirmation=0)
        return [self._maker.make(ask, agent_sender(vehicle_system_id))]
