"""What the rules of the alerts know about one drone at one moment: plain values, no reading of any state.

While a drone is silent its values are the last ones known, and `silence` says so. None: not known, never "no".
"""

from dataclasses import dataclass
from typing import Literal

from server.fleet.core.views import HoldView
from wire.autopilots.profile import FlightTask
from wire.open_holds import LostAction
from wire.signing_key import Signing

Silence = Literal["", "link", "autopilot"]
"""Who is not heard; empty: everything is."""


@dataclass(slots=True)
class Facts:
    """Built a few times a second for each drone, so a plain class: a frozen one would cost as much as all rules."""

    name: str
    known: bool = True
    """Link and autopilot were heard since the tower started. If not, nothing is known, and no alert begins or ends."""
    silence: Silence = ""
    armed: bool | None = None
    airborne: bool | None = None
    held_by: str | None = None
    """The name of the user who has the controls."""
    mode: str = ""
    """Empty: not known."""
    task: FlightTask | None = None
    height_m: float | None = None
    """Above home; None as well where no limit applies to a drone that is heard."""
    height_limit_m: float | None = None
    """The lowest that applies."""
    lost_action: LostAction | None = LostAction.RETURN
    """None: the agent does nothing by itself, because the vehicle is watched only."""
    lost_action_s: float = 30.0
    hold: HoldView | None = None
    hold_unconfirmed: str | None = None
    """The agent gave up a hold without a confirmation; what it said about it."""
    hold_reason: str = ""
    """Why the last hold was ordered."""
    system_status: int | None = None
    """MAV_STATE."""
    failsafe: str | None = None
    """What the autopilot's own failsafe does and why; empty: it does nothing; None: its state does not tell."""
    failsafe_cause: str = ""
    """Tells one failsafe from the next."""
    battery_percent: int | None = None
    battery_number: int | None = None
    """Which of several batteries is the worst, from 1."""
    battery_charge: int | None = None
    """MAV_BATTERY_CHARGE_STATE, the worst of its batteries."""
    gps_lost: bool | None = None
    """No GPS has a 3D fix."""
    gps_fix: int | None = None
    """GPS_FIX_TYPE, of the worst GPS."""
    gps_number: int | None = None
    """Which of several it is, from 1."""
    sensor_fault: str | None = None
    """Which sensors the autopilot calls unhealthy; empty: none."""
    estimator_fault: str | None = None
    """What is wrong with the position estimate; empty: nothing."""
    vibration_m_s2: float | None = None
    """The worst axis."""
    fence_breach: str | None = None
    """Which limit of the fence is broken; empty: none."""
    black_box_problem: str = ""
    """Why the drone's black box records nothing; empty: nothing is known against it."""
    aircraft_near: str = ""
    """Which aircraft comes near it, in words; empty: none."""
    foreign_drone_near: str = ""
    """Which drone of somebody else, by Remote ID."""
    zone_near: str = ""
    """Which zone it comes near, or which one that only warns it is in: the end of a sentence; empty: none."""
    zone_breach: str = ""
    """Which zone it is in that refuses it."""
    hears_agent: bool | None = None
    """Whether the autopilot answers the agent; None: not known."""
    falls: str = ""
    """How fast and where it falls; empty: it does not."""
    sinks: str = ""
    motors_stopped: str = ""
    """Where its motors stopped in the air; empty: they did not."""
    crashed: str = ""
    other_systems: tuple[int, ...] = ()
    """MAVLink systems of other autopilots on its line."""
    signing: Signing = Signing.OFF
    noise: str = ""
    """What it sends beyond its share, and what the tower does about it: the end of a sentence; empty: it does not."""
    motion: str | None = None
    """`jump`, `speed`, `height`, `course`: it does not move as a machine can."""

    @property
    def flies(self) -> bool:
        """In the air for all that is known, and heard."""
        return self.airborne is True and not self.silence
