"""A tower's hub, a real agent core and a whole simulated vehicle on one clock: what their alerts tell people.

The test is the tower's side of the controls (`take`, `holder_is`, `send`); the hub is told the lease by `lease`.
"""

from __future__ import annotations

import itertools
from typing import Any, Final

from hub_world import FakeAgent, FakeBrowser, HubWorld, record
from worlds.held_copter import ARM, HeldCopter, mode_command, sticks, takeoff
from worlds.simulated_copter import SimulatedCopter

from server.live import live_messages as live
from simulator.failure_modes import Failure, PlannedFailure
from simulator.modes import Mode
from wire.black_box import BLACK_BOX
from wire.dialect import build
from wire.open_holds import OPEN_HOLDS

UP_M: Final = 20.0
M: Final = 1 / 111_319.5
"""Degrees of latitude of a metre."""


class FlownHub(HeldCopter):
    """alice holds drone 1 and looks at it."""

    def __init__(
        self,
        *,
        flight: dict[str, Any] | None = None,
        settings: dict[str, Any] | None = None,
        height_limit_m: float = 0.0,
        **vehicle: Any,
    ) -> None:
        self.world = HubWorld(height_limit_m=height_limit_m)
        self.hub = self.world.hub
        self.world.apply(record(1, (1,), holder=1, epoch=5), record(2, (1, 2)))
        self.alice: FakeBrowser = self.world.browser(1)
        self.end: FakeAgent | None = None
        self.heard_besides: list[bytes] = []
        """Frames of a receiver on board, each sent once a second."""
        self.neighbour: bytes | None = None
        """Where drone 2 is, sent five times a second."""
        self.other: FakeAgent | None = None
        self._next_besides_at = self._next_neighbour_at = self._next_second_at = 0.0
        self.seen: dict[str, list[tuple[int, bool]]] = {}
        """What alice was told: by rule, numbers of alerts and whether they are over."""
        self._told = 0
        self._ends = itertools.count(101)
        copter: Any = SimulatedCopter(50.0, flight={"boot_s": 1.0, **(flight or {})}, **vehicle)
        self.vehicle = copter.vehicle
        super().__init__(copter, knows_s=3.0, **(settings or {}))

    def link_up(self, **more: Any) -> None:
        super().link_up(**{"takes": (OPEN_HOLDS,), **more})
        self.end = FakeAgent(self.hub, 1, link_id=next(self._ends), now=self.now, takes=(OPEN_HOLDS, BLACK_BOX))

    def link_down(self) -> None:
        super().link_down()
        if self.end is not None:
            self.hub.detach_link(self.end.link)
        self.end = None

    def step(self) -> None:
        said = self.copter.step(self.now)
        if self.now >= self._next_besides_at:
            self._next_besides_at = self.now + 1.0
            said += self.heard_besides
        agent = self.agent
        passed = agent.from_autopilot(said, self.now) if said else []
        if self.linked:
            agent.tower_heard(self.now)
            agent.round_trip(0.02)
            if self.hand is not None and self.now >= self._next_hand_at:
                self._next_hand_at = self.now + 0.05
                self.send(sticks(*self.hand))
        agent.tick(self.now)
        self._exchange()
        self._to_tower(passed + agent.frames_to_tower(self.now))
        if self.neighbour is not None and self.now >= self._next_neighbour_at:
            self._next_neighbour_at = self.now + 0.2
            assert self.other is not None
            self.other.send(self.neighbour, now=self.now)
        self.hub.tick(self.now)
        if self.now >= self._next_second_at:
            self._next_second_at = self.now + 1.0
            self.hub.each_second(self.now)

    def _to_tower(self, frames: list[bytes]) -> None:
        reports, self._told = self.reported[self._told :], len(self.reported)
        if self.end is None:
            return
        if frames:
            self.end.send(*frames, now=self.now)
        for _, report in reports:
            self.hub.reports.receive(self.end.link, report, self.hub.state.clock())
        self.end.answer_pings(self.now)

    # What happens to it.

    def take_off(self) -> None:
        for frame in (mode_command(Mode.GUIDED), ARM, takeoff(UP_M)):
            self.send(frame)
            self.pass_time(0.3)
        self.pass_until(lambda: self.copter.height_m > UP_M - 0.5)
        self.hand = (0, 500)
        self.send(mode_command(Mode.LOITER))
        self.pass_time(3.0)

    def arm(self) -> None:
        self.send(mode_command(Mode.ALT_HOLD))
        self.pass_time(0.3)
        self.send(ARM)
        self.pass_time(1.0)

    def fail(self, failure: Failure, for_s: float) -> None:
        since = self.now - 50.0
        self.vehicle.plan_failure(PlannedFailure(since, failure, since + for_s))

    def hear(self, message: Any, component: int) -> None:
        """A receiver on board hears this, from now on."""
        self.heard_besides.append(build(message, system_id=1, component_id=component, sequence=0))

    @property
    def place(self) -> tuple[float, float]:
        """In truth, degrees."""
        north, east, _, _ = self.vehicle.flight.body.true_pose
        there = self.vehicle.flight.origin.to_place(north, east, 0.0)
        return there.lat_deg, there.lon_deg

    def lease(self, holder: int | None) -> None:
        """The hub learns that this account has the controls."""
        self.epoch += 1
        self.world.apply(record(1, (1,), holder=holder, epoch=self.epoch), record(2, (1, 2)))

    # What people are told.

    def tell(self) -> None:
        """Reads what alice was told meanwhile."""
        for event in self.alice.events():
            if isinstance(event, live.AlertChanged):
                self.seen.setdefault(event.alert.rule, []).append((event.alert.id, event.alert.closed_at is not None))

    def watch(self) -> None:
        """What was told before does not count."""
        self.alice.events()
        self.seen = {}

    def is_open(self, rule: str) -> bool:
        return any(one.rule.name == rule and one.closed_at is None for one in self.hub.alerts.live())

    def opened(self, rule: str) -> int:
        """How many alerts of this rule alice has seen."""
        self.tell()
        return len({number for number, _ in self.seen.get(rule, [])})
