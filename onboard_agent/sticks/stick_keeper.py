"""Centred sticks for a person whose sticks stop, if the autopilot needs them. No I/O; takes `now`.

An assistant who only commands has no sticks, and the holder's are refused during the assistant's turn: none would
arrive, and the autopilot would fly on with the last ones. And without a receiver the end of any sticks is a radio
failsafe after a second, even in a return or a mission.

Rules, each tested:

- Never begun if none were in force: a drone that flies without sticks is not made to need them.
- For an assistant: only after flight by hand, and only in modes that hold height with centred sticks. In any other mode
  the sticks go stale, and the drone holds.
- For the autopilot: in modes without sticks that it would leave when they end (`after_sticks`).
- A person's own sticks win at once.
- No gap is longer than KEEP_AFTER_S and a tick.
"""

from typing import Final

from onboard_agent.autopilot.own_frames import FrameMaker, centred_sticks, ground_station_sender

STICKS_INTERVAL_S: Final = 0.05

KEEP_AFTER_S: Final = 0.2
"""Sticks missing for this long are not merely late; a radio failsafe waits for 1 s."""


class StickKeeper:
    """Tell it whose turn it is and of all sticks that pass; ask `due` at each tick."""

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
        """Whether they are in place of an assistant's."""
        return self._keeps and self._for_assistant

    def turn(self, *, assistant_flies: bool) -> None:
        """The tower reports whose frames pass."""
        self._assistant_flies = assistant_flies

    def end_turn(self) -> None:
        """The link is gone, or a hold has taken over: ends until the tower reports again that an assistant flies."""
        self.turn(assistant_flies=False)
        self._persons_at = float("-inf")

    def sticks_passed(self, now: float) -> None:
        """Somebody's own sticks went to the autopilot."""
        self._persons_at = now
        self.others_sent(now)

    def others_sent(self, now: float) -> None:
        """So did those of another part of the agent: a hold's, or for arming."""
        self._sticks_at = now
        self._keeps = False

    def person_fresh(self, now: float) -> bool:
        """Whether a person's sticks have come just now."""
        return now - self._persons_at < KEEP_AFTER_S

    def in_force(self, now: float, *, lasts_s: float) -> bool:
        """Whether the autopilot still goes by sticks that it got. `lasts_s`: how long it does."""
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
        `for_autopilot`: armed, in a mode that uses none, and it would leave that mode when they end.
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
