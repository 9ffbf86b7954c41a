"""Watches the pilot: whether sticks are fresh, the tower is present, and the tower has taken part in this flight.

No I/O. Combines `StickWatch`, `StickAge`, `LinkLoss` and `TowerUse`, and reports when to hold and why.
"""

from typing import NamedTuple

from onboard_agent.failsafe.link_loss import LinkLoss
from onboard_agent.failsafe.tower_use import TowerUse
from onboard_agent.sticks.stick_age import StickAge
from onboard_agent.sticks.stick_watch import StickWatch
from wire.control_messages import HoldCause, SafetySettings


class Alarm(NamedTuple):
    """A reason for a hold that nobody ordered."""

    cause: HoldCause
    why: str


class PilotWatch:
    """Report passing frames and link failures to it; call `alarm` at each tick."""

    def __init__(self, now: float) -> None:
        self.loss = LinkLoss(now)
        self.stick_age = StickAge()
        self._sticks = StickWatch()
        self._use = TowerUse()

    @property
    def tower_in_this_flight(self) -> bool:
        """Whether sticks or flight commands have come through the tower since the drone was armed."""
        return self._use.in_this_flight

    def heartbeat(self, *, armed: bool, now: float) -> None:
        """A HEARTBEAT of the autopilot."""
        self._use.heartbeat(armed=armed, now=now)
        if not armed:
            self._sticks.over()

    def used(self, now: float) -> None:
        """The tower, or a person through it, takes part in this flight."""
        self._use.used(now)

    def sticks_passed(self, now: float) -> None:
        """Fresh sticks of the holder went to the autopilot."""
        self._use.used(now)
        self.loss.sticks_passed(now)
        self._sticks.passed(now)

    @property
    def hand_on_sticks(self) -> bool:
        """Whether a hand was on the sticks, and nothing has ended that."""
        return self._sticks.hand_on

    def replaced_by_agent(self, now: float) -> None:
        """The agent's centred sticks replace the assistant's: nothing goes stale, and no hand was on the sticks."""
        self._sticks.passed(now)

    def sticks_due(self, now: float) -> None:
        """The mode needs sticks from now on: if none come, they count as stale."""
        self._sticks.passed(now)

    def no_pilot_needed(self) -> None:
        """The drone flies by command, or a hold has taken over: no hand needs to be on the sticks."""
        self.loss.flies_without_sticks()
        self.stick_age.over()
        self._sticks.over()

    def alarm(self, now: float, *, settings: SafetySettings, flown_by_hand: bool, kept_centred: bool) -> Alarm | None:
        """Returns each alarm about the pilot once, or None.

        `kept_centred`: the agent keeps the sticks centred for a person who only commands, outside a hold.
        """
        if self.stick_age.too_old(now, settings) and flown_by_hand and self._sticks.hand_on:
            why = f"the sticks come {self.stick_age.age_s * 1000:.0f} ms late while flying by hand"
            return Alarm(HoldCause.STICKS_STALE, why)
        if self._sticks.stale(now, stale_s=settings.sticks_stale_s, flown_by_hand=flown_by_hand):
            why = f"no fresh sticks for {settings.sticks_stale_s:g} s while flying by hand"
            return Alarm(HoldCause.STICKS_STALE, why)
        if self.loss.lost_by_hand(now, lost_hold_s=settings.lost_hold_s) and flown_by_hand:
            return Alarm(HoldCause.PILOT_LOST, "the pilot was lost while flying by hand")
        if flown_by_hand and kept_centred and self.loss.silent_s(now) >= settings.lost_hold_s:
            # The tower's sticks end when it is gone. Without the agent's, the radio's would fly, perhaps at the bottom.
            return Alarm(HoldCause.PILOT_LOST, "the tower was lost while the sticks were kept centred for it")
        return None
