"""A hub with one drone, its holder and an admin, in simulated time."""

from hub_world import (
    FakeAgent,
    FakeBrowser,
    HubWorld,
    heartbeat,
    sticks,
)

from server.kernel.people import UserRef
from server.live import live_messages as live
from server.live.hub_events import HubEvent
from server.live.live_drone import LeaseView
from wire.ids import DroneId, Epoch, UserId
from wire.tagged import tag

ONE = DroneId(1)

ALICE, BOB, ADMIN = UserRef(UserId(1), "alice"), UserRef(UserId(2), "bob"), UserRef(UserId(9), "admin")

HELD = LeaseView(holder=ALICE, taken_from=None, epoch=Epoch(1))


class Scene:
    """alice holds drone 1, which is online. Collects all events from the hub."""

    def __init__(self) -> None:
        self.world = HubWorld()
        self.hub = self.world.hub
        self.events: list[HubEvent] = []
        self.agent: FakeAgent = self.world.agent(1)
        self.hub.state.on_event = self.events.append  # skips the event of the agent's link
        self.alice: FakeBrowser = self.world.browser(1)
        self.lease(HELD, "acquired")
        self.alice.events()

    def lease(self, lease: LeaseView, event: str, now: float = 0.0) -> None:
        self.hub.apply_lease(ONE, lease, event=event, by=ADMIN, reason="", now=now)

    def keep_alive(self, now: float) -> None:
        """Receives datagrams on the link while time passes."""
        self.agent.send(heartbeat(), now=now)
        self.hub.tick(now)

    def rehearsal_is_over(self, now: float) -> None:
        """Fires the timer that the link set for the end of the rehearsed loss of the tower."""
        self.agent.alarms.pop()[1](now)

    def fly(self, now: float, browser: FakeBrowser | None = None) -> None:
        (browser or self.alice).send(tag(ONE, sticks()), now=now)

    def notices(self, browser: FakeBrowser) -> list[str]:
        return [event.code for event in browser.events() if isinstance(event, live.Notice)]
