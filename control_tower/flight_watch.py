"""Decides whether a program still flies a drone. Pure: events and `now` in, at most one loss out.

A program that goes on after a TAKE or a hold would fly against the person who ordered it. So the first sign ends the
flight, and the program has to begin again on purpose.
"""

from __future__ import annotations

from typing import Final

from control_tower.events import ControlChanged, DroneChanged, DroneRemoved, Event, HoldStep
from control_tower.values import DroneState, Loss, LossCause

TOWER_WAITS_S: Final = 2.0
"""The tower counts a holder as lost after this long, and the drone holds (docs/control.md)."""
NO_HOLD: Final = frozenset({"not_needed"})
"""Steps that say that the drone does not hold."""


class FlightWatch:
    """One flight, from the `epoch` with which the user got the controls. `offline_s`: how long the drone may be
    offline."""

    def __init__(self, drone_id: int, user_id: int, epoch: int, *, offline_s: float) -> None:
        self._drone_id = drone_id
        self._user_id = user_id
        self._epoch = epoch
        self._offline_s = offline_s
        self._tower_lost_at: float | None = None
        self._offline_at: float | None = None
        self._expects_hold = False
        self._hold_was_open = False
        self._elsewhere: Loss | None = None
        """Somebody else has the controls; the event that says who did that and why follows at once."""

    def expect_hold(self) -> None:
        """Call if the drone holds when the flight begins, or if a TAKE began it: that hold ends no flight, and the
        program's first command ends the hold."""
        self._expects_hold = True

    def event(self, event: Event, now: float) -> Loss | None:
        """Takes an event of the tower about any drone."""
        if event.drone_id != self._drone_id:
            return None
        match event:
            case DroneRemoved():
                return Loss(LossCause.TAKEN, "the drone is not in your squad any more")
            case ControlChanged() if event.epoch >= self._epoch:
                return self._control(event)
            case HoldStep() if event.epoch >= self._epoch:
                if event.step in NO_HOLD or self._expects_hold:
                    self._expects_hold = self._expects_hold and event.step not in NO_HOLD
                    return None
                return Loss(LossCause.HELD, f"the drone was made to hold: {event.detail or event.step}", True)
            case DroneChanged(state=state) if state.epoch >= self._epoch:
                self._offline_at = None if state.online else (self._offline_at or now)
                if state.holder is None or state.holder.id != self._user_id:
                    whose = "nobody has" if state.holder is None else f"{state.holder.name} has"
                    self._elsewhere = Loss(LossCause.TAKEN, f"{whose} the controls of {state.name}")
                    return None
                return self._hold(state)
        return None

    def check(self, now: float, *, tower_there: bool) -> Loss | None:
        """Call several times a second. `tower_there`: the channel that proves the program's presence is open."""
        if self._elsewhere is not None:
            return self._elsewhere
        self._tower_lost_at = None if tower_there else (now if self._tower_lost_at is None else self._tower_lost_at)
        if self._tower_lost_at is not None and now - self._tower_lost_at >= TOWER_WAITS_S:
            return Loss(LossCause.TOWER_LOST, "the tower is out of reach: the drone holds, then does its lost action")
        if self._offline_at is not None and now - self._offline_at >= self._offline_s:
            return Loss(LossCause.DRONE_LOST, f"the drone has been offline for {self._offline_s:g} s", True)
        return None

    def _hold(self, state: DroneState) -> Loss | None:
        """A hold whose steps were missed, and the end of an expected one."""
        if state.hold_open and not self._expects_hold:
            return Loss(LossCause.HELD, f"{state.name} holds: {state.hold_words}", True)
        if self._hold_was_open and not state.hold_open:
            self._expects_hold = False
        self._hold_was_open = state.hold_open
        return None

    def _control(self, event: ControlChanged) -> Loss | None:
        if event.holder is not None and event.holder.id == self._user_id:
            return None
        by = event.by.name if event.by else "the tower"
        why = f": {event.reason}" if event.reason else ""
        return Loss(LossCause.TAKEN, f"the controls were {event.change} by {by}{why}")
