"""Counts users, agents and queues on request. Off the frame path."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from server.live.live_state import LiveState
from wire.ids import UserId

Depths = tuple[int, int, int]
"""Text messages, transactional frames, state frames."""


@dataclass(frozen=True)
class LiveCounts:
    """`waiting`: for all browsers together; `deepest`: for the one that has most, of each. `agents_waiting`,
    `agents_deepest`: the same for agents."""

    browsers: int
    users: int
    agents: int
    drones: int
    online: int
    held: int
    waiting: Depths
    deepest: Depths
    agents_waiting: tuple[int, int]
    """Messages of the control channel, and datagrams that go by it."""
    agents_deepest: tuple[int, int]
    agent_versions: Mapping[str, int]
    """Agents signed in, by their version."""


def count_live(state: LiveState) -> LiveCounts:
    """A snapshot of this moment."""
    depths = [browser.waiting() for browser in state.browsers.values()] or [(0, 0, 0)]
    texts, transactional, kinds = zip(*depths, strict=True)
    messages, datagrams = zip(*([link.waiting() for link in state.links.values()] or [(0, 0)]), strict=True)
    return LiveCounts(
        browsers=len(state.browsers),
        users=len({browser.viewer.user_id for browser in state.browsers.values()}),
        agents=len(state.links),
        drones=len(state.drones),
        online=sum(drone.online for drone in state.drones.values()),
        held=sum(drone.lease.holder is not None for drone in state.drones.values()),
        waiting=(sum(texts), sum(transactional), sum(kinds)),
        deepest=(max(texts), max(transactional), max(kinds)),
        agents_waiting=(sum(messages), sum(datagrams)),
        agents_deepest=(max(messages), max(datagrams)),
        agent_versions=Counter(link.agent_version or "unknown" for link in state.links.values()),
    )


def online_users(state: LiveState) -> list[tuple[UserId, str, int]]:
    """(user, name, live connections) of each user with a live connection, by name."""
    counted = Counter((browser.viewer.name, browser.viewer.user_id) for browser in state.browsers.values())
    return [(user_id, name, connections) for (name, user_id), connections in sorted(counted.items())]
