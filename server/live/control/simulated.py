"""Whether an autopilot is simulated, by its parameters. Pure."""

from wire.control_messages import LossParameters


def is_simulator(parameters: LossParameters | None) -> bool:
    """Whether the parameters prove it.

    Only a simulated ArduPilot has any whose name begins with SIM_. A PX4 on a real board may have some as well, so
    there only those count that switch a simulation on: SYS_HITL (in the loop, or on the board itself) and SIM_GZ_EN.
    """
    if parameters is None:
        return False
    values = parameters.values
    if parameters.autopilot == "ardupilot":
        return any(name.startswith("SIM_") for name in values)
    return any(values.get(name, 0) > 0 for name in ("SYS_HITL", "SIM_GZ_EN"))
