"""The command line of running vehicles: words in, text out. `shell_socket` is its line, `attached_terminal` the other
end.

It has the commands of `firmware.shell` over ArduCopter's or PX4's modes, and arms through the commander as everybody
does. Commands that would change the machine under way are active in SYS_SAFE only.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum

from simulator.airframe_model import AirframeModel
from simulator.command_message import ACCEPTED, read_command
from simulator.dialect import mavlink
from simulator.firmware.command_set import MAX_DISPLAY_LINES, ShellCommand, ShellRefused, carry_out, help_of, whole
from simulator.firmware.fault_table import TABLE, FaultName
from simulator.firmware.states import SystemState
from simulator.flight import Flight
from simulator.flight_commander import PERIOD_S
from simulator.flight_constants import TICK_S
from simulator.vehicle import Vehicle

UP_M = 10.0
AUTO_MODES: Mapping[str, tuple[str, ...]] = {
    "hover": ("TAKEOFF", "GUIDED"),
    "land": ("LAND",),
    "return": ("RTL",),
    "mission": ("AUTO", "MISSION"),
}
HOLD_MODES = ("GUIDED", "LOITER")
MANUAL_MODES = ("ALT_HOLD", "ALTCTL")
"""On ArduCopter or PX4: the first that there is."""


class VehicleShell:
    """One terminal, at one of the vehicles of a process. `clocks`: seconds passed, and of processor time."""

    def __init__(self, vehicles: Sequence[Vehicle], clocks: tuple[Callable[[], float], Callable[[], float]]) -> None:
        if any(vehicle.flight.commander is None for vehicle in vehicles):
            raise ValueError("a shell needs vehicles with a commander")
        self._vehicles = vehicles
        self._index = 0
        self._clocks = clocks
        self._since = self._read_clocks()
        self._displays = 0
        self._display_due_s = 0.0

    @property
    def vehicle(self) -> Vehicle:
        return self._vehicles[self._index]

    @property
    def _flight(self) -> Flight:
        return self.vehicle.flight

    @property
    def state(self) -> SystemState:
        commander = self._flight.commander
        assert commander is not None
        return commander.state

    def step(self) -> list[str]:
        """Called after each step of the vehicles. Returns the repeated display when it is due."""
        if not self._displays or self._flight.now_s < self._display_due_s:
            return []
        self._displays -= 1
        self._display_due_s = self._flight.now_s + 1.0
        return [self._display_line()]

    def execute(self, line: str) -> str:
        """Returns the answer; a refusal begins with `refused:`."""
        try:
            return carry_out(self, COMMANDS, self.state, line)
        except ShellRefused as error:
            return f"refused: {error}"

    def _help(self, _words: list[str]) -> str:
        return help_of(COMMANDS)

    def _vehicle(self, words: list[str]) -> str:
        if words:
            self._index = whole(words[0], 1, len(self._vehicles)) - 1
            self._displays = 0
        return f"vehicle {self._index + 1} of {len(self._vehicles)}: {self.state}"

    def _info(self, _words: list[str]) -> str:
        settings, setup = self.vehicle.settings, self._flight.setup
        faults = ", ".join(name for name in FaultName if TABLE[name].failure in self.vehicle.failures)
        lines = [
            f"{settings.flavour.banner[0]}, sysid {settings.system_id}",
            f"{self.state}, mode {self._flight.mode.name}, model {settings.flight.model}, seed {settings.flight.seed}",
            self._flight.why_not_ready() or "ready",
        ]
        if faults:
            lines.append(f"faults: {faults}")
        if setup.compass_runs:
            lines.append(f"compass calibration: {setup.percent(self._flight.now_s)} %")
        return "\n".join(lines)

    def _top(self, _words: list[str]) -> str:
        """Since the last one."""
        passed_s, busy_s = (now - then for now, then in zip(self._read_clocks(), self._since, strict=True))
        self._since = self._read_clocks()
        share = 100.0 * busy_s / passed_s if passed_s > 0.0 else 0.0
        many = len(self._vehicles)
        return f"up {self._flight.now_s:.1f} s; {share:.1f} % of a core for {many} vehicles in {passed_s:.1f} s"

    def _tasks(self, _words: list[str]) -> str:
        rates = {"sensors, modes, control": 1.0 / TICK_S, "commander": 1.0 / PERIOD_S}
        for message_id, interval_s in sorted(self.vehicle.intervals_s.items()):
            rates[mavlink.mavlink_map[message_id].msgname] = 1.0 / interval_s
        return "\n".join(f"{name:30} {rate:6.1f} Hz" for name, rate in rates.items())

    def _display(self, words: list[str]) -> str:
        """Once, or so many times, a second apart."""
        times = whole(words[0], 1, MAX_DISPLAY_LINES) if words else 1
        self._displays, self._display_due_s = times - 1, self._flight.now_s + 1.0
        return self._display_line()

    def _display_line(self) -> str:
        flight, body = self._flight, self._flight.body
        roll, pitch, yaw = map(math.degrees, body.attitude())
        return (
            f"{flight.now_s:8.2f} s {self.state:14} {flight.mode.name:10} N {body.north_m:7.2f} E {body.east_m:7.2f} "
            f"up {flight.alt_over_home_m():6.2f} m  roll {roll:6.1f} pitch {pitch:6.1f} yaw {yaw:6.1f}  "
            f"{flight.battery.voltage_v:.2f} V"
        )

    def _arm(self, _words: list[str]) -> str:
        self._arm_now()
        return f"armed: {self.state}"

    def _auto(self, words: list[str]) -> str:
        name = words[0] if words else "hover"
        if name not in AUTO_MODES:
            raise ShellRefused(f"no flight {name!r}; one of {', '.join(AUTO_MODES)}")
        flight = self._flight
        if name == "hover" and not flight.landed:
            self._change(HOLD_MODES)
        elif name == "hover":
            self._take_off()
        elif not flight.armed:
            raise ShellRefused("not armed")
        else:
            self._change(AUTO_MODES[name])
        return f"{name}: {self.state}, mode {flight.mode.name}"

    def _take_off(self) -> None:
        flight = self._flight
        self._change(AUTO_MODES["hover"])
        self._arm_now()
        if not flight.flying.take_off(UP_M):
            raise ShellRefused("it does not take off")

    def _manual(self, _words: list[str]) -> str:
        self._change(MANUAL_MODES)
        self._arm_now()
        return f"{self.state}, mode {self._flight.mode.name}"

    def _calibrate(self, words: list[str]) -> str:
        """As a ground station does it. ArduCopter keeps a compass only when it is told to, and wants a reset then."""
        if words not in ([], ["keep"]):
            raise ShellRefused("calibrate [keep]")
        own = mavlink.MAV_CMD_DO_ACCEPT_MAG_CAL if words else mavlink.MAV_CMD_DO_START_MAG_CAL
        if own in self.vehicle.settings.flavour.handlers:
            answer = self._command(own)
        elif words:
            raise ShellRefused("this autopilot keeps it by itself")
        else:
            answer = self._command(mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, 0, 1)
        if answer != ACCEPTED:
            raise ShellRefused(self._last_text() or "the autopilot does not")
        return "kept; reset now" if words else "compass calibration started; info shows it"

    def _stop(self, _words: list[str]) -> str:
        if self._flight.armed and not self._flight.landed:
            raise ShellRefused("it is in the air; auto land")
        self._flight.disarm()
        return f"{self.state}"

    def _reset(self, _words: list[str]) -> str:
        self.vehicle.restart_soon()
        return "it restarts"

    def _fault(self, words: list[str]) -> str:
        if not words or words[0] not in set(FaultName) or words[1:] not in ([], ["off"]):
            raise ShellRefused(f"fault NAME [off], NAME one of {', '.join(FaultName)}")
        name = FaultName(words[0])
        row = TABLE[name]
        if words[1:]:
            self.vehicle.failures.discard(row.failure)
            return f"{name} ended"
        if row.needs_sensors and self.vehicle.settings.flight.model is AirframeModel.EXACT:
            raise ShellRefused(f"{name} needs --model sensing")
        self.vehicle.failures.add(row.failure)
        return f"{name}: {row.alert or 'no fault in automatic flight'}"

    # How it is done.

    def _arm_now(self) -> None:
        if not self._flight.arm():
            raise ShellRefused(self._last_text())

    def _change(self, names: tuple[str, ...]) -> None:
        if not self._flight.set_mode(self._mode(names)):
            raise ShellRefused(self._last_text())

    def _mode(self, names: tuple[str, ...]) -> IntEnum:
        by_name = {mode.name: mode for mode in self.vehicle.settings.flavour.rules}
        return next(by_name[name] for name in names if name in by_name)

    def _last_text(self) -> str:
        """A refusal gives its reason in a notice, which goes to the ground station as well."""
        notices = self._flight.notices
        return notices[-1].text if notices else ""

    def _command(self, number: int, *params: float) -> int:
        seven = (*params, *([0.0] * (7 - len(params))))
        message = mavlink.MAVLink_command_long_message(1, 1, number, 0, *seven)
        return self.vehicle.settings.flavour.carry_out(self._flight, read_command(message))

    def _read_clocks(self) -> tuple[float, float]:
        passed, busy = self._clocks
        return passed(), busy()


COMMANDS: Mapping[str, ShellCommand[VehicleShell]] = {
    "help": ShellCommand(VehicleShell._help, "this"),
    "vehicle": ShellCommand(VehicleShell._vehicle, "vehicle [N]: which one the commands are for"),
    "info": ShellCommand(VehicleShell._info, "autopilot, state, mode, what keeps it from arming, faults"),
    "top": ShellCommand(VehicleShell._top, "time since the start, and what this process costs since the last top"),
    "tasks": ShellCommand(VehicleShell._tasks, "what runs and what is sent how often"),
    "display": ShellCommand(VehicleShell._display, "display [N]: the state once, or N times a second apart"),
    "arm": ShellCommand(VehicleShell._arm, "arm in the present mode", safe_only=True),
    "auto": ShellCommand(VehicleShell._auto, f"auto [{'|'.join(AUTO_MODES)}]: fly by itself; hover arms"),
    "manual": ShellCommand(VehicleShell._manual, "arm for flight by sticks that hold the height, or change to it"),
    "stop": ShellCommand(VehicleShell._stop, "disarm on the ground"),
    "calibrate": ShellCommand(VehicleShell._calibrate, "calibrate [keep]: calibrate the compass", safe_only=True),
    "reset": ShellCommand(VehicleShell._reset, "switch off and on", safe_only=True),
    "fault": ShellCommand(VehicleShell._fault, "fault NAME [off]"),
}
