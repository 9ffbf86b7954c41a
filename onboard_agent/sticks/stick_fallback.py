"""Sends centred sticks when a person's sticks stop and the autopilot would react. No I/O; takes `now`.

An assistant only commands and has no sticks, and the holder's are refused during the assistant's turn: no sticks would
arrive, and the autopilot would fly on with the last ones. Without a receiver, the end of any sticks is a radio failsafe
after a second, in a return or a mission as well.

Rules, each tested:
- Never starts if no sticks were in force, so that a drone that flies without sticks does not come to need them.
- For an assistant: only if a hand was on the sticks, and only in modes that hold height with centred sticks. In other
  modes the sticks go stale, and the drone holds.
- For the autopilot: in modes that use no sticks, if it would leave the mode when sticks end (`after_sticks`).
- A person's own sticks take over at once.
- No gap is longer than KEEP_AFTER_S plus a tick.
"""

from typing import Final

from onboard_agent.autopilot.own_frames import FrameMaker, centred_sticks, ground_station_sender

STICKS_INTERVAL_S: Final = 0.05

KEEP_AFTER_S: Final = 0.2
"""Sticks that are missing for this long are not merely late; a radio failsafe starts after 1 s."""


class StickFallback:
    """Report turns and all sticks that pass to it; call `due` at each tick."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self._assistant_flies = False
        self._sticks_at = self._persons_at = float("-inf")
        self._next_at = 0.0
        self._keeps = False
        self._for_assistant = False

    @property
    def on(self) -> bool:
        """Whether the sticks are kept centred now."""
        return self._keeps

    @property
    def for_assistant(self) -> bool:
        """Whether the agent's sticks replace an assistant's."""
        return self._keeps and self._for_assistant

    def turn(self, *, assistant_flies: bool) -> None:
        """The tower reports whose frames pass."""
        self._assistant_flies = assistant_flies

    def end_turn(self) -> None:
        """The link is gone, or a hold has taken over. Lasts until the tower reports again that an assistant flies."""
        self.turn(assistant_flies=False)
        self._persons_at = float("-inf")

    def sticks_passed(self, now: float) -> None:
        """A person's own sticks went to the autopilot."""
        self._persons_at = now
        self.others_sent(now)

    def others_sent(self, now: float) -> None:
        """Another part of the agent has sent sticks: a hold's, or those for arming."""
        self._sticks_at = now
        self._keeps = False

    def person_fresh(self, now: float) -> bool:
        """Whether a person's sticks have just arrived."""
        return now - self._persons_at < KEEP_AFTER_S

    def in_force(self, now: float, *, lasts_s: float) -> bool:
        """Whether the autopilot still obeys sticks that it received. `lasts_s`: how long it does."""
        return now - self._sticks_at < lasts_s

    def due(
        self,
        now: float,
        *,
        for_assistant: bool,
        for_autopilot: bool,
        lasts_s: float,
        vehicle_system_id: int,
        ground_station_system_id: int,
    ) -> list[bytes]:
        """Frames to send to the autopilot now.

        `for_assistant`: a hand was on the sticks of an armed drone, in a mode that holds when they are centred.
        `for_autopilot`: armed, in a mode that uses no sticks, and the autopilot would leave that mode when they end.
        """
        self._for_assistant = self._assistant_flies and for_assistant
        wanted = self._for_assistant or for_autopilot
        if not wanted or not self.in_force(now, lasts_s=lasts_s):
            self._keeps = False
            return []
        if not self._keeps:
            if now - self._sticks_at < KEEP_AFTER_S:
                return []
            self._keeps = True
            self._next_at = now
        if now < self._next_at:
            return []
        self._next_at = max(self._next_at + STICKS_INTERVAL_S, now)
        self._sticks_at = now
        return [self._maker.make(centred_sticks(vehicle_system_id), ground_station_sender(ground_station_system_id))]
