"""What must be true before a vehicle is set up: calibrations, motor tests, reboots. Pure.

An autopilot does not guard all of it: ArduCopter accepts a motor test while it is armed, and disarms at its end
(measured).
"""

from __future__ import annotations

from typing import Final

from server.kernel.people import Principal
from server.kernel.refusal import Refusal
from server.live.live_drone import LiveDrone
from server.operations.core.flying import bodies
from server.operations.core.refusals import LoanForbids
from wire.autopilots import registry

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


class NoSuchMotor(Refusal):
    """ArduCopter accepts the test of a motor that its frame does not have, and turns nothing (measured)."""

    def __init__(self, name: str, motor: int, count: int) -> None:
        super().__init__(f"{name} has no motor {motor}: its frame has {count}")


def require_set_up(drone: LiveDrone, principal: Principal, body: object) -> None:
    """Raises NotOnTheGround, LoanForbids, PropellersNotConfirmed, NoSuchMotor. Passes whatever is no set-up."""
    if not isinstance(body, bodies.SETUP):
        return
    name = drone.record.name
    if drone.limits_of(principal.user_id, principal.role) is not None:
        raise LoanForbids(name, NOT_A_BORROWERS)
    if drone.armed is not False or drone.airborne is not False:
        raise NotOnTheGround(name, known=drone.armed is not None and drone.airborne is not None)
    if isinstance(body, bodies.SpinMotor):
        if body.propellers_off != name:
            raise PropellersNotConfirmed(name)
        count = _motor_count(drone)
        if count is not None and body.motor > count:
            raise NoSuchMotor(name, body.motor, count)


def _motor_count(drone: LiveDrone) -> int | None:
    family = registry.family_named(drone.loss_parameters.autopilot if drone.loss_parameters is not None else "")
    return None if family is None else family.motor_count(drone.onboard.parameters.values())
