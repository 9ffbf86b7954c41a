"""One user's view of the fleet: the squad, and each drone in it. Reads only."""

from server.fleet.core.views import DroneView
from server.kernel.people import Role
from server.kernel.relations import Right
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from wire.ids import DroneId, UserId


class Squads:
    """One for the hub. Used when a connection opens or a request arrives, never for a frame."""

    def __init__(self, state: LiveState) -> None:
        self._state = state

    def drone(self, drone_id: DroneId, user_id: UserId, role: Role) -> LiveDrone | None:
        """The drone, or None both where it does not exist and where this user may not see it."""
        drone = self._state.drones.get(drone_id)
        return drone if drone is not None and drone.may(user_id, role, Right.SEE) else None

    def drones(self, user_id: UserId, role: Role) -> list[LiveDrone]:
        """By number."""
        return [drone for _, drone in sorted(self._state.drones.items()) if drone.may(user_id, role, Right.SEE)]

    def view(self, drone_id: DroneId, user_id: UserId, role: Role) -> DroneView | None:
        """This user's view of `drone`."""
        drone = self.drone(drone_id, user_id, role)
        return drone.view_for(user_id, role) if drone else None

    def views(self, user_id: UserId, role: Role) -> list[DroneView]:
        """This user's view of `drones`."""
        return [drone.view_for(user_id, role) for drone in self.drones(user_id, role)]
