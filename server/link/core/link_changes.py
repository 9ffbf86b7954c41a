"""The links of agents: how they come, replace each other, lose their control channel, get another, and end."""

from collections.abc import Callable
from typing import Final

from server.control.core.orphans import Orphans, outlives_its_channel
from server.link.core.agent_link import AgentLink
from server.live.hub_events import AgentLinked
from server.live.live_state import LiveState
from wire.ids import DroneId, LinkId
from wire.tower_list import TOWERS, TowerList

LINK_REPLACED: Final = 4409

HAND_REMEMBERED_S: Final = 15.0
"""A link that returns within this time after the last stick is met with a hold, because the agent may have
restarted."""


ORDERED_AGAIN: Final = "the hold that was open is ordered again"


class LinkChanges:
    """One for the hub. `order_hold`: makes a drone hold, for a reason in words."""

    def __init__(self, state: LiveState, *, order_hold: Callable[[DroneId, str], object]) -> None:
        self._state = state
        self._order_hold = order_hold
        self._orphans = Orphans(self.detach)
        self.towers: tuple[str, ...] = ()
        """Addresses of the towers that take links now; empty: this one alone."""
        self.takes_new = True
        """False: this tower ends its work, and sends agents elsewhere."""

    def attach(self, link: AgentLink, now: float) -> None:
        """An agent signed in. Closes the drone's earlier link: the newest one counts.

        If the earlier link ended during flight by hand, the drone holds: the agent may be a new process that knows
        nothing of the sticks. For the same reason an open or pending hold is ordered again.
        """
        drone = self._state.drones[link.drone_id]
        if drone.link is not None:
            drone.link.close(LINK_REPLACED, "the same drone has signed in again")
            self.detach(drone.link)
        drone.link = link
        drone.agent_version = link.agent_version
        self._state.links[link.link_id] = link
        self._state.on_event(AgentLinked(drone.drone_id))
        link.post(drone.stream)
        self._state.send_safety_to_agent(drone)
        drone.open_hold.linked(reports=link.knows_open_holds)
        if drone.open_hold.must_be_ordered:
            self._order_hold(drone.drone_id, ORDERED_AGAIN)
        elif now - drone.sticks_at < HAND_REMEMBERED_S:
            self._order_hold(drone.drone_id, "the agent's link was renewed while flying by hand")
        self._state.note_hold(drone)

    def tell_towers(self, towers: tuple[str, ...]) -> None:
        """These towers take links now."""
        if towers != self.towers:
            self.towers = towers
            for link in list(self._state.links.values()):
                if TOWERS in link.takes:
                    link.post(TowerList(towers=towers))

    def send_away(self, link: AgentLink) -> bool:
        """Asks the agent to link to another tower and then to leave this one. False: it does not know how to."""
        if TOWERS not in link.takes or not self.towers:
            return False
        link.post(TowerList(towers=self.towers, leave=True))
        return True

    def detach(self, link: AgentLink) -> None:
        """Removes the link. Idempotent, also for a replaced link."""
        self._orphans.forget(link)
        self._state.links.pop(link.link_id, None)
        drone = self._state.drones.get(link.drone_id)
        if drone is not None and drone.link is link:
            drone.forget_link(self._state.clock())
            self._state.publish_soon(drone)

    def lose_channel(self, link: AgentLink, now: float) -> bool:
        """The control channel of a link has broken off. Whether that was the link's end."""
        if self._state.links.get(link.link_id) is not link:
            return True
        if self._orphans.take(link, now):
            self._state.traffic.links_orphaned += 1
            return False
        self.detach(link)
        return True

    def resumable(self, link_id: int, drone_id: DroneId, now: float) -> AgentLink | None:
        """The link of this drone that may have another control channel, if the agent proves that it is its."""
        link = self._state.links.get(LinkId(link_id))
        if link is None or link.drone_id != drone_id or not outlives_its_channel(link, now):
            return None
        return link

    def resumed(self, link: AgentLink) -> None:
        """The link has another control channel. Repeats everything that the last one may have lost."""
        self._orphans.forget(link)
        self._state.traffic.links_resumed += 1
        drone = self._state.drones[link.drone_id]
        link.post(drone.stream)
        self._state.send_safety_to_agent(drone)
        self._state.send_holder_to_agent(drone)

    def tick(self, now: float) -> None:
        """Several times a second."""
        self._orphans.tick(now)
