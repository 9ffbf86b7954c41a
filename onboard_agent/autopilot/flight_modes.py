"""What flight modes mean to the failsafe, by the profiles of `wire.autopilots`. Pure."""

from collections.abc import Sequence

from wire.autopilots import registry
from wire.autopilots.profile import FailsafeModes, FlightMode


def modes_of(autopilot_kind: int, vehicle_type: int) -> FailsafeModes | None:
    """Returns the modes of a multicopter, or None for a vehicle without known modes (a plane, a rover)."""
    profile = registry.of(autopilot_kind, vehicle_type)
    return None if profile is None else profile.failsafe


def hold_rungs(modes: FailsafeModes | None, names: Sequence[str]) -> tuple[FlightMode, ...]:
    """Returns the drone's ladder: the named modes in that order, and altitude hold last, named or not.

    Skips names that this kind of vehicle does not have. Empty if no modes are known.
    """
    if modes is None:
        return ()
    known = {mode.name: mode for mode in modes.position_holds}
    wanted = [known[name] for name in dict.fromkeys(names) if name in known]
    return (*wanted, modes.altitude_hold)


def flies_without_sticks(autopilot_kind: int, custom_mode: int) -> bool:
    """Whether this mode needs no hand on the sticks. An unknown mode counts as one that needs them."""
    return registry.multicopter(autopilot_kind).flies_without_sticks(custom_mode)


def goes_home(autopilot_kind: int, custom_mode: int) -> bool:
    """Whether a multicopter in this mode ends on the ground by itself."""
    modes = registry.multicopter(autopilot_kind).failsafe
    return modes is not None and any(mode.custom_mode == custom_mode for mode in modes.going_home)


def holds_when_centred(autopilot_kind: int, custom_mode: int) -> bool:
    """Whether this is a mode in which centred sticks keep level and height. False for unknown modes."""
    if autopilot_kind not in registry.FAMILIES:
        return False
    return registry.multicopter(autopilot_kind).holds_when_centred(custom_mode)


def commanded_mode(autopilot_kind: int, main: float, sub: float) -> int:
    """Returns the custom_mode in param2 and param3 of DO_SET_MODE. Raises ValueError, OverflowError: not a number."""
    return registry.multicopter(autopilot_kind).family.custom_mode(main, sub)
