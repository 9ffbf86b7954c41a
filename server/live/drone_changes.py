"""Changes that services make to one drone: fence, settings, loss check, rehearsals.

A change to a removed drone is ignored: it may have gone during the database query.
"""

from collections.abc import Callable
from typing import Literal

from server.control.core.loss_check_mark import LossCheckMark
from server.live import live_messages as live
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from wire.control_messages import SafetySettings, StreamSettings
from wire.ids import DroneId


class DroneChanges:
    """One for the hub. `note_presence`: called when the holder's presence may have changed."""

    def __init__(self, state: LiveState, *, note_presence: Callable[[LiveDrone, float], None]) -> None:
        self._state = state
        self._note_presence = note_presence

    def fence(self, drone_id: DroneId) -> None:
        """A change of control is pending: no commands pass until `Hub.apply_lease` or `unfence`."""
        drone = self._state.drones.get(drone_id)
        if drone is not None:
            drone.fenced = True

    def unfence(self, drone_id: DroneId) -> None:
        """The change was refused: the holder goes on."""
        drone = self._state.drones.get(drone_id)
        if drone is not None:
            drone.fenced = False

    def notify_undecided(self, drone_id: DroneId, severity: Literal["info", "warning", "error"], words: str) -> None:
        """Notifies all who may see the drone about a change of control that the database has not decided."""
        drone = self._state.drones.get(drone_id)
        if drone is not None:
            self._state.notify_watchers(drone, live.Notice(severity, "control-undecided", words, drone_id, 1))

    def apply_safety(self, drone_id: DroneId, settings: SafetySettings) -> None:
        """Applies hold settings and sends them to the agent."""
        drone = self._state.drones.get(drone_id)
        if drone is not None and drone.safety != settings:
            drone.safety = settings
            self._state.send_safety_to_agent(drone)
            self._state.publish_drone(drone)

    def apply_stream(self, drone_id: DroneId, settings: StreamSettings) -> None:
        """Applies the telemetry profile and sends it to the agent."""
        drone = self._state.drones.get(drone_id)
        if drone is not None and drone.stream != settings:
            drone.stream = settings
            self._state.send_to_agent(drone, settings)
            self._state.publish_drone(drone)

    def set_loss_check(self, drone_id: DroneId, mark: LossCheckMark) -> None:
        """Applies the result of the loss check and notifies all who see the drone."""
        drone = self._state.drones.get(drone_id)
        if drone is not None and drone.loss_check != mark:
            drone.loss_check = mark
            self._state.notify_watchers(drone, live.LossCheckChanged(drone_id))

    def rehearse_operator_loss(self, drone_id: DroneId, *, for_s: float, now: float) -> None:
        """The holder counts as gone for this long."""
        drone = self._state.drones.get(drone_id)
        if drone is not None:
            drone.holder_deaf_until = now + for_s
            self._note_presence(drone, now)
            # A rehearsal is there to see the hold, so it counts as flown by hand.
            drone.holder_watch.by_hand = True

    def rehearse_tower_loss(self, drone_id: DroneId, *, for_s: float) -> None:
        """The data channel sends nothing to this agent for this long."""
        drone = self._state.drones.get(drone_id)
        if drone is not None and drone.link is not None:
            drone.link.mute(for_s)

    def report_rehearsal(self, step: live.Rehearsal) -> None:
        """Reports the progress of a rehearsal to all who may see the drone."""
        drone = self._state.drones.get(DroneId(step.drone_id))
        if drone is not None:
            self._state.notify_watchers(drone, step)
