"""The command line of a flight controller: words in, text out. `firmware.command_line` is its terminal.

Commands that would change the machine under way are active in SYS_SAFE only.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np

from simulator.control.figure_of_eight import EightFlight, FigureOfEight
from simulator.control.reference import Reference, Way
from simulator.control.trajectory import PlanLimits, Trajectory, WayPoint, plan
from simulator.firmware import faults
from simulator.firmware.calibration_flight import calibrate
from simulator.firmware.command_set import MAX_DISPLAY_LINES, ShellCommand, ShellRefused, carry_out, help_of, whole
from simulator.firmware.commander import RequestRefused
from simulator.firmware.controller import COMMANDER_S, Fleet
from simulator.firmware.fault_plan import FaultPlan
from simulator.firmware.fault_table import TABLE, FaultName
from simulator.firmware.states import SystemState
from simulator.physics.rotation import to_euler
from simulator.sensors import barometer, magnetometer, satellites
from simulator.sensors.magnetometer_calibration import CalibrationRefused

UP_M = 10.0


class Shell:
    """Of the first vehicle of a fleet. `advance` moves the time on; commands act at once."""

    def __init__(self, fleet: Fleet, make_fleet: Callable[[], Fleet], fault_plan: FaultPlan | None = None) -> None:
        self.fleet = fleet
        self._make_fleet = make_fleet
        self._faults = fault_plan or FaultPlan()
        self._way: Way | None = None
        self._way_from_s = 0.0
        self._busy_s = 0.0
        self._flown_s = 0.0
        self._displays = 0
        self._display_due_s = 0.0
        self.on_step: Callable[[Fleet], object] = lambda fleet: None
        """Called after each step: a log."""

    @property
    def state(self) -> SystemState:
        return self.fleet.commanders[0].state

    # Time.

    def advance(self, seconds: float, clock: Callable[[], float] = time.process_time) -> list[str]:
        """Returns the lines that came up meanwhile: notices of the commander, and repeated displays."""
        lines: list[str] = []
        began, end_s = clock(), self.fleet.now_s + seconds
        while self.fleet.now_s < end_s - 1e-9:
            self._faults.apply(self.fleet)
            self.fleet.step(self._reference())
            self.on_step(self.fleet)
            notices = self.fleet.commanders[0].texts
            while notices:
                lines.append(f"[{self.fleet.now_s:.2f}] {notices.popleft().text}")
            if self._displays and self.fleet.now_s >= self._display_due_s:
                self._displays -= 1
                self._display_due_s = self.fleet.now_s + 1.0
                lines.append(self._display_line())
        self._busy_s += clock() - began
        self._flown_s += seconds
        return lines

    def _reference(self) -> Reference | None:
        if self._way is None or not self.fleet.armed[0]:
            return None
        return self._way.at(self.fleet.now_s - self._way_from_s)

    # Commands.

    def execute(self, line: str) -> str:
        """Returns the answer; a refusal begins with `refused:`."""
        try:
            return carry_out(self, _COMMANDS, self.state, line)
        except (ShellRefused, RequestRefused, CalibrationRefused) as error:
            return f"refused: {error}"

    def _help(self, _words: list[str]) -> str:
        return help_of(_COMMANDS)

    def _info(self, _words: list[str]) -> str:
        design, health = self.fleet.design, self.fleet.commanders[0].health
        sensors = ", ".join(
            f"{s.value}{'' if s in health.calibrated else ' (not calibrated)'}" for s in sorted(health.present)
        )
        return (
            f"frame {design.frame}, {design.mass_kg:.2f} kg, full thrust {4 * design.full_thrust_n:.1f} N\n"
            f"{self.state}, step {self.fleet.dt_s * 1000:g} ms, seed {self.fleet.settings.seed}\n{sensors}"
        )

    def _top(self, _words: list[str]) -> str:
        share = 100.0 * self._busy_s / self._flown_s if self._flown_s else 0.0
        return f"up {self.fleet.now_s:.1f} s; {share:.1f} % of a core at real time"

    def _tasks(self, _words: list[str]) -> str:
        step_hz = 1.0 / self.fleet.dt_s
        rates = {
            "inertial sensors": step_hz,
            "filter, carried on": step_hz,
            "attitude and position control": step_hz,
            "compass": magnetometer.RATE_HZ,
            "barometer": barometer.RATE_HZ,
            "GPS": satellites.RATE_HZ,
            "commander": 1.0 / COMMANDER_S,
        }
        return "\n".join(f"{name:30} {rate:6.1f} Hz" for name, rate in rates.items())

    def _display(self, words: list[str]) -> str:
        """Once, or so many times, a second apart."""
        times = whole(words[0], 1, MAX_DISPLAY_LINES) if words else 1
        self._displays, self._display_due_s = times - 1, self.fleet.now_s + 1.0
        return self._display_line()

    def _display_line(self) -> str:
        state, battery = self.fleet.filter.state, self.fleet.board.batteries
        north, east, down = state.position_m[:, 0]
        roll, pitch, yaw = np.degrees(to_euler(state.attitude)[:, 0])
        return (
            f"{self.fleet.now_s:8.2f} s {self.state:14} N {north:7.2f} E {east:7.2f} up {-down:6.2f} m  "
            f"roll {roll:6.1f} pitch {pitch:6.1f} yaw {yaw:6.1f}  {battery.voltage_v[0]:.2f} V"
        )

    def _arm(self, _words: list[str]) -> str:
        self.fleet.arm()
        return f"armed: {self.state}"

    def _auto(self, words: list[str]) -> str:
        """A climb, a square or an eight: flown at once if armed, else after the arming."""
        name = words[0] if words else "hover"
        if name not in WAYS:
            raise ShellRefused(f"no flight {name!r}; one of {', '.join(WAYS)}")
        if self._way is not None and self.fleet.armed[0] and name != "land":
            raise ShellRefused("it flies already; auto land first")
        if name == "land":
            if not self.fleet.armed[0]:
                raise ShellRefused("not armed")
            here = self._reference()
            way = Trajectory(here.position_m if here is not None else np.zeros(3))
            way.land(PlanLimits())
            self._way = way
        else:
            self.fleet.commanders[0].auto()
            self.fleet.arm()
            self._way = WAYS[name]()
        self._way_from_s = self.fleet.now_s
        return f"{name}: {self.state}"

    def _manual(self, _words: list[str]) -> str:
        """Without sticks of its own the shell lets a vehicle on the ground idle, and one in the air stay."""
        self.fleet.commanders[0].run_manual()
        return f"{self.state}"

    def _calibrate(self, _words: list[str]) -> str:
        self.fleet.arm()
        calibration = calibrate(self.fleet)
        offset = ", ".join(f"{value:.3f}" for value in calibration.offset_gauss[:, 0])
        return f"compass calibrated in flight: offsets {offset} gauss"

    def _stop(self, _words: list[str]) -> str:
        if self.fleet.armed[0] and not self.fleet.landed[0]:
            raise ShellRefused("it is in the air; auto land")
        self.fleet.stop()
        self._way = None
        return f"{self.state}"

    def _reset(self, _words: list[str]) -> str:
        self.fleet, self._way = self._make_fleet(), None
        self._faults.restart()
        return f"{self.state}"

    def _fault(self, words: list[str]) -> str:
        known = ", ".join(FaultName)
        if not words or words[0] not in set(FaultName):
            raise ShellRefused(f"fault NAME [off], NAME one of {known}")
        name = FaultName(words[0])
        if words[1:] == ["off"]:
            faults.end(self.fleet, name)
            return f"{name} ended"
        faults.begin(self.fleet, name)
        return f"{name}: {TABLE[name].alert or 'no fault in automatic flight'}"


def _square() -> Trajectory:
    corners = [WayPoint(10, 0, UP_M), WayPoint(10, 10, UP_M), WayPoint(0, 10, UP_M), WayPoint(0, 0, UP_M)]
    return plan(corners, take_off_m=UP_M, pause_s=1.0)


WAYS: Mapping[str, Callable[[], Way]] = {
    "hover": lambda: plan([], take_off_m=UP_M, land=False),
    "square": _square,
    "eight": lambda: EightFlight(FigureOfEight(8.0, 14.0, UP_M)),
    "land": lambda: plan([], take_off_m=UP_M),
}

_COMMANDS: Mapping[str, ShellCommand[Shell]] = {
    "help": ShellCommand(Shell._help, "this"),
    "info": ShellCommand(Shell._info, "frame, mass, state, sensors"),
    "top": ShellCommand(Shell._top, "time since the start, and what it costs"),
    "tasks": ShellCommand(Shell._tasks, "what runs how often"),
    "display": ShellCommand(Shell._display, "display [N]: the state once, or N times a second apart"),
    "arm": ShellCommand(Shell._arm, "arm for automatic flight", safe_only=True),
    "auto": ShellCommand(Shell._auto, f"auto [{'|'.join(WAYS)}]: arm and fly"),
    "manual": ShellCommand(Shell._manual, "arm for flight by hand, or change to it"),
    "stop": ShellCommand(Shell._stop, "disarm on the ground"),
    "calibrate": ShellCommand(Shell._calibrate, "fly the calibration of the compass", safe_only=True),
    "reset": ShellCommand(Shell._reset, "switch off and on", safe_only=True),
    "fault": ShellCommand(Shell._fault, "fault NAME [off]"),
}
