"""What a drone of the flown table does when its pilot is lost, and the ways in which that happens.

The operator flies a situation through the tower; a trigger ends that flight and returns the time (the loop's clock).
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from bench.hand_flight import THROTTLE_DOWN
from bench.person import Sticks
from bench.real_autopilot import RealAutopilot
from bench.rig import HOME, wait_for
from bench.squadron import FlownDrone
from bench.tap import OPERATOR
from wire.dialect import mavlink

ARM, SET_MODE = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_DO_SET_MODE
TAKE_OFF: Final = mavlink.MAV_CMD_NAV_TAKEOFF
ALT_HOLD, AUTO, GUIDED, LOITER, RTL = 2, 3, 4, 5, 6

HEIGHT_M: Final = 25.0
LOW_HEIGHT_M: Final = 12.0
NEAR_GROUND_M: Final = 5.0
ASK_AGAIN_S: Final = 1.2
INTO_THE_HOLD_S: Final = 3.0
EARLY_S: Final = 0.3
LOST_S: Final = 2.0
SILENT_S: Final = 3600.0


class TowerEnds(Enum):
    """What happens to the tower, for all of its drones together."""

    NOT = auto()
    KILLED = auto()
    SILENT = auto()
    """It is stopped: nothing comes over the line, and nothing arrives."""


@dataclass(frozen=True, slots=True)
class Situation:
    name: str
    reach: Callable[[FlownDrone], Awaitable[None]]
    """Starts from a manual hover at `height_m`."""
    height_m: float = HEIGHT_M
    mission: bool = False
    brief: bool = False
    """It cannot last long: the ground is near."""
    by_hand: bool = True
    """The operator's sticks fly it until the end."""


@dataclass(frozen=True, slots=True)
class Trigger:
    name: str
    pull: Callable[[FlownDrone], Awaitable[float]]
    operator_stays: bool = True
    """Whether the operator has a live connection afterwards."""
    old_holder: int | None = OPERATOR
    tower: TowerEnds = TowerEnds.NOT
    foretold: bool = False
    """Nobody is left who could tell what the drone does; the check before flight says it."""


async def set_mode(drone: FlownDrone, mode: int) -> None:
    """The operator requests the mode repeatedly until the autopilot reports it."""
    asked_at = 0.0

    async def shown() -> bool:
        nonlocal asked_at
        if drone.tap.modes and drone.tap.modes[-1].custom_mode == mode:
            return True
        if drone.operator.now - asked_at > ASK_AGAIN_S:
            asked_at = drone.operator.now
            await drone.operator.command(SET_MODE, 1, mode)
        return False

    await wait_for(f"mode {mode}", shown, 20)


async def arm(drone: FlownDrone) -> None:
    """Arms in GUIDED with throttle down, which every receiver permits, and none too."""
    pilot = drone.operator
    pilot.sticks = Sticks()
    await drone.order(pilot, "acquire")
    await drone.acknowledge_losses()
    await set_mode(drone, GUIDED)
    pilot.sticks = THROTTLE_DOWN
    asked_at = 0.0

    async def armed() -> bool:
        nonlocal asked_at
        if drone.tap.modes[-1].armed:
            return True
        if pilot.now - asked_at > ASK_AGAIN_S:
            asked_at = pilot.now
            await pilot.command(ARM, 1)
        return False

    await wait_for("it to arm", armed, 60)


async def take_off(drone: FlownDrone, height_m: float) -> None:
    """Climbs to the height, then manual flight in LOITER."""
    await arm(drone)
    pilot, tap = drone.operator, drone.tap
    asked_at = 0.0

    async def climbing() -> bool:
        nonlocal asked_at
        if tap.motions[-1].alt_m > 1.0:
            return True
        if pilot.now - asked_at > 4.0:
            asked_at = pilot.now
            await pilot.command(TAKE_OFF, 0, 0, 0, 0, 0, 0, height_m)
        return False

    await wait_for("the take-off", climbing, 30)
    pilot.sticks = Sticks()
    await wait_for("the height", lambda: tap.motions[-1].alt_m > height_m - 0.7, 60)
    await set_mode(drone, LOITER)
    await asyncio.sleep(1.5)


async def put_mission(drone: FlownDrone) -> None:
    """Up and down the field at the height of the flight, for longer than any recording."""
    rows: list[list[object]] = [[TAKE_OFF, 3, [0, 0, 0, 0], 0, 0, HEIGHT_M, 1]]
    for number in range(8):
        north_e7 = 60_000 if number % 2 == 0 else 10_000
        rows.append(
            [16, 3, [0, 0, 0, 0], round(HOME[0] * 1e7) + north_e7, round(HOME[1] * 1e7) + 500 * number, HEIGHT_M, 1]
        )
    await drone.order(drone.operator, "acquire")
    put = await drone.operator.ask("PUT", f"/drones/{drone.drone_id}/mission", {"items": rows})
    if put["state"] != "done":
        raise RuntimeError(f"the mission was not taken: {put}")
    await drone.order(drone.operator, "release")


