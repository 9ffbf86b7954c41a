"""Applies committed leases to the live state: shuts people out and notifies them, in a fixed order.

The service passes what it committed (`apply`). A change that a database snapshot shows first (`learnt`) takes effect at
once, but people are notified only after a while, because the service's own event, with actor and reason, may be on its
way. If none comes, another process changed the lease, and the two leases show what happened.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from server.kernel.people import UserRef
from server.live import live_messages as live
from server.live.live_drone import LeaseView, LiveDrone
from server.live.live_state import LiveState
from server.towers.core.place import Place
from wire.ids import DroneId

CONTROL_ACTS_WITHIN_S: Final = 1.0
"""From the commit to `apply` it is one turn of the event loop; a second is long on any machine."""

ELSEWHERE: Final = "changed by another process of the tower"


@dataclass
class _Move:
    """A change seen in a snapshot and not yet reported."""

    before: LeaseView
    expired: bool
    """The former holder had been missing for longer than the grace time."""
    why_lost: str
    due_at: float | None = None


class LeaseChanges:
    """`note_presence`: checks again whether the drone's holder is present."""

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
        if known.holder != lease.holder or before.holder != lease.holder:
            drone.unheld_why = _unheld_why(before, lease, event, reason)
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
        if waiting and drone.link is not None and drone.link.send_frames(lease.epoch, waiting, now):
            self._state.traffic.frames_to_agents += len(waiting)
            if drone.tape is not None:
                drone.tape.add(waiting, now)
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
        if drone.place is Place.ELSEWHERE:
            return  # its home tells everybody
        move = self._moves.setdefault(drone.drone_id, _Move(before, drone.holder_watch.has_expired, why_lost))
        move.why_lost = move.why_lost or why_lost
        move.due_at = None
        if before.holder != drone.lease.holder:
            _restart(drone)

    def tick(self, now: float) -> None:
        """Called several times a second: reports changes that the service has not reported."""
        for drone_id, move in list(self._moves.items()):
            if move.due_at is None:
                move.due_at = now + CONTROL_ACTS_WITHIN_S
            elif now >= move.due_at:
                del self._moves[drone_id]
                drone = self._state.drones.get(drone_id)
                if drone is not None:
                    self._notify_move(drone, move)

    def _before(self, drone: LiveDrone, lease: LeaseView) -> LeaseView:
        """The lease before this change, which a snapshot may have shown already. Reports an older pending change
        first."""
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
            drone.unheld_why = _unheld_why(move.before, drone.lease, event, move.why_lost)
            self._notify(drone, move.before, event, None, move.why_lost or ELSEWHERE)

    def _notify(self, drone: LiveDrone, before: LeaseView, event: str, by: UserRef | None, reason: str) -> None:
        lease = drone.lease
        control_event = live.Control(drone.drone_id, event, lease.epoch, lease.holder, by, reason)
        self._state.notify_watchers(drone, control_event)
        self._state.notify_former_viewers(drone, before.part_takers() - lease.part_takers(), control_event)


def _restart(drone: LiveDrone) -> None:
    """The controls changed hands: earlier sticks and absences do not concern the new holder."""
    drone.sticks_at = float("-inf")
    drone.holder_watch.present()


def _unheld_why(before: LeaseView, after: LeaseView, event: str, why: str) -> str:
    """How it came that nobody has the controls; empty while somebody has them."""
    if after.holder is not None or before.holder is None:
        return ""
    name = before.holder.name
    if event == "released":
        return f"{name} released the controls"
    if event == "expired":
        return f"{name} was away for too long"
    return f"{name} may not fly it any more: {why}" if why else f"{name} may not fly it any more"


def _seen_from(before: LeaseView, after: LeaseView, *, lost: bool, expired: bool) -> str | None:
    """What happened, as far as the two leases show; None for a turn, which is not reported by name.

    `lost`: the former holder lost their right. `expired`: they were missing for too long. Without these flags a
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
