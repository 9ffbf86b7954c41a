"""A lease that has been committed, brought into the live picture: who is shut out, who is told what, in which order."""

from collections.abc import Callable

from server.fleet.snapshot import UserRef
from server.relay import live_messages as live
from server.relay.live_drone import LeaseView, LiveDrone
from server.relay.live_state import LiveState
from wire.ids import DroneId


class LeaseChanges:
    """No state of its own. `note_presence`: looks anew whether the drone's holder is there."""

    def __init__(self, state: LiveState, *, note_presence: Callable[[LiveDrone, float], None]) -> None:
        self._state = state
        self._note_presence = note_presence

    def apply(
        self, drone_id: DroneId, lease: LeaseView, *, event: str, by: UserRef | None, reason: str, now: float
    ) -> None:
        """From this call on the old holder's frames are refused."""
        drone = self._state.drones.get(drone_id)
        # The epoch may be known already, if a snapshot was read between the commit and this call.
        if drone is None or lease.epoch < drone.lease.epoch:
            return
        before = drone.lease
        drone.lease = lease
        drone.fenced = False
        waiting: list[bytes] = []
        if event == "turn":
            waiting = drone.turn.changed(now)
        else:
            drone.turn.reset()
        if before.holder != lease.holder:
            drone.sticks_at = float("-inf")
            drone.holder_watch.present()
        self._note_presence(drone, now)
        self._state.tell_agent_who_holds(drone)
        if waiting and drone.link is not None:
            drone.link.send_frames(lease.epoch, waiting, now)
        self._state.tell_drone(drone)
        if event == "turn":
            flying = lease.assistant if drone.turn.whose == "assistant" else lease.holder
            if flying is not None:
                self._state.tell_watchers(drone, live.Turn(drone_id, flying))
            return
        self._state.traffic.control_events[event] += 1
        told = live.Control(drone_id, event, lease.epoch, lease.holder, by, reason)
        self._state.tell_watchers(drone, told)
        self._state.tell_former(drone, before.part_takers() - lease.part_takers(), told)
