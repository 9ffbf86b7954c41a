"""The setting `release_keys`: who may sign releases of the agent."""

from collections.abc import Sequence

from onboard_agent.unusable import Unusable
from wire.agent_update import read_release_key


def parse_release_keys(keys: Sequence[str]) -> tuple[str, ...]:
    """Raises Unusable."""
    for key in keys:
        try:
            read_release_key(key)
        except ValueError as error:
            raise Unusable(f"the release key {key!r} {error}") from None
    return tuple(keys)
