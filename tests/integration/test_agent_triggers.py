"""What the agent does by itself, over real sockets: the ladder, stale and late sticks, a tower that stays lost."""

import asyncio
import time
from collections.abc import AsyncIterator
from typing import NamedTuple

import pytest
from agent_fakes import FakeAutopilot, FakeTower, running_agent, running_autopilot, running_tower, until

from onboard_agent.autopilot_port.udp import UdpIn
from wire.control_messages import HoldCause, HoldOrder, LossParameters, SafetySettings
from wire.dialect import build, mavlink
from wire.open_holds import LostAction

STABILIZE, ALT_HOLD, AUTO, GUIDED, LOITER, RTL, LAND = 0, 2, 3, 4, 5, 6, 9


class World(NamedTuple):
    tower: FakeTower
    autopilot: FakeAutopilot


@pytest.fixture
async def flying() -> AsyncIterator[World]:
    """Armed, 20 m above the ground."""
    port = UdpIn("udpin:127.0.0.1:0", "127.0.0.1", 0)
    async with running_tower() as tower, running_agent(tower, port):
        await until(lambda: port.bound_port, what="the port is open")
        async with running_autopilot(port.bound_port, armed=True) as autopilot:
            autopilot.alt_rel_m = 20.0
            await tower.linked()
            await until(lambda: tower.saw_autopilot(armed=True, airborne=True))
            yield World(tower, autopilot)


def sticks(x: int) -> bytes:
    message = mavlink.MAVLink_manual_control_message(1, x, 0, 500, 0, 0)
    return build(message, system_id=255, component_id=190, sequence=0)


def set_mode(mode: int) -> bytes:
    message = mavlink.MAVLink_command_long_message(1, 1, 176, 0, 1, mode, 0, 0, 0, 0, 0)
    return build(message, system_id=255, component_id=190, sequence=0)


async def fly_by_hand(world: World, for_s: float = 0.3) -> float:
    """Sticks at 50 Hz for a while. Returns when the last ones were sent."""
    end = time.monotonic() + for_s
    while True:
        world.tower.send_frames(sticks(400))
        sent_at = time.monotonic()
        if sent_at > end:
            return sent_at
        await asyncio.sleep(0.02)


async def test_a_refused_first_rung_leads_to_the_next_and_each_step_is_told(flying: World) -> None:
    flying.autopilot.refuses = {LOITER}
    flying.autopilot.custom_mode = STABILIZE
    await flying.tower.announce(SafetySettings(hold_ladder=("LOITER",)))
    await flying.tower.announce(HoldOrder(order_id=4, epoch=2, reason="taken"))
    await until(lambda: "confirmed" in flying.tower.hold_steps(4))
    reported = [(str(one.step), one.detail.split(" ")[0]) for one in flying.tower.progress(4)]
    assert reported == [
        ("sticks_centred", ""),
        ("mode_requested", "LOITER"),
        ("mode_requested", "ALT_HOLD"),
        ("mode_acknowledged", "ALT_HOLD"),
        ("confirmed", "ALT_HOLD"),
    ]
    assert flying.tower.progress(4)[-1].elapsed_ms < 250.0, "at once, without waiting for the next try"
    assert flying.autopilot.custom_mode == ALT_HOLD


async def test_sticks_that_stop_hold_half_a_second_later(flying: World) -> None:
    last = await fly_by_hand(flying)
    await until(lambda: "confirmed" in flying.tower.hold_steps(0))
    waited_s = time.monotonic() - last
    assert waited_s > 0.45
    progress = flying.tower.progress(0)
    assert {one.cause for one in progress} == {HoldCause.STICKS_STALE}
    assert [str(one.step) for one in progress] == [
        "ordered",
        "sticks_centred",
        "mode_requested",
        "mode_acknowledged",
        "confirmed",
    ]
    flying.tower.send_frames(sticks(401))
    flying.tower.send_frames(sticks(0))
    flying.tower.send_frames(sticks(402))
    await until(lambda: sticks(402) in flying.autopilot.frames)
    assert sticks(401) not in flying.autopilot.frames, "not centred yet"


