"""Which tower is the home of which drone, as the towers have told. The database decides; this says whom to ask. No I/O.

Each claim in the database has a number that grows with each claim of the drone: of two towers that name themselves, the
one with the higher number is the home.
"""

from collections.abc import Iterable

from wire.ids import DroneId


class HomeDirectory:
    """One for a tower."""

    def __init__(self) -> None:
        self._homes: dict[DroneId, tuple[int, str]] = {}

    def home_of(self, drone_id: DroneId) -> str | None:
        """The tower, or None if none is known."""
        known = self._homes.get(drone_id)
        return None if known is None else known[1]

    def claim_of(self, drone_id: DroneId) -> int:
        """The number of the newest claim; 0 if none is known."""
        return self._homes.get(drone_id, (0, ""))[0]

    def learn(self, tower: str, homes: Iterable[tuple[int, int]]) -> list[DroneId]:
        """`tower` claims these drones, each with the number of its claim. The drones whose home has changed."""
        changed = []
        for drone, claim in homes:
            drone_id = DroneId(drone)
            known = self._homes.get(drone_id)
            if known is None or claim > known[0]:
                self._homes[drone_id] = (claim, tower)
                if known is None or known[1] != tower:
                    changed.append(drone_id)
        return changed

    def of(self, tower: str) -> list[tuple[int, int]]:
        """The drones of this tower, with their claims."""
        return [(drone_id, claim) for drone_id, (claim, home) in self._homes.items() if home == tower]

    def forget(self, drone_id: DroneId) -> None:
        """The drone was deleted."""
        self._homes.pop(drone_id, None)
