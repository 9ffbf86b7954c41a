"""The tower: a ground station for many people flying many drones."""

from typing import Final

VERSION: Final = "0.3.0.dev0"
"""Of the distribution `control-tower`. The agent has the same (`onboard_agent.VERSION`)."""
