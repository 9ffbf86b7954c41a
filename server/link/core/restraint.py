"""What a measure against a noisy drone does to its flight, in words, before anybody takes it. Pure."""

from typing import Final

from server.alerts.core.link_conditions import DOES
from server.kernel.refusal import Refusal
from server.kernel.restraint import Measure
from server.live.live_drone import LiveDrone

QUARANTINED_WORDS: Final = "an admin has quarantined this drone: its key stays good, and it may link when that ends"
"""For the agent's log."""


class LosesItsLink(Refusal):
    """A quarantine of a drone that may be in the air, and nobody has confirmed it."""

    def __init__(self, drone: LiveDrone) -> None:
        super().__init__(f"{effect_of(drone, Measure.QUARANTINED)} Confirm it to go on")


def needs_confirmation(drone: LiveDrone, measure: Measure) -> bool:
    """Whether it may cost a flight: the drone is in the air, or not known to be disarmed."""
    if measure is not Measure.QUARANTINED:
        return False
    return drone.counts_as_flying() or (drone.link is not None and drone.armed is not False)


def effect_of(drone: LiveDrone, measure: Measure) -> str:
    """What the measure does to this drone now."""
    name = drone.record.name
    if measure is Measure.MUTED:
        return (
            f"Texts of {name}, and its alerts that are not critical, reach only whoever has its controls, and no mail, "
            "push or webhook. Its flight goes on as it is."
        )
    if measure is Measure.LIMITED:
        return (
            f"Telemetry of {name} comes at most twice a second: whoever flies it by hand sees it late. Sticks, "
            "commands and holds reach it as before. It is muted too."
        )
    if not needs_confirmation(drone, measure):
        return f"{name} loses its link at once, and its agent is refused until the quarantine ends. Its key stays."
    where = "is in the air" if drone.counts_as_flying() else "may be armed"
    return f"{name} {where}. It loses its link at once, and nobody can fly or hold it by the tower. {_alone(drone)}"


def _alone(drone: LiveDrone) -> str:
    if drone.watched_only:
        return "Its agent does nothing by itself: its autopilot goes on as it is."
    safety = drone.safety
    return f"It holds if it is flown by hand, and {DOES[safety.lost_action]} after {safety.lost_action_s:.0f} s."
