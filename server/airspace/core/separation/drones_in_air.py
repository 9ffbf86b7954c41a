"""Where the drones of all towers are, as the separation watch of this tower sees it. Part of the hub.

The drones at home here are read from the hub, the others from what their towers tell. A pair belongs to the towers
that have one of it. The home of the drone with the lower number leads it: it tells those who may see both, and opens
the one alert. What a stranger may know of the other drone is told by the home of the stranger's own.
"""

from server.airspace.core.separation.bounds import STALE_S
from server.airspace.core.separation.credible import is_credible
from server.airspace.core.separation.elsewhere import KEEP_S, MAX_TOLD, DroneInAir, in_air
from server.airspace.core.separation.motion import Motion, motion_in
from server.airspace.core.separation.near_pairs import Pair
from server.live.live_state import LiveState
from server.towers.core.place import Place
from wire.ids import DroneId


class DronesInAir:
    """One for the hub."""

    def __init__(self, state: LiveState) -> None:
        self._state = state

    def is_here(self, drone_id: DroneId) -> bool:
        """Whether this tower is its home."""
        drone = self._state.drones.get(drone_id)
        return drone is not None and drone.place is Place.HERE

    def concerns(self, pair: Pair) -> bool:
        """Whether this tower watches the pair."""
        return self.is_here(pair[0]) or self.is_here(pair[1])

    def leads(self, pair: Pair) -> bool:
        """Whether this tower tells those who may see both."""
        return self.is_here(pair[0])

    def flying(self, now: float) -> dict[DroneId, Motion]:
        """Those with a fresh position."""
        self._state.elsewhere.forget_old(now)
        flying = {
            drone_id: motion
            for drone_id, motion in self._state.elsewhere.motions()
            if drone_id in self._state.drones and not self.is_here(drone_id) and now - motion.at <= STALE_S
        }
        for drone_id, drone in self._state.drones.items():
            if drone.place is not Place.HERE or not drone.counts_as_flying() or drone.position_frame is None:
                continue
            if now - drone.position_at <= STALE_S:
                motion = motion_in(drone.position_frame, drone.position_at)
                if motion is not None:
                    flying[drone_id] = motion
        return flying

    def motion(self, drone_id: DroneId) -> Motion | None:
        """The newest, however old; None: on the ground, or gone."""
        drone = self._state.drones.get(drone_id)
        if drone is None:
            return None
        if drone.place is not Place.HERE:
            known = self._state.elsewhere.get(drone_id)
            return None if known is None else known.motion
        # While it is silent, its last position counts: a drone does not land because its link broke.
        if drone.position_frame is None or drone.airborne is False:
            return None
        return motion_in(drone.position_frame, drone.position_at)

    def is_credible(self, drone_id: DroneId, now: float) -> bool | None:
        """Whether others may be alarmed about it; None: not known."""
        drone = self._state.drones.get(drone_id)
        if drone is None or drone.place is Place.HERE:
            return is_credible(drone, now)
        known = self._state.elsewhere.get(drone_id)
        if known is None:
            return False
        return None if now - known.motion.at > STALE_S else known.credible

    def told(self, now: float) -> list[DroneInAir]:
        """All that this tower has in the air, for the others."""
        told = []
        for drone_id, drone in self._state.drones.items():
            if drone.place is not Place.HERE or not drone.counts_as_flying() or drone.position_frame is None:
                continue
            motion = motion_in(drone.position_frame, drone.position_at)
            if motion is None or now - motion.at > KEEP_S:
                continue
            credible = is_credible(drone, now)
            told.append(in_air(drone_id, motion, now, credible=credible, without_view=drone.user_without_view))
        return told[:MAX_TOLD]
