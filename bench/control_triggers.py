"""The events that can end manual flight, each as a function that triggers it, and one that undoes it.

`pull` triggers it and returns the time (the loop's clock); `mend` gives the controls back to the operator, with a
stream of centred sticks.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from bench.link_model import Profile
from bench.person import Sticks
from bench.rig import PASSWORD, SLOW, Rig, wait_for
from bench.tap import OPERATOR


@dataclass(frozen=True, slots=True)
class Trigger:
    name: str
    pull: Callable[[Rig], Awaitable[float]]
    mend: Callable[[Rig], Awaitable[None]]
    old_holder: int | None = OPERATOR
    """The holder whose sticks must not arrive afterwards; None if the holder does not change."""
    reported: bool = True
    """Whether the tower survives to notify the admin."""
    needs_usual_limits: bool = False
    """For the round trip."""
    needs_line: bool = False
    """Only with a network between tower and drone."""


async def _take(rig: Rig) -> float:
    at = rig.admin.now
    rig.admin.sticks = Sticks()
    await rig.admin.control("take")
    return at


async def _give_and_accept(rig: Rig) -> None:
    rig.operator.sticks = Sticks()
    drone = await rig.admin.drone()
    if drone["holder"] is None or drone["holder"]["name"] != "operator":
        if not drone.get("offered"):
            drone = await rig.admin.control("give")
        if drone["holder"]["name"] != "operator":
            await rig.operator.control("accept", sticks_centred=True)
    rig.admin.sticks = None


async def _close_socket(rig: Rig) -> float:
    at = rig.operator.now
    await rig.operator.vanish()
    return at


async def _back_online(rig: Rig) -> None:
    rig.operator.sticks = Sticks()
    await rig.operator.go_live()
    await _hold_the_controls(rig)


async def _hold_the_controls(rig: Rig) -> None:
    drone = await rig.operator.drone()
    if drone["holder"] is None:
        await rig.operator.control("acquire")


async def _stop_sticks(rig: Rig) -> float:
    at = rig.operator.now
    rig.operator.sticks = None
    return at


async def _sticks_again(rig: Rig) -> None:
    rig.operator.sticks = Sticks()


async def _answer_late(rig: Rig) -> float:
    rig.operator.pong_delay_s = 0.8
    return rig.operator.now


async def _answer_in_time(rig: Rig) -> None:
    rig.operator.pong_delay_s = 0.0
    rig.operator.sticks = Sticks()


async def _prove(rig: Rig) -> None:
    """A change of accounts needs a proof from the last five minutes."""
    await rig.admin.ask("POST", "/session/proof", {"kind": "password", "password": PASSWORD})


async def _disable(rig: Rig) -> float:
    await _prove(rig)
    at = rig.admin.now
    await rig.admin.ask("PATCH", f"/users/{await _operator_id(rig)}", {"disabled": True})
    return at


async def _enable(rig: Rig) -> None:
    await rig.operator.vanish()
    await rig.admin.ask("PATCH", f"/users/{await _operator_id(rig)}", {"disabled": False})
    await rig.operator.sign_in(PASSWORD)
    await _back_online(rig)


async def _operator_id(rig: Rig) -> int:
    return next(int(user["id"]) for user in await rig.admin.ask("GET", "/users") if user["name"] == "operator")


async def _kill_tower(rig: Rig) -> float:
    at = rig.operator.now
    rig.tower.kill()
    await rig.tower.wait()
    return at


async def _new_tower(rig: Rig) -> None:
    for person in (rig.operator, rig.admin):
        await person.vanish()
    await rig.start_tower()
    await asyncio.gather(rig.admin.go_live(), rig.operator.go_live())

    async def online() -> bool:
        return bool((await rig.admin.drone())["online"])

    await wait_for("the drone to be online again", online)
    rig.operator.sticks = Sticks()
    await _hold_the_controls(rig)


async def _cut_line(rig: Rig) -> float:
    at = rig.operator.now
    await rig.change_line(Profile(black_out=True))
    return at


async def _mend_line(rig: Rig) -> None:
    rig.operator.sticks = Sticks()
    await rig.change_line(SLOW)

    async def online() -> bool:
        return bool((await rig.admin.drone())["online"])

    await wait_for("the drone to be online again", online)
    await _hold_the_controls(rig)


TAKE = Trigger("take", _take, _give_and_accept)

OTHERS = (
    Trigger("socket closed", _close_socket, _back_online),
    Trigger("sticks stop", _stop_sticks, _sticks_again, old_holder=None),
    Trigger("late answers to pings", _answer_late, _answer_in_time, old_holder=None, needs_usual_limits=True),
    Trigger("account disabled", _disable, _enable),
    Trigger("line cut", _cut_line, _mend_line, reported=False, needs_line=True),
    Trigger("tower killed", _kill_tower, _new_tower, old_holder=None, reported=False),
)
