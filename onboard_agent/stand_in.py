"""Centred sticks for an assistant who only commands. No I/O; takes `now`.

While an admin assists, the holder's sticks are refused for as long as it is the admin's turn. If the admin sends no
sticks of their own, nobody's would come: the autopilot would fly on with the holder's last ones, and then the sticks
would be stale. So while it is the assistant's turn and their hands are off, the sticks are kept centred.

Laws, each with a test:
- Only where a hand was on the sticks, and only in modes that hold height by themselves with centred sticks. In any
  other the sticks go stale, and the drone holds.
- The assistant's own sticks win at once.
- Not for ever: a bound, a tower that is lost, or a hold ends it. Then the sticks are stale.
"""

from typing import Final

from onboard_agent.own_frames import FrameMaker, centred_sticks, ground_station_sender

STICKS_INTERVAL_S: Final = 0.05

HANDS_OFF_SHARE: Final = 0.5
"""Of `sticks_stale_s`: sticks that have not come for so long are not merely late."""


class StandIn:
    """Tell it whose turn it is and of all sticks that pass; ask `due` at each tick."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self._assistant_flies = False
        self._sticks_at = float("-inf")
        self._since: float | None = None
        self._next_at = 0.0

    @property
    def on(self) -> bool:
        """Whether the sticks are kept centred now."""
        return self._since is not None

    def turn(self, *, assistant_flies: bool) -> None:
        """The tower says whose frames pass."""
        self._assistant_flies = assistant_flies
        if not assistant_flies:
            self._since = None

    def end(self) -> None:
        """The link is gone, or a hold has taken over: until the tower says again that an assistant flies."""
        self.turn(assistant_flies=False)

    def sticks_passed(self, now: float) -> None:
        """Somebody's own sticks went to the autopilot."""
        self._sticks_at = now
        self._since = None

    def due(
        self,
        now: float,
        *,
        wanted: bool,
        sticks_stale_s: float,
        bound_s: float,
        vehicle_system_id: int,
        ground_station_system_id: int,
    ) -> list[bytes]:
        """Frames to send to the autopilot now.

        `wanted`: a hand was on the sticks of an armed drone, in a mode that holds when they are centred.
        """
        if not self._assistant_flies or not wanted:
            self._since = None
            return []
        if self._since is None:
            if now - self._sticks_at < sticks_stale_s * HANDS_OFF_SHARE:
                return []
            self._since = self._next_at = now
        if now - self._since >= bound_s:
            self.end()
            return []
        if now < self._next_at:
            return []
        self._next_at = max(self._next_at + STICKS_INTERVAL_S, now)
        return [self._maker.make(centred_sticks(vehicle_system_id), ground_station_sender(ground_station_system_id))]
