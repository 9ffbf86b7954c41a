"""What a PX4 of the flown table does when its pilot is lost. The triggers are those of bench.control_situations."""

from __future__ import annotations

import asyncio
import contextlib
from typing import Any, Final

from bench.control_situations import HEIGHT_M, LOW_HEIGHT_M, NEAR_GROUND_M, Situation, climb, descend, hover
from bench.person import Refused, Sticks
from bench.real_px4 import RealPx4
from bench.rig import HOME, wait_for
from bench.squadron import FlownDrone
from wire.dialect import mavlink

SET_MODE: Final = mavlink.MAV_CMD_DO_SET_MODE
POSCTL, OFFBOARD = (3, 0), (6, 0)
LOITER, MISSION, RTL = (4, 3), (4, 4), (4, 5)
WITHOUT_RECEIVER: Final = {"NAV_RCL_ACT": 2, "COM_RCL_EXCEPT": 7, "COM_OBL_RC_ACT": 5}
"""What the console sets, except the source of the sticks."""
ASK_AGAIN_S: Final = 1.2
SET_POINT_S: Final = 0.05
_VELOCITY_ONLY: Final = 0b0000_1101_1100_0111
"""type_mask: velocity counts, and the rate of yaw does not."""
_FAST_M_S: Final = 5.0


def _number(mode: tuple[int, int]) -> int:
    return mode[0] << 16 | mode[1] << 24


async def set_up_px4(drone: FlownDrone, stick_source: int) -> None:
    """Writes the console's set-up, and which sticks count, at its station's port."""
    assert isinstance(drone.autopilot, RealPx4)
    station = drone.autopilot.station
    for name, value in {**WITHOUT_RECEIVER, "COM_RC_IN_MODE": stick_source}.items():
        await station.set_whole(name, value)


async def set_mode(drone: FlownDrone, mode: tuple[int, int]) -> None:
    """The operator requests the mode repeatedly until the autopilot reports it."""
    asked_at = 0.0

    async def shown() -> bool:
        nonlocal asked_at
        if drone.tap.modes and drone.tap.modes[-1].custom_mode == _number(mode):
            return True
        if drone.operator.now - asked_at > ASK_AGAIN_S:
            asked_at = drone.operator.now
            await drone.operator.command(SET_MODE, 1, *mode)
        return False

    await wait_for(f"mode {mode}", shown, 20)


async def fly_px4(drone: FlownDrone, situation: Situation) -> None:
    """Takes off to the height of the situation, and flies by hand if it is flown so."""
    pilot, tap = drone.operator, drone.tap
    await drone.order(pilot, "acquire")
    await drone.acknowledge_losses()
    pilot.sticks = Sticks() if situation.by_hand else None

    async def climbing() -> bool:
        with contextlib.suppress(Refused):
            if not tap.modes[-1].armed:
                await command(drone, "takeoff", height_m=situation.height_m)
        return bool(tap.motions and tap.motions[-1].alt_m > 1.0)

    await wait_for("the take-off", climbing, 60)
    await wait_for("the height", lambda: tap.motions[-1].alt_m > situation.height_m - 1.0, 60)
    await set_mode(drone, POSCTL if situation.by_hand else LOITER)
    await asyncio.sleep(1.5)


async def command(drone: FlownDrone, name: str, **body: Any) -> Any:
    return await drone.operator.ask("POST", f"/drones/{drone.drone_id}/commands", {"command": name, **body})


async def _forward(drone: FlownDrone) -> None:
    drone.operator.sticks = Sticks(x=1000)
    await wait_for("5 m/s", lambda: drone.tap.motions[-1].speed_mps > _FAST_M_S, 20)


async def _near_ground(drone: FlownDrone) -> None:
    drone.operator.sticks = Sticks(z=0)
    await wait_for("the ground to be near", lambda: drone.tap.motions[-1].alt_m < NEAR_GROUND_M, 30)


async def _loiter(drone: FlownDrone) -> None:
    await asyncio.sleep(1.0)


async def _auto(drone: FlownDrone) -> None:
    await set_mode(drone, MISSION)
    await asyncio.sleep(4.0)


async def _rtl(drone: FlownDrone) -> None:
    await set_mode(drone, RTL)
    await asyncio.sleep(3.0)


async def _go_to(drone: FlownDrone) -> None:
    await command(drone, "goto", lat=HOME[0] + 0.004, lon=HOME[1], height_m=HEIGHT_M)
    await wait_for("the way", lambda: drone.tap.motions[-1].speed_mps > 2.0, 20)


async def _off_board(drone: FlownDrone) -> None:
    """Sends set-points as a program does, until the pilot is lost: the operator's browser carries them."""

    async def stream() -> None:
        # Ends with the connection, and when the tower lets nothing of this operator pass any more.
        with contextlib.suppress(Exception):
            while True:
                await drone.operator.send(
                    mavlink.MAVLink_set_position_target_local_ned_message(
                        0, 1, 1, mavlink.MAV_FRAME_LOCAL_NED, _VELOCITY_ONLY, 0, 0, 0, 2.0, 0, 0, 0, 0, 0, 0, 0
                    )
                )
                await asyncio.sleep(SET_POINT_S)

    drone.keep(asyncio.create_task(stream()))
    await asyncio.sleep(1.5)
    await set_mode(drone, OFFBOARD)
    await asyncio.sleep(3.0)


PX4_SITUATIONS: Final = (
    Situation("hover", hover),
    Situation("full climb", climb),
    Situation("full descent", descend, brief=True),
    Situation("full forward", _forward),
    Situation("near the ground", _near_ground, LOW_HEIGHT_M, brief=True),
    Situation("LOITER", _loiter, by_hand=False),
    Situation("AUTO", _auto, mission=True, by_hand=False),
    Situation("RTL", _rtl, by_hand=False),
    Situation("go-to", _go_to, by_hand=False),
    Situation("OFFBOARD", _off_board, by_hand=False),
)
