"""Whether an autopilot is simulated, by its parameters. Pure."""

from wire.autopilots import registry
from wire.control_messages import LossParameters


def is_simulator(parameters: LossParameters | None) -> bool:
    """Whether the parameters prove it."""
    if parameters is None:
        return False
    family = registry.family_named(parameters.autopilot)
    return family is not None and family.is_simulated(parameters.values)