async def test_late_sticks_and_late_commands_are_not_flown(flying: World) -> None:
    await fly_by_hand(flying)
    flying.tower.send_frames(sticks(777), late_s=0.8)
    flying.tower.send_frames(set_mode(RTL), late_s=2.5)
    flying.tower.send_frames(set_mode(GUIDED), late_s=1.0)
    await until(lambda: set_mode(GUIDED) in flying.autopilot.frames, what="a command within its time")
    assert sticks(777) not in flying.autopilot.frames
    assert set_mode(RTL) not in flying.autopilot.frames


async def test_only_late_sticks_are_stale_sticks(flying: World) -> None:
    await fly_by_hand(flying)
    until_s = time.monotonic() + 5.0
    while "confirmed" not in flying.tower.hold_steps(0) and time.monotonic() < until_s:
        flying.tower.send_frames(sticks(777), late_s=1.5)
        await asyncio.sleep(0.02)
    assert {one.cause for one in flying.tower.progress(0)} == {HoldCause.STICKS_STALE}
    assert sticks(777) not in flying.autopilot.frames


@pytest.mark.parametrize(
    ("action", "refuses", "ends_in"),
    [(LostAction.RETURN, set(), RTL), (LostAction.RETURN, {RTL}, LAND), (LostAction.LAND, set(), LAND)],
)
async def test_a_tower_that_stays_lost(
    flying: World, action: LostAction, refuses: set[int], ends_in: int, caplog: pytest.LogCaptureFixture
) -> None:
    tower, autopilot = flying
    autopilot.refuses = refuses
    await tower.announce(SafetySettings(lost_action=action, lost_action_s=3.0))
    await fly_by_hand(flying)
    port = tower.port
    await tower.die()
    await until(lambda: autopilot.custom_mode == ALT_HOLD, what="held first")
    await until(lambda: autopilot.custom_mode == ends_in, what="then what was set")
    await until(lambda: f"{'RTL' if ends_in == RTL else 'LAND'} confirmed" in caplog.text, what="said so")
    await tower.start(port)
    await tower.linked(2)
    beats = len(autopilot.heard("HEARTBEAT"))
    await until(lambda: len(autopilot.heard("HEARTBEAT")) >= beats + 2)
    assert autopilot.custom_mode == ends_in, "it is not changed back"


async def test_a_mission_goes_on_without_the_tower(flying: World, caplog: pytest.LogCaptureFixture) -> None:
    tower, autopilot = flying
    autopilot.custom_mode = AUTO
    await tower.announce(SafetySettings(lost_action=LostAction.CONTINUE, lost_action_s=2.0))
    await until(lambda: tower.frames and autopilot.heard("HEARTBEAT"))
    await tower.die()
    await until(lambda: "leave it as it is" in caplog.text)
    assert autopilot.modes_asked() == []


async def test_the_parameters_that_decide_on_a_loss_are_told() -> None:
    port = UdpIn("udpin:127.0.0.1:0", "127.0.0.1", 0)
    async with running_tower() as tower, running_agent(tower, port):
        await until(lambda: port.bound_port, what="the port is open")
        async with running_autopilot(port.bound_port) as autopilot:
            names = ["SYSID_MYGCS", "RC1_TRIM", "RC2_TRIM", "RC3_MIN", "RC3_MAX", "RC4_TRIM", "RC3_TRIM"]
            names += ["FS_GCS_ENABLE", "FS_GCS_TIMEOUT", "FS_THR_ENABLE", "FS_OPTIONS"]
            names += ["RC_OVERRIDE_TIME", "RC_FS_TIMEOUT", "RC_OPTIONS", "SIM_SPEEDUP"]
            autopilot.parameters = dict.fromkeys(names, 3.0)
            await tower.linked()
            found = await until(lambda: [m for m in tower.messages if isinstance(m, LossParameters)])
            assert found[0].complete
            assert found[0].autopilot == "ardupilot"
            assert found[0].values["FS_THR_ENABLE"] == 3.0
            autopilot.say(mavlink.MAVLink_param_value_message(b"FS_THR_ENABLE", 0.0, 9, 900, 1))
            await until(
                lambda: [m for m in tower.messages if isinstance(m, LossParameters)][-1].values["FS_THR_ENABLE"] == 0.0
            )
