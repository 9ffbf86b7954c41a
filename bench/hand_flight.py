"""Manual flight for a benchmark: up to a height, back to the start, full stick one way."""

from __future__ import annotations

from dataclasses import dataclass

from bench.person import Person, Refused, Sticks
from bench.rig import HOME, Rig, wait_for
from bench.tap import Tap
from wire.dialect import mavlink

HEIGHT_M = 30.0
SET_MODE, ARM = mavlink.MAV_CMD_DO_SET_MODE, mavlink.MAV_CMD_COMPONENT_ARM_DISARM
TAKE_OFF, GO_TO = mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_DO_REPOSITION
AMSL_FRAME = 0
THROTTLE_DOWN = Sticks(z=0)


@dataclass(frozen=True, slots=True)
class Modes:
    """The parameters of DO_SET_MODE (param2, param3), and the resulting mode in the heartbeat."""

    by_hand: tuple[int, int]
    guided: tuple[int, int]
    altitude_hold: tuple[int, int]
    position_hold: str
    """As named in the hold ladder."""
    position_number: tuple[int, int]
    shift: bool
    take_off_height_is_amsl: bool

    def number(self, mode: tuple[int, int]) -> int:
        return mode[0] << 16 | mode[1] << 24 if self.shift else mode[0]


MODES = {
    "ardupilot": Modes((5, 0), (4, 0), (2, 0), "BRAKE", (17, 0), False, False),
    "px4": Modes((3, 0), (4, 3), (2, 0), "AUTO.LOITER", (4, 3), True, True),
}

AXES = {
    "roll right": Sticks(y=1000),
    "roll left": Sticks(y=-1000),
    "pitch forward": Sticks(x=1000),
    "pitch back": Sticks(x=-1000),
    "yaw right": Sticks(r=1000),
    "climb": Sticks(z=1000),
    "descend": Sticks(z=0),
    "all at once": Sticks(x=1000, y=-1000, z=1000, r=1000),
}


class HandFlight:
    """The operator's flying. The stick stream pauses only in trials about that."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self.modes = MODES[rig.kind.flavour]

    @property
    def pilot(self) -> Person:
        return self._rig.operator

    @property
    def tap(self) -> Tap:
        return self._rig.tap

    def in_mode(self, *modes: tuple[int, int]) -> bool:
        numbers = [self.modes.number(mode) for mode in modes]
        return bool(self.tap.modes) and self.tap.modes[-1].custom_mode in numbers

    async def change_mode(self, mode: tuple[int, int], by: Person | None = None) -> None:
        """Requests the mode every second until the autopilot reports it; as the operator unless `by` is given."""
        number, asked_at = self.modes.number(mode), 0.0
        pilot = by or self.pilot

        async def done() -> bool:
            nonlocal asked_at
            if self.in_mode(mode):
                return True
            if pilot.now - asked_at > 1.2:
                asked_at = pilot.now
                await pilot.command(SET_MODE, 1, *mode)
            return False

        await wait_for(f"mode {number}", done, 20)

    async def take_off(self) -> None:
        pilot, tap = self.pilot, self.tap
        await pilot.control("acquire")
        pilot.sticks = Sticks()
        await self._acknowledge_loss()
        asked_at = 0.0

        async def flying() -> bool:
            nonlocal asked_at
            # Throttle down arms with every receiver and without one; in the air centred sticks hold.
            pilot.sticks = Sticks() if tap.modes and tap.modes[-1].armed else THROTTLE_DOWN
            if tap.motions and tap.motions[-1].alt_m > 2.0:
                return True
            if pilot.now - asked_at > 2.0:
                asked_at = pilot.now
                height_m = HEIGHT_M + (HOME[2] if self.modes.take_off_height_is_amsl else 0.0)
                if not self.modes.take_off_height_is_amsl:
                    await pilot.command(SET_MODE, 1, *self.modes.guided)
                    await pilot.command(ARM, 1)
                    await pilot.command(TAKE_OFF, 0, 0, 0, 0, 0, 0, height_m)
                else:
                    await pilot.command(TAKE_OFF, 0, 0, 0, 0, 0, 0, height_m)
                    await pilot.command(ARM, 1)
            return False

        await wait_for(f"the take-off ({tap.texts[-3:]})", flying, 120)
        await wait_for("the height", lambda: abs(tap.motions[-1].alt_m - HEIGHT_M) < 1.0, 120)

    async def _acknowledge_loss(self) -> None:
        async def complete() -> bool:
            try:
                check = await self.pilot.ask("GET", "/drones/1/loss-check")
            except Refused:
                return True  # a tower without a loss check
            return bool(check["complete"])

        await wait_for("the loss check to be complete", complete, 30)
        try:
            name = (await self.pilot.drone())["name"]
            await self.pilot.ask("POST", "/drones/1/loss-check/acknowledge", {"drone": name})
        except Refused:
            return

    async def back_to_start(self) -> None:
        """Flies guided to the middle of the field at HEIGHT_M, then by hand with centred sticks."""
        pilot, tap = self.pilot, self.tap
        pilot.sticks = Sticks()
        await self.change_mode(self.modes.guided)
        x, y = round(HOME[0] * 1e7), round(HOME[1] * 1e7)

        async def there() -> bool:
            last = tap.motions[-1]
            near = abs(last.north_m) < 3 and abs(last.east_m) < 3 and abs(last.alt_m - HEIGHT_M) < 0.5
            if near and last.speed_mps < 0.3:
                return True
            if pilot.now - asked[0] > 2.0:
                asked[0] = pilot.now
                height = HOME[2] + HEIGHT_M
                await pilot.send(
                    mavlink.MAVLink_command_int_message(1, 1, AMSL_FRAME, GO_TO, 0, 0, -1, 1, 0, 0, x, y, height)
                )
            return False

        asked = [0.0]
        await wait_for("the way back to the start", there, 120)
        await self.by_hand()

    async def by_hand(self, mode: tuple[int, int] | None = None) -> None:
        self.pilot.sticks = Sticks()
        await self.change_mode(mode or self.modes.by_hand)

    async def full_stick(self, sticks: Sticks, seconds: float) -> None:
        """Holds full stick long enough that the vehicle reaches its top speed, and keeps it there."""
        pilot = self.pilot
        until = pilot.now + seconds
        pilot.sticks = sticks
        await wait_for("full stick for a while", lambda: pilot.now >= until, seconds + 5)
