"""The control service: carries a decision of the table into the store, the hub and the drone, in that order.

To take control from somebody, it fences the drone in the hub before it asks the store: from that instant no
commands pass until the decision. Of two concurrent requests the store lets one win.
"""

import asyncio
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, Literal

from server.control.core.lease import Event, Order, Refused
from server.control.store.lease_store import Ask, Committed, LeaseStore
from server.control.store.undecided import DECIDED_WITHIN_S, ControlUndecided, UndecidedTakes
from server.fleet.core.views import DroneView
from server.kernel.access import Action, UnknownDrone, reaches_all
from server.kernel.people import Principal, UserRef
from server.kernel.refusal import Refusal
from server.kernel.relations import Right
from server.live.hub import Hub
from server.live.live_drone import LeaseView, LiveDrone
from server.storage.database import TIMEOUT_S, DatabaseUnavailable, LockLost
from wire.ids import DroneId, UserId

EVENT_NAMES: Final = {
    Event.ACQUIRE: "acquired",
    Event.RELEASE: "released",
    Event.TAKE: "taken",
    Event.GIVE: "given",
    Event.ACCEPT: "accepted",
    Event.ASSIST: "assisting",
    Event.ASSIST_END: "assist_ended",
    Event.TURN: "turn",
    Event.REVOKE: "revoked",
    Event.FORGET: "revoked",
    Event.OFFER_LAPSED: "taken",
    Event.EXPIRE: "expired",
}
"""The past-tense names of events for clients (docs/wire-protocol.md, 1.2)."""


def _why_it_holds(event: Event, name: str) -> str:
    """A whole sentence for each event: other languages have other words for each."""
    match event:
        case Event.TAKE:
            return f"controls taken by {name}"
        case Event.GIVE:
            return f"controls given by {name}"
        case Event.ACCEPT:
            return f"controls accepted by {name}"
        case Event.ACQUIRE:
            return f"controls acquired by {name}"
        case Event.RELEASE:
            return f"controls released by {name}"
        case Event.ASSIST | Event.ASSIST_END | Event.TURN:
            return f"help by {name} began or ended"
        case _:
            return f"controls changed by {name}"


class ControlRefused(Refusal):
    """The table refused the event. `code` is stable and for programs."""

    def __init__(self, refused: Refused) -> None:
        super().__init__(refused.words)
        self.code = refused.code


