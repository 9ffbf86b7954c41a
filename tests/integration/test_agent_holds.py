"""A hold, end to end over real sockets: ordered by the tower, and started by the agent when the tower is lost."""

from collections.abc import AsyncIterator
from typing import NamedTuple

import pytest
from agent_fakes import FakeAutopilot, FakeTower, running_agent, running_autopilot, running_tower, until

from onboard_agent.autopilot_port.udp import UdpIn
from wire.control_messages import AutopilotState, ControlChanged, HoldOrder
from wire.dialect import build, mavlink

ALT_HOLD = 2
LOITER = 5


class World(NamedTuple):
    tower: FakeTower
    autopilot: FakeAutopilot


@pytest.fixture
async def flying() -> AsyncIterator[World]:
    port = UdpIn("udpin:127.0.0.1:0", "127.0.0.1", 0)
    async with running_tower() as tower, running_agent(tower, port):
        await until(lambda: port.bound_port, what="the port is open")
        async with running_autopilot(port.bound_port, armed=True) as autopilot:
            await tower.linked()
            await until(lambda: tower.saw_autopilot(armed=True, airborne=False))
            yield World(tower, autopilot)


def sticks(x: int, *, sequence: int = 0) -> bytes:
    message = mavlink.MAVLink_manual_control_message(1, x, 0, 500, 0, 0)
    return build(message, system_id=255, component_id=190, sequence=sequence)


def centred_count(autopilot: FakeAutopilot) -> int:
    return sum((m.x, m.y, m.z, m.r) == (0, 0, 500, 0) for m in autopilot.heard("MANUAL_CONTROL"))


async def test_an_order_holds_and_is_confirmed_step_by_step(flying: World) -> None:
    await flying.tower.announce(HoldOrder(order_id=4, epoch=2, reason="taken"))
    await until(lambda: "confirmed" in flying.tower.hold_steps(4))
    assert flying.tower.hold_steps(4) == ["sticks_centred", "mode_requested", "mode_acknowledged", "confirmed"]
    assert flying.autopilot.custom_mode == ALT_HOLD
    before = centred_count(flying.autopilot)
    await until(lambda: centred_count(flying.autopilot) >= before + 5, what="centred sticks go on")
    assert all(m.get_srcSystem() == 255 for m in flying.autopilot.heard("MANUAL_CONTROL"))


async def test_the_old_holder_is_shut_out_and_the_new_one_takes_over_centred(flying: World) -> None:
    tower, autopilot = flying
    await tower.announce(HoldOrder(order_id=5, epoch=2, reason="taken"))
    await until(lambda: "confirmed" in tower.hold_steps(5))
    tower.epoch = 2
    tower.send_frames(sticks(900), epoch=1)
    tower.send_frames(sticks(800))
    tower.send_frames(sticks(3))
    tower.send_frames(sticks(700))
    await until(lambda: sticks(700) in autopilot.frames)
    assert sticks(3) in autopilot.frames
    assert sticks(900) not in autopilot.frames, "of an old epoch"
    assert sticks(800) not in autopilot.frames, "not centred yet"
    after = autopilot.frames[autopilot.frames.index(sticks(700)) :]
    assert {frame[6] for frame in after if frame[7] == 69} == {190}
    assert after.count(sticks(700)) == 1


async def test_a_refusal_is_told_as_unconfirmed_with_the_reason(flying: World) -> None:
    flying.autopilot.obeys_mode = False
    await flying.tower.announce(HoldOrder(order_id=6, epoch=2, reason="taken"))
    await until(lambda: "unconfirmed" in flying.tower.hold_steps(6))
    assert "mode_acknowledged" not in flying.tower.hold_steps(6)
    assert any("refuses ALT_HOLD: FAILED" in getattr(m, "detail", "") for m in flying.tower.messages)
    flying.autopilot.obeys_mode = True
    await until(lambda: "confirmed" in flying.tower.hold_steps(6), what="it is still tried")


async def test_a_disarmed_drone_needs_no_hold(flying: World) -> None:
    flying.autopilot.armed = False
    await until(
        lambda: any(isinstance(one, AutopilotState) and one.heard and not one.armed for one in flying.tower.messages)
    )
    await flying.tower.announce(HoldOrder(order_id=7, epoch=2, reason="released"))
    await until(lambda: flying.tower.hold_steps(7) == ["not_needed"])
    assert not flying.autopilot.heard("MANUAL_CONTROL")


async def test_the_tower_dies_while_a_hand_is_on_the_sticks(flying: World) -> None:
    tower, autopilot = flying
    port = tower.port
    tower.send_frames(sticks(200))
    await until(lambda: sticks(200) in autopilot.frames)
    await tower.die()
    await until(lambda: autopilot.custom_mode == ALT_HOLD, what="the agent holds by itself")
    await until(lambda: centred_count(autopilot) > 5)
    await tower.start(port)
    await until(lambda: "confirmed" in tower.hold_steps(0), what="the hold is told when the tower is back")


async def test_the_tower_dies_while_nobody_flies_by_hand(flying: World) -> None:
    tower, autopilot = flying
    await tower.die()
    beats = len(autopilot.heard("HEARTBEAT"))
    await until(lambda: len(autopilot.heard("HEARTBEAT")) >= beats + 4, what="three seconds of the agent's own beats")
    assert autopilot.custom_mode == LOITER
    assert not autopilot.heard("MANUAL_CONTROL")


async def test_the_ground_station_beats_only_while_a_holder_is_present(flying: World) -> None:
    tower, autopilot = flying

    def ground_station_beats() -> int:
        return sum(m.type == mavlink.MAV_TYPE_GCS for m in autopilot.heard("HEARTBEAT"))

    def own_beats() -> int:
        return sum(m.get_srcComponent() == 191 for m in autopilot.heard("HEARTBEAT"))

    await until(lambda: own_beats() >= 2)
    assert ground_station_beats() == 0
    await tower.announce(ControlChanged(epoch=2, holder="ada", holder_present=True))
    await until(lambda: ground_station_beats() >= 2)
    await tower.announce(ControlChanged(epoch=2, holder="ada", holder_present=False))
    seen = own_beats()
    await until(lambda: own_beats() >= seen + 1)
    count = ground_station_beats()
    await until(lambda: own_beats() >= seen + 3)
    assert ground_station_beats() == count
