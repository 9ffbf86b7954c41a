"""AUTO: flies the stored mission.

Navigation items are flown in order. The DO and CONDITION commands between two of them (speed, heading, camera, waiting)
run in order during the leg that follows; those still waiting when its item is reached are dropped.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from simulator.auto_items import (
    DELAY,
    JUMP,
    LAND,
    LOITER_FOREVER,
    LOITER_TIME,
    LOITER_TURNS,
    NAMES,
    NAVIGATION,
    RETURN,
    SPLINE,
    TAKE_OFF,
    WAYPOINT,
    begin_do_command,
    do_command_is_done,
)
from simulator.behaviours import Behaviour
from simulator.flight_constants import TICK_S
from simulator.flight_state import FlightState
from simulator.guided import TURN_RATE_RPS, look_ahead
from simulator.homing import ReturnToLaunch, descend
from simulator.mission_plan import Frame, Item, PlanKind
from simulator.notices import Severity
from simulator.orbit import Orbit, look_at_roi

JUMP_FOREVER = -1
STEPS_PER_TICK_MAX = 100
"""A mission of only jumps must not hang the vehicle."""

STRAIGHT = (WAYPOINT, SPLINE)
"""Flown along a straight line in space."""


@dataclass(slots=True)
class Progress:
    """Progress of the current item."""

    destination: tuple[float, float, float]
    origin: tuple[float, float, float]
    reached_since_s: float | None = None
    started_s: float = 0.0
    orbit: Orbit | None = None


class Auto(Behaviour):
    def __init__(self, flight: FlightState) -> None:
        super().__init__(flight)
        self._progress: Progress | None = None
        self._flown: int | None = None
        self._do_commands: deque[Item] = deque()
        """Commands to run during the flight to the current item; the first may already be running."""
        self._do_command_since_s: float | None = None
        self._jumps_left: dict[int, int] = {}
        self._paused = False
        self._take_off_allowed = False
        self._homing = ReturnToLaunch(flight)
        self._ended = False
        self._plan_version = 0

    @property
    def disarms_on_landing(self) -> bool:
        item = self._item()
        if self._ended or (item is not None and item.command == LAND and self._progress is not None):
            return True
        return item is not None and item.command == RETURN and self._homing.disarms_on_landing

    @property
    def waits_to_take_off(self) -> bool:
        item = self._item()
        return self._take_off_allowed and item is not None and item.command == TAKE_OFF

    def why_not(self) -> str | None:
        plans, flight = self.flight.plans, self.flight
        if not plans.has_mission:
            return "init failed"
        if flight.landed and flight.armed:
            first = next((i for i in plans.mission[plans.first :] if i.command in NAVIGATION), None)
            if first is None or first.command != TAKE_OFF:
                flight.notify(Severity.CRITICAL, "Auto: Missing Takeoff Cmd")
                return "init failed"
        return None

    def enter(self) -> None:
        plans = self.flight.plans
        restart = self.flight.parameters.whole("MIS_RESTART") == 1
        if restart or not plans.first <= plans.current < len(plans.mission):
            plans.current = plans.first
        self._progress, self._flown = None, None
        self._do_commands.clear()
        self._jumps_left, self._paused, self._ended = {}, False, False
        self._take_off_allowed = not self.flight.landed

    def start(self) -> None:
        """MAV_CMD_MISSION_START: permits take-off without a raised throttle."""
        self._take_off_allowed = True

    @property
    def paused(self) -> bool:
        return self._paused

    @property
    def ended(self) -> bool:
        """Whether the last item has been passed."""
        return self._ended

    def jump_to(self, seq: int, *, reset_jumps: bool = False) -> None:
        self.flight.plans.current = seq
        self._progress, self._ended = None, False
        if reset_jumps:
            self._jumps_left = {}

    def pause(self) -> bool:
        self._paused = True
        return True

    def resume(self) -> bool:
        self._paused = False
        return True

    def run(self) -> None:
        flight = self.flight
        if flight.landed:
            self._take_off_allowed |= flight.sticks.throttle > flight.sticks.throttle_mid
            item = self._item()
            if not self._take_off_allowed or item is None or self._ended:
                flight.rest()
                return
        for _ in range(STEPS_PER_TICK_MAX):
            if not self._advance():
                break
        self._run_do_commands()
        if self._ended or self._paused or self._progress is None:
            if flight.landed:
                flight.rest()
                return
            limits = flight.limits()
            flight.target.climb_with(0.0, limits, TICK_S)
            flight.target.fly_with(0.0, 0.0, limits, TICK_S)
            flight.fly()
            return
        self._fly_item(self._progress)

    def _item(self) -> Item | None:
        plans = self.flight.plans
        return plans.mission[plans.current] if plans.first <= plans.current < len(plans.mission) else None

    def _advance(self) -> bool:
        """Starts the current item if it has not started, or the next one if it is done; True if one was passed."""
        flight, plans = self.flight, self.flight.plans
        if self._ended:
            return False
        version = plans.changes[PlanKind.MISSION]
        if self._progress is None or self._flown != plans.current or self._plan_version != version:
            self._plan_version = version
            self._choose(plans.current)
            item = self._item()
            if self._ended or item is None:
                self._finish()
                return False
            self._begin(item)
        item = self._item()
        if item is None or not self._done(item):
            return False
        flight.on_item_reached(plans.current)
        flight.notify(Severity.INFO, f"Reached command #{plans.current}")
        self._progress = None
        plans.current = min(plans.current + 1, len(plans.mission))
        return True

    def _finish(self) -> None:
        """Ends the mission: runs the remaining commands, without waiting for any."""
        self._ended = True
        self._progress = None
        for item in self._do_commands:
            begin_do_command(self.flight, item)
        self._do_commands.clear()
        self.flight.notify(Severity.INFO, "Mission complete")

    def _choose(self, seq: int) -> None:
        """From `seq` on: collects the commands, follows jumps, and stops at the next navigation item."""
        plans = self.flight.plans
        self._do_commands.clear()
        self._do_command_since_s = None
        for _ in range(STEPS_PER_TICK_MAX):
            if not plans.first <= seq < len(plans.mission):
                break
            item = plans.mission[seq]
            if item.command in NAVIGATION:
                plans.current = seq
                return
            if item.command != JUMP:
                self._do_commands.append(item)
            seq = self._next_after(seq, item)
        plans.current = len(plans.mission)
        self._ended = True

    def _next_after(self, seq: int, item: Item) -> int:
        if item.command != JUMP:
            return seq + 1
        plans = self.flight.plans
        left = self._jumps_left.setdefault(seq, int(item.number(1)))
        if left == 0 or not plans.first <= int(item.number(0)) < len(plans.mission):
            return seq + 1
        if left != JUMP_FOREVER:
            self._jumps_left[seq] = left - 1
        return int(item.number(0))

    def _run_do_commands(self) -> None:
        flight = self.flight
        while self._do_commands and self._progress is not None:
            item = self._do_commands[0]
            if self._do_command_since_s is None:
                self._do_command_since_s = flight.now_s
                begin_do_command(flight, item)
            north_m, east_m, _ = self._progress.destination
            to_go_m = math.hypot(north_m - flight.body.north_m, east_m - flight.body.east_m)
            if not do_command_is_done(flight, item, since_s=self._do_command_since_s, to_go_m=to_go_m):
                return
            self._do_commands.popleft()
            self._do_command_since_s = None

    def _begin(self, item: Item) -> None:
        flight, plans = self.flight, self.flight.plans
        self._flown = plans.current
        target = flight.target
        origin = target.north_m, target.east_m, target.alt_m
        self._progress = Progress(self._destination(item), origin, started_s=flight.now_s)
        flight.notify(Severity.INFO, f"Mission: {plans.current} {NAMES[item.command]}")
        flight.yaw_override_rad = None
        if item.command == TAKE_OFF and flight.landed:
            flight.lift_off()
        elif item.command == RETURN:
            self._homing.enter()
        elif item.command == LOITER_TURNS:
            self._progress.orbit = self._orbit(item, self._progress.destination)

    def _orbit(self, item: Item, destination: tuple[float, float, float]) -> Orbit:
        """The third parameter is the radius in metres (0: CIRCLE_RADIUS); negative is counter-clockwise."""
        body = self.flight.body
        north_m, east_m, _ = destination
        radius_m = abs(item.number(2)) or self.flight.parameters["CIRCLE_RADIUS"] / 100.0
        from_centre = (body.north_m - north_m, body.east_m - east_m)
        far = math.hypot(*from_centre) > 0.1
        angle = math.atan2(from_centre[1], from_centre[0]) if far else body.attitude()[2]
        return Orbit((north_m, east_m), radius_m, angle)

    def _destination(self, item: Item) -> tuple[float, float, float]:
        flight, target = self.flight, self.flight.target
        north_m, east_m = target.north_m, target.east_m
        if item.has_place and item.command != TAKE_OFF:
            north_m, east_m = flight.origin.to_local(item.x * 1e-7, item.y * 1e-7)
        if item.frame in (Frame.GLOBAL, Frame.GLOBAL_INT):
            alt_m = item.z - flight.origin.origin.alt_amsl_m
        else:
            alt_m = item.z + flight.home_local()[2]
        if item.command in (LOITER_FOREVER, LOITER_TIME, LOITER_TURNS, DELAY) and item.z == 0.0:
            alt_m = target.alt_m
        return north_m, east_m, alt_m

    def _done(self, item: Item) -> bool:
        flight, progress = self.flight, self._progress
        if progress is None or item.command in (LOITER_FOREVER, RETURN):
            return False
        if item.command == LAND:
            return flight.landed
        if item.command == DELAY:
            return flight.now_s - progress.started_s >= max(item.number(0), 0.0)
        if progress.orbit is not None:
            return progress.orbit.turned_rad >= abs(item.number(0)) * math.tau
        north_m, east_m, alt_m = progress.destination
        body, radius = flight.body, flight.parameters["WPNAV_RADIUS"] / 100.0
        near = math.hypot(north_m - body.north_m, east_m - body.east_m) <= max(radius, 0.5)
        if item.command == TAKE_OFF:
            near = True
        if near and abs(alt_m - body.alt_m) < 0.5 and progress.reached_since_s is None:
            progress.reached_since_s = flight.now_s
        if progress.reached_since_s is None:
            return False
        stay_s = item.number(0) if item.command in (WAYPOINT, SPLINE, LOITER_TIME) else 0.0
        return flight.now_s - progress.reached_since_s >= stay_s

    def _fly_item(self, progress: Progress) -> None:
        flight, item = self.flight, self._item()
        north_m, east_m, alt_m = progress.destination
        if item is not None and item.command == RETURN:
            self._homing.run()
            return
        body = flight.body
        if item is not None and item.command == LAND:
            if math.hypot(north_m - body.north_m, east_m - body.east_m) < 1.0 or flight.landed:
                descend(self)
                return
            alt_m = max(flight.target.alt_m, 1.0)
        limits = flight.limits()
        if progress.orbit is not None and item is not None:
            flight.target.climb_to(alt_m, limits, TICK_S)
            sign = -1.0 if item.number(2) < 0 else 1.0
            progress.orbit.run(flight, sign * math.radians(abs(flight.parameters["CIRCLE_RATE"])))
            flight.fly()
            return
        if item is not None and item.command in STRAIGHT:
            flight.target.slide_to(progress.origin, progress.destination, limits, body, TICK_S)
        else:
            flight.target.climb_to(alt_m, limits, TICK_S)
            flight.target.fly_to(north_m, east_m, limits, body, TICK_S)
        if look_at_roi(flight):
            pass
        elif flight.yaw_override_rad is not None:
            flight.attitude.turn_towards(flight.yaw_override_rad, TURN_RATE_RPS, TICK_S)
        else:
            look_ahead(self, north_m, east_m)
        flight.fly()