class ControlService:
    """One for a tower. `change` and `system_change` are the only ways in which a lease changes."""

    def __init__(
        self,
        store: LeaseStore,
        hub: Hub,
        *,
        on_changed: Callable[[DroneId], None] = lambda drone_id: None,
        timeout_s: float = TIMEOUT_S,
    ) -> None:
        """`timeout_s`: for which a TAKE waits for the store."""
        self._store = store
        self._hub = hub
        self._on_changed = on_changed
        self._timeout_s = timeout_s
        self._fences: Counter[DroneId] = Counter()
        self._held_first: Counter[DroneId] = Counter()
        self._undecided = UndecidedTakes(store, hub, fence=self.fence, unfence=self.unfence)

    async def change(
        self,
        principal: Principal,
        drone_id: DroneId,
        event: Event,
        *,
        reason: str,
        address: str,
        now: float,
        watch: bool = True,
        moves_video: bool = False,
        sticks_centred: bool = False,
        interrupts: bool = False,
    ) -> DroneView:
        """Does what `event` asks for and returns the drone as it is then, as this user may see it.

        `reason` is free text for people, `now` monotonic seconds. `interrupts`: see Ask.
        Raises UnknownDrone for a drone that is not there or not theirs to see, ControlRefused with the table's answer.
        """
        live_drone = self._hub.squads.drone(drone_id, principal.user_id, principal.role)
        if live_drone is None:
            raise UnknownDrone
        ask = Ask(
            drone_id=drone_id,
            event=event,
            by=principal,
            reason=reason,
            began_at=time.perf_counter(),
            address=address,
            watch=watch,
            moves_video=moves_video,
            sticks_centred=sticks_centred,
            interrupts=interrupts,
        )
        takes = event is Event.TAKE and self._may_take_now(live_drone, principal)
        by = UserRef(principal.user_id, principal.name)
        await self._carry_out(ask, live_drone, fenced=takes, by=by, now=now)
        view = self._hub.squads.view(drone_id, principal.user_id, principal.role)
        if view is None:
            raise UnknownDrone
        return view

    def _may_take_now(self, drone: LiveDrone, principal: Principal) -> bool:
        """As far as the hub knows. A TAKE that will be refused must not stop anybody's commands, even for a moment."""
        in_the_way = [one for one in (drone.lease.holder, drone.lease.assistant) if one is not None]
        if drone.holder_id == principal.user_id or not drone.may(principal.user_id, principal.role, Right.TAKE):
            return False
        outranks_all = reaches_all(principal.role, Action.COMMAND)
        return outranks_all or not any(self._hub.fleet.outranks(one.id) for one in in_the_way)

    async def system_change(
        self,
        drone_id: DroneId,
        event: Event,
        *,
        reason: str,
        now: float,
        by: Principal | None = None,
        ordered_by: UserRef | None = None,
        about: UserId | None = None,
        turn_of: Literal["holder", "assistant"] | None = None,
    ) -> LeaseView:
        """Applies an event of the tower's own. `about`: the user whose part in the lease it ends; refused if it is
        another's by now.

        `by`: the person who caused it, for the audit trail and for notifications; `ordered_by`: the same if the trail
        already has their action. `turn_of` goes with TURN: notifications name the user whose frames pass.

        Raises UnknownDrone and ControlRefused.
        """
        live_drone = self._hub.state.drones.get(drone_id)
        if live_drone is None:
            raise UnknownDrone
        ask = Ask(
            drone_id=drone_id,
            event=event,
            by=by,
            reason=reason,
            began_at=time.perf_counter(),
            as_tower=True,
            about=about,
        )
        ordered_by = UserRef(by.user_id, by.name) if by else ordered_by
        fenced = event in (Event.REVOKE, Event.EXPIRE) and about in (None, live_drone.holder_id)
        committed = await self._carry_out(ask, live_drone, fenced=fenced, by=ordered_by, now=now, turn_of=turn_of)
        return committed.view

    async def _carry_out(
        self,
        ask: Ask,
        live_drone: LiveDrone,
        *,
        fenced: bool,
        by: UserRef | None,
        now: float,
        turn_of: Literal["holder", "assistant"] | None = None,
    ) -> Committed:
        by_hand = live_drone.flown_by_hand(now)
        with self._fenced(ask.drone_id, wanted=fenced):
            outcome = await self._decided(ask, fenced=fenced, by=by, now=now)
            if isinstance(outcome, Refused):
                raise ControlRefused(outcome)
            # No await from here on: the refusal of the old holder and the order to hold are one step.
            view, event, now = outcome.view, EVENT_NAMES[ask.event], now + time.perf_counter() - ask.began_at
            if turn_of is not None:
                by = view.assistant if turn_of == "assistant" else view.holder
            self._hub.apply_lease(ask.drone_id, view, event=event, by=by, reason=ask.reason, now=now)
            self._on_changed(ask.drone_id)
        orders = outcome.changed.orders
        if Order.HOLD in orders or (Order.HOLD_IF_FLOWN_BY_HAND in orders and by_hand):
            name = by.name if by else "the tower"
            reason = ask.reason or _why_it_holds(ask.event, name)
            self._hub.holds.order(ask.drone_id, reason, interrupts=ask.interrupts and ask.event is Event.TAKE)
        return outcome

    async def _decided(self, ask: Ask, *, fenced: bool, by: UserRef | None, now: float) -> Committed | Refused:
        """The store's decision. A TAKE does not wait for it: the drone holds, even without an answer."""
        if ask.event is not Event.TAKE or not fenced:
            return await self._store.commit(ask)
        name = by.name if by else "the tower"
        committing = asyncio.create_task(self._store.commit(ask))
        held = False
        try:
            done, _ = await asyncio.wait({committing}, timeout=DECIDED_WITHIN_S)
            if not done:
                held = True
                if not self._held_first[ask.drone_id]:
                    self._undecided.hold(ask.drone_id, name, interrupts=ask.interrupts)
                done, _ = await asyncio.wait({committing}, timeout=self._timeout_s)
            if not done:
                raise TimeoutError
            return committing.result()
        except LockLost:
            raise
        except (DatabaseUnavailable, OSError) as error:
            if not held and not self._held_first[ask.drone_id]:
                self._undecided.hold(ask.drone_id, name, interrupts=ask.interrupts)
            self._undecided.wait_for_decision(ask, by, now, committing)
            raise ControlUndecided from error
        except asyncio.CancelledError:
            # The requester has gone. The database's decision is not known, so the fence stays.
            self._undecided.wait_for_decision(ask, by, now, committing)
            raise

    @contextmanager
    def shut_out(self, principal: Principal, drone_id: DroneId, *, interrupts: bool = False) -> Iterator[None]:
        """For a TAKE whose sender the database has not confirmed yet, but who was signed in a moment ago: in this block
        the drone holds and no commands pass. Without effect if they may not take it."""
        drone = self._hub.squads.drone(drone_id, principal.user_id, principal.role)
        takes = drone is not None and self._may_take_now(drone, principal)
        with self._fenced(drone_id, wanted=takes):
            if takes:
                self._undecided.hold(drone_id, principal.name, interrupts=interrupts)
            self._held_first[drone_id] += takes
            try:
                yield
            finally:
                self._held_first[drone_id] -= takes
                self._held_first += Counter()  # forgets those at nought

    async def stop(self) -> None:
        """Ends what waits for the database."""
        await self._undecided.stop()

    @contextmanager
    def _fenced(self, drone_id: DroneId, *, wanted: bool) -> Iterator[None]:
        """Two admins may reach for a drone at once: its fence stays down until the last of them has an answer."""
        if not wanted:
            yield
            return
        self.fence(drone_id)
        try:
            yield
        finally:
            self.unfence(drone_id)

    def fence(self, drone_id: DroneId) -> None:
        """No commands pass until `unfence` has been called as often."""
        self._fences[drone_id] += 1
        self._hub.changes.fence(drone_id)

    def unfence(self, drone_id: DroneId) -> None:
        self._fences[drone_id] -= 1
        if self._fences[drone_id]:
            self._hub.changes.fence(drone_id)  # each applied lease lifts the hub's fence
        else:
            del self._fences[drone_id]
            self._hub.changes.unfence(drone_id)
