"""Finds the drones that the user means, by name or id. Pure."""

from dataclasses import dataclass
from typing import Any, Final

from connect.unusable import Unusable
from wire.ids import DroneId

MAX_DRONES: Final = 32
"""At once."""


@dataclass(frozen=True)
class Chosen:
    drone_id: DroneId
    name: str


def choose_all(squad: list[dict[str, Any]], wanted: list[str]) -> list[Chosen]:
    """Returns the drones that the user named, in their order. Raises Unusable."""
    found = [choose(squad, which) for which in wanted]
    if len(found) > MAX_DRONES:
        raise Unusable(f"{len(found)} drones are too many: {MAX_DRONES} at once")
    for number, one in enumerate(found):
        if one in found[:number]:
            raise Unusable(f"{one.name} is named twice")
    return found


def choose(squad: list[dict[str, Any]], which: str) -> Chosen:
    """Returns the drone of the squad with the name (case ignored) or id `which`. Raises Unusable."""
    wanted = which.strip().casefold()
    by_name = [drone for drone in squad if drone["name"].casefold() == wanted]
    by_id = [drone for drone in squad if str(drone["id"]) == wanted]
    found = {drone["id"]: drone for drone in by_name + by_id}
    if len(found) > 1:
        raise Unusable(f"{which} is the name of one drone and the id of another")
    if not found:
        names = ", ".join(f"{drone['name']} ({drone['id']})" for drone in squad) or "none at all"
        raise Unusable(f"there is no drone {which} in your squad; there is {names}")
    (drone,) = found.values()
    return Chosen(DroneId(drone["id"]), drone["name"])
