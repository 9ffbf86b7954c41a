"""An error of ours while the tower looks at one drone: it is told, and everything else goes on."""

from __future__ import annotations

from typing import Any

import pytest
import structlog
from hub_world import FakeAgent, HubWorld, heartbeat, record

from server.link.api.data_endpoint import DataEndpoint
from server.link.api.fault_log import LOG_EVERY_S, FaultLog
from server.link.core.traffic import Traffic
from wire.dialect import build, mavlink
from wire.ids import DroneId

PLACE = build(
    mavlink.MAVLink_global_position_int_message(1, 470_000_000, 80_000_000, 500_000, 20_000, 0, 0, 0, 0),
    system_id=1,
    component_id=1,
    sequence=0,
)


class Broken(HubWorld):
    """Both drones are online, in the air, and watched by their owners."""

    def __init__(self) -> None:
        super().__init__()
        self.apply(record(1, (1,), holder=1), record(2, (2,), holder=2))
        self.faults: list[tuple[str, int | None]] = []
        self.hub.state.on_fault = lambda part, drone_id, error: self.faults.append((part, drone_id))
        self.agents: list[FakeAgent] = [self.agent(1), self.agent(2)]
        self.now = 0.0

    def pass_time(self, seconds: float) -> None:
        for _ in range(round(seconds * 10)):
            self.now += 0.1
            for agent in self.agents:
                agent.send(heartbeat(), PLACE, now=self.now)
            self.hub.tick(self.now)

    def drone(self, number: int) -> Any:
        return self.hub.state.drones[DroneId(number)]


def _fails(*_: Any, **__: Any) -> Any:
    raise ZeroDivisionError


@pytest.mark.parametrize("part", ["alerts", "separation", "safety"])
def test_a_fault_at_one_drone_costs_the_other_nothing(part: str, monkeypatch: pytest.MonkeyPatch) -> None:
    world = Broken()
    looked: list[int] = []
    owner, name = {
        "alerts": (world.hub.alerts, "_look"),
        "separation": (world.hub.separation, "_check_motion"),
        "safety": (world.hub.safety, "_watch_link"),
    }[part]

    def look(drone: Any, now: float) -> None:
        if drone.drone_id == 1:
            raise ZeroDivisionError
        looked.append(drone.drone_id)

    monkeypatch.setattr(owner, name, look)
    world.pass_time(2.0)
    assert set(looked) == {2}
    assert set(world.faults) == {(part, 1)}


def test_a_part_that_fails_does_not_end_the_ones_after_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody would notice that a drone is silent any more, or that an operation has no answer."""
    world = Broken()
    monkeypatch.setattr(world.hub.safety, "_state", None)
    world.agents.clear()
    world.drone(1).position_at = 5.0
    world.pass_time(1.0)
    assert ("safety", None) in world.faults
    assert world.hub.alerts._looked_at == pytest.approx(world.now, abs=0.5)


def test_a_datagram_that_cannot_be_handled_costs_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    world = Broken()
    endpoint = DataEndpoint(world.hub)
    monkeypatch.setattr(world.hub._paths, "up", _fails)
    (datagram,) = world.agents[0].sealed.seal_frames(world.drone(1).lease.epoch, [PLACE], 1.0)
    assert endpoint.datagram_received(datagram, ("198.51.100.1", 4001), 1.0)
    assert world.faults == [("datagrams", 1)]


def test_a_fault_is_counted_each_time_and_logged_once_a_minute() -> None:
    traffic = Traffic()
    log = FaultLog(traffic)
    with structlog.testing.capture_logs() as logged:
        for _ in range(5):
            log.note("alerts", DroneId(3), ZeroDivisionError("x"))
    assert traffic.faults == {"alerts": 5}
    (line,) = logged
    assert (line["event"], line["part"], line["drone_id"]) == ("part_failed", "alerts", 3)
    log._logged_at["alerts"] -= LOG_EVERY_S
    with structlog.testing.capture_logs() as logged:
        log.note("alerts", None, ZeroDivisionError("x"))
    assert len(logged) == 1
