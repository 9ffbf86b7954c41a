"""What must be true before a vehicle is set up: calibrations, motor tests, reboots. Pure.

An autopilot does not guard all of it: ArduCopter accepts a motor test while it is armed, and disarms at its end
(measured).
"""

from __future__ import annotations

from typing import Final

from server.domain.people import Principal
from server.domain.refusal import Refusal
from server.live.flight_commands import bodies
from server.live.operations.refusals import LoanForbids
from server.live.relay.live_drone import LiveDrone

NOT_A_BORROWERS: Final = "a borrower does not set up the vehicle"


class NotOnTheGround(Refusal):
    """Armed, in the air, or not known to be neither."""

    def __init__(self, name: str, *, known: bool) -> None:
        if known:
            super().__init__(f"{name} is armed or in the air: it is set up on the ground, disarmed")
        else:
            super().__init__(f"it is not known whether {name} is armed: it is set up on the ground, disarmed")


class PropellersNotConfirmed(Refusal):
    def __init__(self, name: str) -> None:
        super().__init__(f"confirm that the propellers of {name} are off by its name: a turning propeller injures")


def require_set_up(drone: LiveDrone, principal: Principal, body: object) -> None:
    """Raises NotOnTheGround, LoanForbids, PropellersNotConfirmed. Passes whatever is no set-up."""
    if not isinstance(body, bodies.SETUP):
        return
    name = drone.record.name
    if drone.limits_of(principal.user_id, principal.role) is not None:
        raise LoanForbids(name, NOT_A_BORROWERS)
    if drone.armed is not False or drone.airborne is not False:
        raise NotOnTheGround(name, known=drone.armed is not None and drone.airborne is not None)
    if isinstance(body, bodies.SpinMotor) and body.propellers_off != name:
        raise PropellersNotConfirmed(name)
