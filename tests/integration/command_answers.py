"""What the tower says about commands: the end of an operation, and when it knows that a drone is down."""

from typing import Any

from worlds.pilot import Pilot
from worlds.processes import Visitor


def is_on_the_ground(alice: Visitor) -> bool:
    """As the tower knows it, which is later than the frames."""
    drone = alice.drone(1)
    return drone["armed"] is False and drone["airborne"] is False


async def end_of(pilot: Pilot, operation: str) -> Any:
    """Waits for the end of the operation on the live channel."""

    def ended() -> list[Any]:
        reported = [one["operation"] for one in pilot.events if one["type"] == "operation"]
        return [one for one in reported if one["id"] == operation and one["state"] != "running"]

    await pilot.until(lambda: bool(ended()), f"operation {operation}")
    return ended()[0]
