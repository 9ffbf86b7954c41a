"""Acts on what the hub notices: holds what has to be held at once, ends leases, writes down how every hold went.

The hub calls `noticed` and goes on. What must not wait for a database (an order to hold) happens inside that call; the
rest is carried out one event after the other for each drone, and tried again while the database is out of reach.
"""

import asyncio
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from typing import Any, Final

import structlog
from sqlalchemy.exc import SQLAlchemyError

from server.audit.store.trail import TOWER, Actor, record
from server.control.core.lease import Event
from server.control.store.lease_store import MOVED
from server.control.store.loss_checks import LossChecks
from server.control.store.open_hold_store import write_open_hold
from server.control.store.pending_revocations import PendingRevocations
from server.control.store.rehearsal import Rehearsals
from server.control.store.service import ControlRefused, ControlService
from server.control.store.who_withdrew import who_withdrew
from server.kernel.access import UnknownDrone
from server.kernel.clock import Clock
from server.kernel.shares import ShareName
from server.link.core.token_bucket import TokenBucket
from server.live.hub import Hub
from server.live.hub_events import (
    AgentLinked,
    ControlsMoved,
    HolderExpired,
    HolderGone,
    HoldStepReported,
    HoldToKeep,
    HubEvent,
    LoanLimitPassed,
    LossParametersReported,
    MotionSuspected,
    MotorsStopped,
    NoiseJudged,
    OfferLapsed,
    RightLost,
    RttTooLong,
    SeparationLost,
    StickGestureHeldBack,
    TurnRequested,
    ZoneReached,
)
from server.storage.database import Database
from wire.ids import DroneId

MAX_WAITING: Final = 64
"""Events of one drone that wait for the database: a minute of the wildest changing of hands."""

TRY_AGAIN_AFTER_S: Final = 1.0
MAX_RACES: Final = 20
"""How often a change that lost a race for the lease is made again at once."""
MAX_TRIES: Final = 600
"""Ten minutes. A lease that could not be ended by then is ended by the next change of anything in the fleet."""

CAUGHT_UP_WITHIN_S: Final = 5.0

AGENTS_ROW_EVERY_S: Final = 5.0
"""How often an agent may put something into the audit trail beyond its share: it must not bury what others did."""
AGENT: Final = Actor(None, "agent")
_RIGHTS: Final = {"holder": Event.REVOKE, "taken_from": Event.FORGET, "assistant": Event.ASSIST_END}
_log = structlog.get_logger(__name__)


