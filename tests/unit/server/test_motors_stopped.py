"""Motors that stop in the air: the alert, a notice to all who watch, and an event for the audit trail."""

from __future__ import annotations

from hub_world import HubWorld, record

from server.live.hub_events import HubEvent, MotorsStopped
from server.live.live_messages import AlertChanged, Notice
from wire.control_messages import AutopilotState
from wire.dialect import build, mavlink

G = 9.81


def test_everybody_who_watches_is_told_at_once_and_the_trail_has_it() -> None:
    world = HubWorld()
    world.apply(record(1, (1,), holder=1, epoch=5))
    alice, agent, now = world.browser(1), world.agent(1), 0.0
    events: list[HubEvent] = []
    world.hub.state.on_event = events.append

    def report(*, armed: bool) -> None:
        state = AutopilotState(heard=True, armed=armed, airborne=armed, system_id=1)
        world.hub.reports.receive(agent.link, state, world.hub.state.clock())

    def fly(height_m: float, down_m_s: float) -> None:
        nonlocal now
        place = mavlink.MAVLink_global_position_int_message(
            0, 1, 1, 0, int(height_m * 1000), 0, 0, int(down_m_s * 100), 0
        )
        agent.send(build(place, system_id=1, component_id=1, sequence=0), now=now)
        now += 0.1
        world.hub.tick(now)

    beat = mavlink.MAVLink_heartbeat_message(2, 3, 0x81, 0, 4, 3)
    agent.send(build(beat, system_id=1, component_id=1, sequence=0), now=now)
    report(armed=True)
    for _ in range(20):
        fly(60.0, 0.0)
    alice.events()
    report(armed=False)
    for tick in range(10):
        fly(60.0 - G * (tick / 10) ** 2 / 2, G * tick / 10)
    told = alice.events()
    words = "The motors of Drone 1 stopped in the air, 60 m above home."
    assert [
        one.alert.words for one in told if isinstance(one, AlertChanged) and one.alert.rule == "motors-stopped"
    ] == [words]
    assert [(one.code, one.text) for one in told if isinstance(one, Notice)] == [("motors-stopped", words)]
    assert [one for one in events if isinstance(one, MotorsStopped)] == [MotorsStopped(1, "60 m above home")]
