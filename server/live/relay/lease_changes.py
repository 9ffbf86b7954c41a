"""A lease that has been committed, brought into the live picture: who is shut out, who is told what, in which order.

The service hands over what it has committed (`apply`). What a snapshot of the database says first (`learnt`) counts at
once, but people are told only when the service has said nothing for a while: its own word, with who and why, may be
under way. If it is not, another process has changed the lease, and what it did is seen from the two leases.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from server.domain.people import UserRef
from server.live.relay import live_messages as live
from server.live.relay.live_drone import LeaseView, LiveDrone
from server.live.relay.live_state import LiveState
from wire.ids import DroneId

CONTROL_ACTS_WITHIN_S: Final = 1.0
"""From the commit to `apply` it is one turn of the event loop; a second is long on any machine."""

ELSEWHERE: Final = "changed by another process of the tower"


@dataclass
class _Move:
    """A change that a snapshot told of, and nobody else yet."""

    before: LeaseView
    expired: bool
    """The holder before it had been gone for longer than the grace time."""
    why_lost: str
    due_at: float | None = None


class LeaseChanges:
    """`note_presence`: looks again whether the drone's holder is there."""

    def __init__(self, state: LiveState, *, note_presence: Callable[[LiveDrone, float], None]) -> None:
        self._state = state
        self._note_presence = note_presence
        self._moves: dict[DroneId, _Move] = {}

    def apply(
        self, drone_id: DroneId, lease: LeaseView, *, event: str, by: UserRef | None, reason: str, now: float
    ) -> None:
        """From this call on the old holder's frames are refused."""
        drone = self._state.drones.get(drone_id)
        # The epoch may be known already, if a snapshot was read between the commit and this call.
        if drone is None or lease.epoch < drone.lease.epoch:
            return
        before, known = self._before(drone, lease), drone.lease
        drone.lease = lease
        drone.fenced = False
        waiting: list[bytes] = []
        if event == "turn":
            waiting = drone.turn.changed(now)
        else:
            drone.turn.reset()
        if known.holder != lease.holder:  # else a snapshot has said so first
            _restart(drone)
        self._note_presence(drone, now)
        self._state.send_holder_to_agent(drone)
        if waiting and drone.link is not None:
            drone.link.send_frames(lease.epoch, waiting, now)
        self._state.publish_drone(drone)
        if event == "turn":
            flying = lease.assistant if drone.turn.whose == "assistant" else lease.holder
            if flying is not None:
                self._state.notify_watchers(drone, live.Turn(drone_id, flying))
            return
        self._state.traffic.control_events[event] += 1
        self._notify(drone, before, event, by, reason)

    def learnt(self, drone: LiveDrone, before: LeaseView, why_lost: str) -> None:
        """A snapshot has changed the lease of this drone. `why_lost`: why the holder before it may hold it no more, in
        words; empty where they still may."""
        move = self._moves.setdefault(drone.drone_id, _Move(before, drone.holder_watch.has_expired, why_lost))
        move.why_lost = move.why_lost or why_lost
        move.due_at = None
        if before.holder != drone.lease.holder:
            _restart(drone)

    def tick(self, now: float) -> None:
        """Several times a second: tells what nobody else has told."""
        for drone_id, move in list(self._moves.items()):
            if move.due_at is None:
                move.due_at = now + CONTROL_ACTS_WITHIN_S
            elif now >= move.due_at:
                del self._moves[drone_id]
                drone = self._state.drones.get(drone_id)
                if drone is not None:
                    self._notify_move(drone, move)

    def _before(self, drone: LiveDrone, lease: LeaseView) -> LeaseView:
        """The lease before this change, which a snapshot may have told already. One before that is told first."""
        move = self._moves.pop(drone.drone_id, None)
        if move is None:
            return drone.lease
        if lease.epoch == drone.lease.epoch:
            return move.before
        self._notify_move(drone, move)
        return drone.lease

    def _notify_move(self, drone: LiveDrone, move: _Move) -> None:
        event = _seen_from(move.before, drone.lease, lost=bool(move.why_lost), expired=move.expired)
        if event is not None:
            self._notify(drone, move.before, event, None, move.why_lost or ELSEWHERE)

    def _notify(self, drone: LiveDrone, before: LeaseView, event: str, by: UserRef | None, reason: str) -> None:
        lease = drone.lease
        control_event = live.Control(drone.drone_id, event, lease.epoch, lease.holder, by, reason)
        self._state.notify_watchers(drone, control_event)
        self._state.notify_former_viewers(drone, before.part_takers() - lease.part_takers(), control_event)


def _restart(drone: LiveDrone) -> None:
    """Other hands, or none: neither whose sticks came nor who was missing says anything of them."""
    drone.sticks_at = float("-inf")
    drone.holder_watch.present()


def _seen_from(before: LeaseView, after: LeaseView, *, lost: bool, expired: bool) -> str | None:
    """What has happened, as far as the leases show it; None for what people are not told by name (a turn).

    `lost`: whoever held it before may not hold it any more. `expired`: they were gone for too long. Without these a
    release, a revocation and an expiry look alike.
    """
    if before.holder != after.holder:
        if after.holder is None:
            return "revoked" if lost else "expired" if expired else "released"
        if before.offered and after.holder == before.taken_from:
            return "accepted"
        return "taken" if after.taken_from is not None else "acquired"
    if before.assistant != after.assistant:
        return "assist_ended" if after.assistant is None else "assisting"
    if before.offered != after.offered and after.taken_from is not None:
        return "given" if after.offered else "taken"
    return "revoked" if before.taken_from != after.taken_from else None