async def _stick(drone: FlownDrone, sticks: Sticks, seconds: float) -> None:
    drone.operator.sticks = sticks
    await asyncio.sleep(seconds)


async def hover(drone: FlownDrone) -> None:
    await _stick(drone, Sticks(), 1.0)


async def climb(drone: FlownDrone) -> None:
    await _stick(drone, Sticks(z=1000), 3.0)


async def descend(drone: FlownDrone) -> None:
    await _stick(drone, Sticks(z=0), 3.0)


async def _forward(drone: FlownDrone) -> None:
    drone.operator.sticks = Sticks(x=1000)
    await wait_for("8 m/s", lambda: drone.tap.motions[-1].speed_mps > 7.9, 20)


async def _auto(drone: FlownDrone) -> None:
    drone.operator.sticks = None
    await set_mode(drone, AUTO)
    await asyncio.sleep(4.0)


async def _rtl(drone: FlownDrone) -> None:
    drone.operator.sticks = None
    await set_mode(drone, RTL)
    await asyncio.sleep(3.0)


async def _near_ground(drone: FlownDrone) -> None:
    drone.operator.sticks = Sticks(z=0)
    await wait_for("the ground to be near", lambda: drone.tap.motions[-1].alt_m < NEAR_GROUND_M, 20)


SITUATIONS: Final = (
    Situation("hover", hover),
    Situation("full climb", climb),
    Situation("full descent", descend, brief=True),
    Situation("full forward", _forward),
    Situation("AUTO", _auto, mission=True),
    Situation("RTL", _rtl),
    Situation("near the ground", _near_ground, LOW_HEIGHT_M, brief=True),
)


async def _take(drone: FlownDrone) -> float:
    at = drone.admin.now
    await drone.order(drone.admin, "take")
    return at


async def _browser_gone(drone: FlownDrone) -> float:
    at = drone.operator.now
    await drone.operator.vanish()
    return at


async def _tab_silent(drone: FlownDrone) -> float:
    """The connection stays open, but sends nothing any more, not even answers to pings."""
    drone.operator.sticks = None
    drone.operator.pong_delay_s = SILENT_S
    return drone.operator.now


async def _give_and_accept(drone: FlownDrone) -> float:
    """Taken, given back and accepted; then the operator does nothing."""
    await drone.order(drone.admin, "take")
    drone.operator.sticks = Sticks()
    await asyncio.sleep(2.0)
    await drone.order(drone.admin, "give")
    await asyncio.sleep(0.5)
    await drone.order(drone.operator, "accept", sticks_centred=True)
    drone.operator.sticks = None
    return drone.operator.now


async def _release(drone: FlownDrone) -> float:
    at = drone.operator.now
    await drone.order(drone.operator, "release")
    drone.operator.sticks = None
    return at


async def _kill_agent(drone: FlownDrone) -> float:
    """Takes first, so that the agent dies in a hold."""
    at = await _take(drone)
    await asyncio.sleep(INTO_THE_HOLD_S)
    await drone.kill_agent()
    return at


async def _kill_agent_by_hand(drone: FlownDrone) -> float:
    """The computer on board fails, and the transmitter's own sticks come back."""
    at = drone.operator.now
    await drone.kill_agent()
    return at


async def _restart_agent(drone: FlownDrone) -> float:
    """Restarts the agent a second later, as the service manager does."""
    at = await _kill_agent(drone)
    await asyncio.sleep(1.0)
    await drone.start_agent()
    return at


async def _restart_agent_early(drone: FlownDrone) -> float:
    """The same in stage one."""
    at = await _take(drone)
    await asyncio.sleep(EARLY_S)
    await drone.kill_agent()
    await asyncio.sleep(1.0)
    await drone.start_agent()
    return at


async def _transmitter_lost(drone: FlownDrone) -> float:
    """A TAKE after the receiver has lost its transmitter, which the operator's sticks hide."""
    assert isinstance(drone.autopilot, RealAutopilot)
    await drone.autopilot.truth.set_parameter("SIM_RC_FAIL", 1)
    await asyncio.sleep(LOST_S)
    return await _take(drone)


async def _tower_killed(drone: FlownDrone) -> float:
    """bench.control_flown kills or stops the tower for all drones."""
    return drone.operator.now


TRIGGERS: Final = (
    Trigger("take", _take),
    Trigger("browser gone", _browser_gone, operator_stays=False),
    Trigger("tab silent", _tab_silent, operator_stays=False),
    Trigger("give and accept", _give_and_accept, old_holder=None),
    Trigger("release", _release),
    Trigger("agent killed", _kill_agent),
    Trigger("agent restarted", _restart_agent),
    Trigger("tower killed", _tower_killed, old_holder=None, tower=TowerEnds.KILLED),
)

BESIDE: Final = (
    Trigger("early restart", _restart_agent_early),
    Trigger("transmitter lost", _transmitter_lost),
    Trigger("killed by hand", _kill_agent_by_hand, foretold=True),
)
"""Flown only when named."""

ON_LINE: Final = (Trigger("line cut", _tower_killed, old_holder=None, tower=TowerEnds.SILENT),)
"""Flown with PX4, and by name."""