class HubEventHandler:
    """One for a tower. The hub calls it (`hub.state.on_event = event_handler.noticed`) inside a running loop."""

    def __init__(
        self,
        *,
        service: ControlService,
        hub: Hub,
        database: Database,
        clock: Clock,
        loss_checks: LossChecks,
        rehearsals: Rehearsals,
        agent_linked: Callable[[DroneId], None] = lambda drone_id: None,
        try_again_after_s: float = TRY_AGAIN_AFTER_S,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        self._service = service
        self._hub = hub
        self._database = database
        self._clock = clock
        self._loss_checks = loss_checks
        self._rehearsals = rehearsals
        self._withdrawals = PendingRevocations(service, hub)
        self._agent_linked = agent_linked
        self._try_again_after_s = try_again_after_s
        self._monotonic = monotonic
        self._waiting: dict[DroneId, deque[HubEvent]] = {}
        self._at_work: dict[DroneId, asyncio.Task[None]] = {}
        self._agents_rows: dict[DroneId, tuple[int, TokenBucket]] = {}
        """With the limit by which it was made."""
        self.agents_rows_left_out = 0
        """Ends of holds that agents reported, and too many for the audit trail."""

    def noticed(self, event: HubEvent) -> None:
        """Does at once what cannot wait, and sees to the rest soon. Never raises, never waits."""
        match event:
            case AgentLinked():
                self._agent_linked(event.drone_id)
                return
            case LossParametersReported():
                self._loss_checks.reported(event.drone_id, event.parameters)
                return
            case HoldStepReported():
                self._rehearsals.hold_step(event.drone_id, event.progress, self._monotonic())
                if not event.progress.step.final:
                    return
            case HolderGone():
                self._hub.holds.order(event.drone_id, f"the holder has been gone for {event.for_s:.0f} s")
            case LoanLimitPassed() | ZoneReached():
                self._hub.holds.order(event.drone_id, event.why)
            case RttTooLong():
                self._hub.holds.order(event.drone_id, f"the round trip takes {event.rtt_ms:.0f} ms")
        self._queue(event)

    async def caught_up(self) -> None:
        """Returns when all earlier events are handled, or after a short time: callers must not wait for an unreachable
        database."""
        if self._at_work:
            await asyncio.wait(self._at_work.values(), timeout=CAUGHT_UP_WITHIN_S)

    async def stop(self) -> None:
        """Drops waiting events: the database has the truth, and the next start reads it."""
        tasks = list(self._at_work.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _queue(self, event: HubEvent) -> None:
        drone_id = event.drone_id
        waiting = self._waiting.setdefault(drone_id, deque())
        if event in waiting:
            return
        # A withdrawal of the controls always finds room: there is one for each holder.
        if not self._withdrawals.begin(event) and len(waiting) >= MAX_WAITING:
            _log.error("control_events_lost", drone_id=drone_id, what=type(event).__name__)
            return
        waiting.append(event)
        if drone_id not in self._at_work:
            self._at_work[drone_id] = asyncio.create_task(self._work(drone_id, waiting))

    async def _work(self, drone_id: DroneId, waiting: deque[HubEvent]) -> None:
        try:
            while waiting:
                await self._see_to(waiting[0])
                self._withdrawals.end(waiting.popleft())
        finally:
            del self._at_work[drone_id]
            self._waiting.pop(drone_id, None)

    async def _see_to(self, event: HubEvent) -> None:
        # A holder without the right stays shut out until the database has ended the lease.
        for number in count() if event in self._withdrawals else range(MAX_TRIES):
            try:
                await self._carry_out(event)
            except (ControlRefused, UnknownDrone):
                return  # too late: the lease has changed meanwhile
            except (SQLAlchemyError, OSError) as error:
                if number == 0:
                    self._withdrawals.hold(event)
                    words = {"what": type(event).__name__, "error": type(error).__name__}
                    _log.error("control_event_failed", drone_id=event.drone_id, **words)
                await asyncio.sleep(self._try_again_after_s)
            except Exception:
                self._withdrawals.hold(event)
                if number == 0:
                    _log.exception("control_event_failed", drone_id=event.drone_id, what=type(event).__name__)
                if event not in self._withdrawals:
                    return
                await asyncio.sleep(self._try_again_after_s)
            else:
                return

    async def _carry_out(self, event: HubEvent) -> None:
        change = self._service.system_change
        now = self._monotonic()
        match event:
            case HolderGone():
                gone = {"user_id": event.user_id, "gone_s": round(event.for_s, 1)}
                await self._record(event.drone_id, "control.holder_gone", gone)
            case RttTooLong():
                await self._record(event.drone_id, "control.round_trip_too_long", {"rtt_ms": round(event.rtt_ms)})
            case HolderExpired():
                await self._expire(event, now)
            case RightLost():
                await self._withdraw(event, now)
            case TurnRequested():
                reason = "the assistant flies" if event.whose == "assistant" else "the assistant has stopped"
                await change(event.drone_id, Event.TURN, reason=reason, turn_of=event.whose, now=now)
            case OfferLapsed():
                reason = "the controls were not accepted in time"
                await change(event.drone_id, Event.OFFER_LAPSED, reason=reason, now=now)
            case LoanLimitPassed():
                await self._record(event.drone_id, "control.loan_limit", {"user_id": event.user_id, "why": event.why})
            case ZoneReached():
                about = {"user_id": event.user_id, "zone_id": event.zone_id, "zone": event.zone, "why": event.why}
                await self._record(event.drone_id, "control.zone", about)
            case SeparationLost():
                near = {"other_id": event.other_id, "in_s": round(event.in_s, 1)}
                metres = {"horizontal_m": round(event.horizontal_m, 1), "vertical_m": round(event.vertical_m, 1)}
                await self._record(event.drone_id, "separation.warning", near | metres)
            case StickGestureHeldBack():
                tried = {"user_id": event.user_id, "airborne": event.airborne}
                await self._record(event.drone_id, "control.stick_gesture", tried)
            case MotionSuspected():
                await self._record(event.drone_id, "drone.suspicious_motion", {"why": event.why})
            case MotorsStopped():
                await self._record(event.drone_id, "drone.motors_stopped", {"where": event.where})
            case NoiseJudged():
                noise = {"measures": sorted(event.measures), "sends": event.words}
                await self._record(event.drone_id, "drone.noise_judged", noise)
            case HoldStepReported():
                await self._record_hold(event)
            case HoldToKeep():
                await write_open_hold(self._hub, self._database, event.drone_id)
            case ControlsMoved():
                await self._loss_checks.read_again(event.drone_id)

    async def _withdraw(self, event: RightLost, now: float) -> None:
        by = None
        with suppress(SQLAlchemyError, OSError):  # a name is not worth waiting for
            async with self._database.reading() as session:
                by = await who_withdrew(session, event, self._clock())
        what, about = _RIGHTS[event.whose], event.user_id
        for _ in range(MAX_RACES):
            try:
                await self._service.system_change(
                    event.drone_id, what, reason=event.reason, about=about, ordered_by=by, now=now
                )
                return
            except ControlRefused as error:
                # An assistant who came or went just now has moved the epoch: the part in the lease is still theirs.
                if error.code != MOVED.code:
                    raise

    async def _expire(self, event: HolderExpired, now: float) -> None:
        drone = self._hub.state.drones.get(event.drone_id)
        if drone is None or drone.holder_watch.missing_since is None:
            return  # they have come back just now
        reason = "the holder's connection stayed lost"
        await self._service.system_change(event.drone_id, Event.EXPIRE, reason=reason, about=event.user_id, now=now)

    async def _record_hold(self, event: HoldStepReported) -> None:
        progress = event.progress
        detail = {
            "cause": progress.cause.value,
            "reason": event.reason,
            "epoch": progress.epoch,
            "order_id": progress.order_id,
            "detail": progress.detail[:256],
            "elapsed_ms": progress.elapsed_ms,
        }
        now, limit = self._monotonic(), self._hub.state.shares.limit(ShareName.AUDIT_ROWS)
        made_by, room = self._agents_rows.get(event.drone_id, (0, None))
        if room is None or made_by != limit:
            room = TokenBucket(1 / AGENTS_ROW_EVERY_S, limit, now)
            self._agents_rows[event.drone_id] = limit, room
        self._hub.state.shares.note(ShareName.AUDIT_ROWS, event.drone_id)
        if not room.take(1, now):
            self.agents_rows_left_out += 1
            _log.warning("agents_hold_not_recorded", drone_id=event.drone_id, step=progress.step.value)
            return
        await self._record(event.drone_id, f"hold.{progress.step.value}", detail, actor=AGENT)

    async def _record(self, drone_id: DroneId, action: str, detail: dict[str, Any], *, actor: Actor = TOWER) -> None:
        async with self._database.writing() as session:
            record(session, at=self._clock(), actor=actor, action=action, drone_id=drone_id, detail=detail)
