"""A rehearsed loss: the tower ignores the operator's frames, or stops sending to the agent, and measures the time to
the hold. At most one at a time for each drone."""

import asyncio
import time
from dataclasses import dataclass
from typing import Final, Literal

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.audit.store.action import AuditAction
from server.control.core.lease import Refused
from server.control.core.simulated import is_simulator
from server.control.store.service import ControlRefused
from server.kernel.access import UnknownDrone
from server.kernel.clock import Clock
from server.kernel.people import Principal
from server.kernel.relations import Right
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.live.live_messages import Rehearsal
from server.storage.database import Database
from wire.control_messages import HoldProgress, HoldStep
from wire.ids import DroneId

What = Literal["operator", "tower"]
Phase = Literal["begun", "held", "not_needed", "failed", "ended"]

LASTS_S: Final[dict[What, float]] = {"operator": 5.0, "tower": 4.0}
"""Both are detected after 2 s; the rest is for the hold. Longer would be a real loss and not a rehearsal."""

GIVEN_UP_AFTER_S: Final = 8.0
"""Counted from the beginning. A hold that takes longer has failed."""

NOT_ARMED: Final = "it is on the ground, disarmed"
NOT_BY_HAND: Final = "nobody flies it by hand, and what flies by itself goes on"

_log = structlog.get_logger(__name__)


@dataclass
class _Running:
    began_at: float
    ended: "asyncio.Future[tuple[HoldProgress, float]]"
    """The final step of the hold, and the seconds from the loss until it was reported."""
    needs_none: str
    """Why the drone need not hold on this loss; empty if it must."""


def refusal_of(drone: LiveDrone, principal: Principal, what: What, *, in_flight: bool) -> Refused | None:
    """Returns why this user may not rehearse this now; None if they may."""
    if not drone.may(principal.user_id, principal.role, Right.REHEARSE):
        return Refused("not-the-holder", "only the holder or an admin can rehearse a loss")
    if not drone.online:
        return Refused("offline", "the drone is offline")
    if drone.watched_only:
        return Refused("watched-only", "this vehicle is watched only: there is no hold to rehearse")
    if what == "operator" and drone.holder_id is None:
        return Refused("no-holder", "nobody has the controls, so nobody can be lost")
    on_ground = drone.armed is False and drone.airborne is False
    if not on_ground and not (in_flight or is_simulator(drone.loss_parameters)):
        why = "is armed" if drone.armed or drone.airborne else "may be in the air, its autopilot is silent"
        return Refused("in-flight", f"the drone {why}: confirm that you want this in flight")
    return None


def needs_no_hold(drone: LiveDrone, what: What, now: float) -> str:
    """Returns why this drone need not hold on this loss; empty if it must.

    The tower itself detects a lost operator and orders a hold in any case; the agent then reports whether one was due.
    """
    if what == "operator":
        return ""
    if drone.armed is False:
        return NOT_ARMED
    return "" if drone.flown_by_hand(now) else NOT_BY_HAND


class Rehearsals:
    """One instance per tower."""

    def __init__(
        self, *, hub: Hub, database: Database, clock: Clock, given_up_after_s: float = GIVEN_UP_AFTER_S
    ) -> None:
        self._hub = hub
        self._database = database
        self._clock = clock
        self._given_up_after_s = given_up_after_s
        self._running: dict[DroneId, _Running] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def begin(self, principal: Principal, drone_id: DroneId, what: What, *, in_flight: bool, address: str) -> None:
        """Begins a rehearsal and reports its progress to viewers of the drone. Raises UnknownDrone, ControlRefused."""
        drone = self._hub.squads.drone(drone_id, principal.user_id, principal.role)
        if drone is None:
            raise UnknownDrone
        if drone_id in self._running:
            raise ControlRefused(Refused("rehearsal-running", "a rehearsal is going on already"))
        refused = refusal_of(drone, principal, what, in_flight=in_flight)
        if refused is not None:
            raise ControlRefused(refused)
        now = time.monotonic()
        ended = asyncio.get_running_loop().create_future()
        running = self._running[drone_id] = _Running(now, ended, needs_no_hold(drone, what, now))
        self._notify(drone_id, what, "begun", None, f"For {LASTS_S[what]:g} s the {what} counts as lost.")
        if what == "operator":
            self._hub.changes.rehearse_operator_loss(drone_id, for_s=LASTS_S[what], now=now)
        else:
            self._hub.changes.rehearse_tower_loss(drone_id, for_s=LASTS_S[what])
        action = AuditAction(by=principal, at=self._clock(), address=address)
        task = asyncio.create_task(self._see_through(drone_id, what, running, action))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def hold_step(self, drone_id: DroneId, progress: HoldProgress, now: float) -> None:
        """Handles a step of a hold that the agent reported."""
        running = self._running.get(drone_id)
        if running is not None and progress.step.final and not running.ended.done():
            running.ended.set_result((progress, now - running.began_at))

    async def stop(self) -> None:
        """Call it when the tower stops."""
        tasks = list(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def running(self, drone_id: DroneId) -> bool:
        """Whether a rehearsal is running."""
        return drone_id in self._running

    def _notify(self, drone_id: DroneId, what: What, phase: Phase, hold_ms: float | None, text: str) -> None:
        self._hub.changes.report_rehearsal(Rehearsal(drone_id, what, phase, hold_ms, text, LASTS_S[what]))

    async def _see_through(self, drone_id: DroneId, what: What, running: _Running, action: AuditAction) -> None:
        hold_ms: float | None = None
        try:
            phase, result, hold_ms, text = await self._outcome(what, running)
            self._notify(drone_id, what, phase, hold_ms, text)
            await asyncio.sleep(max(0.0, running.began_at + LASTS_S[what] - time.monotonic()))
            await self._record(drone_id, what, result, hold_ms, action)
        finally:
            self._running.pop(drone_id, None)
            self._notify(drone_id, what, "ended", hold_ms, "The rehearsal is over.")

    async def _outcome(self, what: What, running: _Running) -> tuple[Phase, str, float | None, str]:
        """Returns (phase, result for the audit trail, milliseconds to the confirmed hold, text)."""
        # If no hold is due, waits only for the duration of the loss itself.
        wait_s = min(LASTS_S[what], self._given_up_after_s) if running.needs_none else self._given_up_after_s
        try:
            async with asyncio.timeout(wait_s):
                progress, took_s = await running.ended
        except TimeoutError:
            if running.needs_none:
                return "not_needed", "not_needed", None, f"The drone need not hold: {running.needs_none}."
            return "failed", "no-hold", None, "The drone flown by hand did not hold."
        took_ms = round(took_s * 1000.0, 1)
        result = progress.step.value
        if progress.step is HoldStep.UNCONFIRMED:
            return "failed", result, None, f"The hold was not confirmed: {progress.detail}"
        if progress.step is HoldStep.NOT_NEEDED:
            words = f"Noticed {took_ms:.0f} ms after the loss. The drone need not hold: {NOT_ARMED}."
            return "not_needed", result, None, words
        return "held", result, took_ms, f"In {progress.detail}, {took_ms:.0f} ms after the loss."

    async def _record(
        self, drone_id: DroneId, what: What, result: str, hold_ms: float | None, action: AuditAction
    ) -> None:
        try:
            async with self._database.writing() as session:
                action.record(
                    session, "drone.loss_rehearsed", drone_id=drone_id, what=what, result=result, hold_ms=hold_ms
                )
        except (SQLAlchemyError, OSError) as error:
            _log.error("rehearsal_not_recorded", drone_id=drone_id, error=type(error).__name__)
