"""Proves that a drone reported as disarmed really is, when a hold is ordered. No I/O; takes `now`.

Heartbeats arrive once a second, so the last one may precede an arming. Only a heartbeat younger than the order is
proof, and the agent requests one. An arming command may also have been on its way when the order arrived.
"""

from typing import Final

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, request_message
from wire.dialect import mavlink

WATCH_S: Final = 5.0
"""An arming that was on its way when the hold was ordered shows within this time."""
PROOF_WITHIN_S: Final = 1.5
"""An autopilot that sends one heartbeat a second reports within this time whether it is armed."""
ASK_BEAT_S: Final = 0.05


class DisarmProof:
    """Call `begin` with the order, and `due` at each tick."""

    def __init__(self, maker: FrameMaker) -> None:
        self.proved = False
        """A heartbeat younger than the order has shown that the drone is disarmed."""
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
        """Whether no proof arrived in time. The drone may be in the air."""
        return not self.proved and now - self._began_at >= PROOF_WITHIN_S

    def due(self, now: float, *, vehicle_system_id: int) -> list[bytes]:
        """Frames to send now."""
        if now < self._next_at:
            return []
        self._next_at = now + ASK_BEAT_S
        ask = request_message(vehicle_system_id, mavlink.MAVLINK_MSG_ID_HEARTBEAT, confirmation=0)
        return [self._maker.make(ask, agent_sender(vehicle_system_id))]
