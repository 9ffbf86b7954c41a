"""Every pilot command by every way to give it: the same result, and one audit row with the response.

The ways: the console (its requests, and its frame for a hold), a program with a token (REST), and a ground station
behind `tower connect`. One flight for each way, in a world of real programs with one simulator for each autopilot.
"""

import asyncio
import math
import socket
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

import pytest
from command_answers import end_of, is_on_the_ground
from worlds.pilot import Pilot, at_the_controls
from worlds.processes import Visitor, World, free_udp_ports, wait_for

from server.control.core.loan_limits import Home
from wire.autopilots import arducopter, px4_multicopter
from wire.autopilots.commands import CommandTable
from wire.autopilots.profile import AutopilotProfile, FlightMode, mode_named
from wire.dialect import build, mavlink

M: Final = mavlink
NAN: Final = float("nan")
LAT, LON = 47.3979, 8.5457
HEIGHT_M = 12.0
ABOVE_SEA, ABOVE_HOME = M.MAV_FRAME_GLOBAL, M.MAV_FRAME_GLOBAL_RELATIVE_ALT
MISSION = [
    [22, 3, [0, 0, 0, None], 473977000, 85456000, HEIGHT_M, 1],
    *([16, 3, [0, 0, 0, None], 473980000 + n * 9000, 85456000, HEIGHT_M, 1] for n in range(4)),
]
ACCEPTED = "accepted"
MOTOR: Final = {"motor": 1, "throttle_percent": 5, "for_s": 1, "propellers_off": "Kestrel"}
ELSEWHERE: Final = {"calibration_pose", "gimbal", "reboot"}
"""They need what the autopilot asked before, and end its flight: tests/e2e/test_vehicle_setup.py. The gimbal:
tests/integration/test_camera_commands.py."""


@dataclass(frozen=True)
class Flavour:
    """An autopilot. Its profile decides which commands are flown, into which modes, and which are refused."""

    profile: AutopilotProfile
    chosen: str
    """A mode that can be commanded on the ground."""

    @property
    def name(self) -> str:
        return self.profile.family.name

    @property
    def px4(self) -> bool:
        return self.profile is px4_multicopter.PROFILE

    @property
    def can(self) -> set[str]:
        return {one.name for one in fields(CommandTable) if self.profile.why_not(one.name) is None}

    @property
    def cannot(self) -> set[str]:
        return {one.name for one in fields(CommandTable)} - self.can

    def mode(self, role: str) -> FlightMode:
        """`hold`, `returns`, `land`, `mission`; otherwise the chosen mode."""
        mode = getattr(self.profile.roles, role, None) or mode_named(self.profile.modes, self.chosen)
        assert isinstance(mode, FlightMode)
        return mode

    def place(self, sea_m: float) -> tuple[int, float]:
        """Returns (frame, altitude) for HEIGHT_M above home."""
        return (ABOVE_SEA, sea_m + HEIGHT_M) if self.px4 else (ABOVE_HOME, HEIGHT_M)


ARDUPILOT = Flavour(arducopter.PROFILE, "GUIDED")
PX4 = Flavour(px4_multicopter.PROFILE, "POSCTL")

Frames = Callable[[Flavour, float], list[Any]]
"""Builds messages for a given height of home above sea level."""
Shows = Callable[[Pilot, Flavour], bool]


def long(command: int, *params: float) -> Any:
    return M.MAVLink_command_long_message(1, 1, command, 0, *[*params, *[0.0] * 7][:7])


def of_camera(command: int, *params: float) -> Any:
    return M.MAVLink_command_long_message(1, 100, command, 0, *[*params, *[0.0] * 7][:7])


def at(command: int, frame: int, alt_m: float, *params: float) -> Any:
    p1, p2, p3, p4 = [*params, *[0.0] * 4][:4]
    return M.MAVLink_command_int_message(
        1, 1, frame, command, 0, 0, p1, p2, p3, p4, round(LAT * 1e7), round(LON * 1e7), alt_m
    )


def mode(role: str) -> Frames:
    """Commands the mode of this role as a ground station does."""
    return lambda flavour, sea_m: [long(M.MAV_CMD_DO_SET_MODE, 1, *flavour.mode(role).command_parameters)]


def is_in(role: str) -> Shows:
    return lambda pilot, flavour: pilot.mode == flavour.mode(role).custom_mode


def any_time(pilot: Pilot, flavour: Flavour) -> bool:
    return True


def servo_is(output: int, pulse_us: int) -> Shows:
    """As SERVO_OUTPUT_RAW has it."""
    return lambda pilot, flavour: getattr(pilot.servos, f"servo{output}_raw", 0) == pulse_us


def is_near(pilot: Pilot, flavour: Flavour) -> bool:
    return Home(*pilot.place_deg, 0).distance_m(LAT, LON) < 3.0


@dataclass(frozen=True)
class Case:
    """`body`: of the REST request; `frame`: the ground station's message; `row`: the frame's name in the audit
    trail."""

    body: dict[str, Any]
    frame: Frames
    shows: Shows = any_time
    row: str = ""

    @property
    def name(self) -> str:
        return str(self.body["command"])


def take_off(flavour: Flavour, sea_m: float) -> list[Any]:
    if flavour.px4:
        return [long(M.MAV_CMD_NAV_TAKEOFF, NAN, 0, 0, NAN, NAN, NAN, sea_m + HEIGHT_M)]
    return [long(M.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, HEIGHT_M)]


def cases(flavour: Flavour) -> list[Case]:
    """Returns all that the profile can do, in the order of one flight from take-off to landing."""
    place = {"lat": LAT, "lon": LON, "height_m": HEIGHT_M}
    home = {"lat": LAT, "lon": LON, "altitude_m": 488.0, "while_flying": True}
    moved, grip = (9, 11) if flavour.px4 else (5, 9)
    ardupilot = [
        Case({"command": "turn", "deg": 90}, lambda f, s: [long(M.MAV_CMD_CONDITION_YAW, 90)]),
        Case({"command": "speed", "m_s": 6}, lambda f, s: [long(M.MAV_CMD_DO_CHANGE_SPEED, 1, 6, -1)]),
    ]
    px4 = [
        # A stock program turns a PX4 by a flight to its own position, with a heading in radians.
        Case(
            {"command": "turn", "deg": 90},
            lambda f, s: [at(M.MAV_CMD_DO_REPOSITION, *f.place(s), -1, 1, 0, math.pi / 2)],
            row="goto",
        ),
        Case({"command": "speed", "m_s": 6}, lambda f, s: [long(M.MAV_CMD_DO_CHANGE_SPEED, 1, 6, -1)]),
        Case(
            {"command": "orbit", **place, "radius_m": 20},
            lambda f, s: [at(M.MAV_CMD_DO_ORBIT, *f.place(s), 20, NAN, 0, NAN)],
        ),
    ]
    return [
        Case({"command": "calibrate", "sensor": "gyroscope"}, lambda f, s: [long(M.MAV_CMD_PREFLIGHT_CALIBRATION, 1)]),
        Case({"command": "calibration_end", "keep": False}, _cancel, row="calibrate" if flavour.px4 else ""),
        Case({"command": "motor_test", **MOTOR}, _spin),
        Case(
            {"command": "mode", "mode": flavour.chosen},
            mode("chosen"),
            is_in("chosen"),
        ),
        Case({"command": "arm"}, lambda f, s: [long(M.MAV_CMD_COMPONENT_ARM_DISARM, 1)], lambda p, f: p.armed),
        Case({"command": "takeoff", "height_m": HEIGHT_M}, take_off, lambda p, f: abs(p.altitude_m - HEIGHT_M) < 1),
        Case(
            {"command": "goto", **place},
            lambda f, s: [at(M.MAV_CMD_DO_REPOSITION, *f.place(s), -1, 1, 0, NAN)],
            is_near,
        ),
        *(px4 if flavour.px4 else ardupilot),
        Case({"command": "roi", **place}, lambda f, s: [at(M.MAV_CMD_DO_SET_ROI_LOCATION, *f.place(s))]),
        Case({"command": "roi", "none": True}, lambda f, s: [long(M.MAV_CMD_DO_SET_ROI_NONE)]),
        Case({"command": "servo", "servo": 5, "pulse_us": 1750}, _servo, servo_is(moved, 1750)),
        Case({"command": "gripper", "action": "grab"}, _grip(1), servo_is(grip, 1900)),
        Case({"command": "gripper", "action": "release"}, _grip(0), servo_is(grip, 1100)),
        Case({"command": "zoom", "percent": 30}, lambda f, s: [of_camera(M.MAV_CMD_SET_CAMERA_ZOOM, 2, 30)]),
        Case({"command": "photo"}, lambda f, s: [of_camera(M.MAV_CMD_IMAGE_START_CAPTURE, 0, 0, 1)]),
        Case({"command": "record", "on": True}, lambda f, s: [of_camera(M.MAV_CMD_VIDEO_START_CAPTURE)]),
        Case({"command": "set_home", **home}, lambda f, s: [at(M.MAV_CMD_DO_SET_HOME, ABOVE_SEA, 488.0)]),
        Case({"command": "start"}, mode("mission"), is_in("mission"), row="mode"),
        Case({"command": "jump", "item": 3}, lambda f, s: _jump(f), row="start" if flavour.px4 else "jump"),
        Case({"command": "pause"}, _pause, row="mode" if flavour.px4 else "pause"),
        Case({"command": "resume"}, _resume, row="mode" if flavour.px4 else "resume"),
        Case({"command": "hold"}, mode("hold"), is_in("hold"), row="mode"),
        Case({"command": "rtl"}, mode("returns"), is_in("returns"), row="mode"),
        Case({"command": "land"}, mode("land"), lambda p, f: not p.armed, row="mode"),
        Case(
            {"command": "disarm", "force": True},
            lambda f, s: [long(M.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196)],
            lambda p, f: not p.armed,
        ),
    ]


def _cancel(flavour: Flavour, sea_m: float) -> list[Any]:
    return [long(M.MAV_CMD_PREFLIGHT_CALIBRATION if flavour.px4 else M.MAV_CMD_DO_CANCEL_MAG_CAL)]


def _servo(flavour: Flavour, sea_m: float) -> list[Any]:
    if flavour.px4:
        return [long(M.MAV_CMD_DO_SET_ACTUATOR, NAN, NAN, NAN, NAN, 0.5, NAN, 0)]
    return [long(M.MAV_CMD_DO_SET_SERVO, 5, 1750)]


def _grip(action: int) -> Frames:
    return lambda flavour, sea_m: [long(M.MAV_CMD_DO_GRIPPER, 1, action)]


def _spin(flavour: Flavour, sea_m: float) -> list[Any]:
    if flavour.px4:
        return [long(M.MAV_CMD_ACTUATOR_TEST, 0.05, 1, 0, 0, 1)]
    return [long(M.MAV_CMD_DO_MOTOR_TEST, 1, 0, 5, 1, 1)]


def _jump(flavour: Flavour) -> list[Any]:
    return [long(M.MAV_CMD_MISSION_START, 3)] if flavour.px4 else [long(M.MAV_CMD_DO_SET_MISSION_CURRENT, 4)]


def _pause(flavour: Flavour, sea_m: float) -> list[Any]:
    return mode("hold")(flavour, sea_m) if flavour.px4 else [long(M.MAV_CMD_DO_PAUSE_CONTINUE, 0)]


def _resume(flavour: Flavour, sea_m: float) -> list[Any]:
    return mode("mission")(flavour, sea_m) if flavour.px4 else [long(M.MAV_CMD_DO_PAUSE_CONTINUE, 1)]


Give = Callable[[Case], Awaitable[None]]
Row = tuple[str, str, str]
"""(command, result, way)."""


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    """alice's Kestrel, and a token of hers."""
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_user("root", "admin")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        scopes = ("--scope", "watch", "--scope", "fly")
        world.tower_command("token", "add", "alice", "ground station", *scopes, "--token-file", str(tmp_path / "token"))
        yield world


@contextmanager
def ground_station(world: World) -> Iterator[Callable[[Any], None]]:
    """Acts as a stock program: listens on a port and sends frames to the peer that contacts it."""
    (port,) = free_udp_ports(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there:
        there.bind(("127.0.0.1", port))
        there.settimeout(30)
        token = ("--tower", world.address, "--token-file", str(world.folder / "token"))
        udp = ("--udp", f"127.0.0.1:{port}")
        process = world.start("connect", "tower", "connect", "Kestrel", *token, "--fly", *udp)
        _, bridge = there.recvfrom(4096)
        wait_for("tower connect to fly", lambda: "you have the controls" in world.log_of("connect"))

        def send(message: Any) -> None:
            there.sendto(build(message, system_id=255, component_id=190, sequence=0), bridge)

        ends = threading.Event()

        def beat() -> None:
            while not ends.wait(1.0):  # without them its pilot counts as gone
                send(M.MAVLink_heartbeat_message(M.MAV_TYPE_GCS, M.MAV_AUTOPILOT_INVALID, 0, 0, M.MAV_STATE_ACTIVE, 3))

        beating = threading.Thread(target=beat)
        beating.start()
        yield send
        ends.set()
        beating.join()
        process.terminate()
        process.wait()


def rows_of(root: Visitor) -> list[Row]:
    """Returns the rows in the order of the commands."""
    events = root.ask("GET", "/audit?limit=500").json
    given = sorted((one for one in events if one["action"] == "command.given"), key=lambda one: one["at"])
    assert {(one["actor_name"], one["drone_id"]) for one in given} <= {("alice", 1)}
    return [(one["detail"]["command"], one["detail"]["result"], one["detail"]["way"]) for one in given]


async def refused_arming(pilot: Pilot) -> str:
    """Returns the reason for the refusal, once the drone's parameters and other preconditions are known."""
    for _ in range(300):
        if not (await pilot.ask("GET", "/loss-check")).json["complete"]:
            await asyncio.sleep(0.1)
            continue
        answer = await pilot.ask("POST", "/commands", {"command": "takeoff", "height_m": HEIGHT_M})
        assert answer.status == 409, answer.body
        if answer.json["type"] != "/problems/not-known-yet":
            return str(answer.json["type"])
        await asyncio.sleep(0.1)
    raise AssertionError("the drone never told what has to be known")


REFUSED: Final = {
    "orbit": {"lat": LAT, "lon": LON, "height_m": HEIGHT_M, "radius_m": 20},
    "calibration_pose": {"pose": 1},
}
"""Further body fields of each command that one of the autopilots does not support."""


async def refused(alice: Visitor, flavour: Flavour, **headers: str) -> list[Any]:
    """Returns the responses to the commands that the profile does not support."""
    answers = []
    for name in sorted(flavour.cannot):
        body = {"command": name, **REFUSED[name]}
        answer = await asyncio.to_thread(alice.ask, "POST", "/drones/1/commands", body, **headers)
        assert answer.status == 409, (name, answer.body)
        assert answer.json["type"] == "/problems/not-supported"
        answers.append(answer.json["detail"])
    return answers


async def fly(pilot: Pilot, flavour: Flavour, give: Give, expected: Callable[[Case], Row]) -> list[Row]:
    rows = []
    for case in cases(flavour):
        await give(case)
        await pilot.until(lambda: case.shows(pilot, flavour), f"{flavour.name}, {case.name}: {pilot.texts[-3:]}")  # noqa: B023
        rows.append(expected(case))
    return rows


@pytest.mark.parametrize("flavour", [ARDUPILOT, PX4], ids=lambda flavour: flavour.name)
async def test_every_command_does_the_same_by_every_way_and_leaves_one_row(world: World, flavour: Flavour) -> None:
    assert {case.name for case in cases(flavour)} == flavour.can - ELSEWHERE
    # It stays armed until the next command comes, at this speed too.
    px4 = ("PD_GRIPPER_EN=1", "COM_DISARM_PRFLT=120", "NAV_RCL_ACT=0")
    named = px4 if flavour.px4 else ("GRIP_ENABLE=1", "SERVO9_FUNCTION=28", "DISARM_DELAY=120")
    parameters = [word for one in named for word in ("--param", one)]
    options = (
        "--boot-s",
        "1",
        "--speed",
        "8",
        "--real-rates",
        "--flavour",
        flavour.name,
        *parameters,
        "--camera-component",
    )
    world.start_simulated("Kestrel", options=options)
    alice, root = world.visitor("alice"), world.visitor("root")
    await asyncio.to_thread(wait_for, "the autopilot to be heard", lambda: alice.drone(1).get("autopilot_heard"))
    bearer = {"Authorization": f"Bearer {(world.folder / 'token').read_text().strip()}"}
    async with at_the_controls(alice, 1) as pilot:
        await pilot.until(lambda: pilot.has_position, "a position")
        # With these parameters it would drop or lose the drone if its computer failed.
        reason = await refused_arming(pilot)
        assert reason == "/problems/loss-check"
        await pilot.accept_loss_check()
        await pilot.command(M.MAV_CMD_SET_MESSAGE_INTERVAL, M.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, 100_000)
        put = await pilot.ask("PUT", "/mission", {"items": MISSION})
        assert put.json["state"] == "done", put.body

        async def by_console(case: Case) -> None:
            if case.name == "hold":
                await pilot.send(mode("hold")(flavour, 0)[0])
                return
            begun = await asyncio.to_thread(alice.ask, "POST", "/drones/1/commands", case.body, Prefer="respond-async")
            assert begun.status == 202, (case.name, begun.body)
            ended = await end_of(pilot, begun.json["id"])
            assert ended["state"] == "done", (case.name, ended["words"])

        async def by_rest(case: Case) -> None:
            answer = await asyncio.to_thread(alice.ask, "POST", "/drones/1/commands", case.body, **bearer)
            assert answer.status == 200, (case.name, answer.body)
            assert answer.json["state"] == "done", (case.name, answer.json["words"])

        async def rows(count: int) -> None:
            await asyncio.to_thread(wait_for, "the rows", lambda: len(rows_of(root)) >= count)

        def operation(case: Case) -> Row:
            return case.name, ACCEPTED, "operation"

        def frame(case: Case) -> Row:
            return case.row or case.name, ACCEPTED, "frames"

        await asyncio.to_thread(wait_for, "the ground", lambda: is_on_the_ground(alice))
        assert await refused(alice, flavour) == await refused(alice, flavour, **bearer)
        given = await fly(pilot, flavour, by_console, lambda one: (frame if one.name == "hold" else operation)(one))
        await asyncio.to_thread(wait_for, "the ground", lambda: is_on_the_ground(alice))
        given += await fly(pilot, flavour, by_rest, operation)
        with ground_station(world) as send:

            async def by_connect(case: Case) -> None:
                if case.name == "disarm":  # in the air the tower wants it asked for twice
                    await asyncio.to_thread(wait_for, "the ground", lambda: is_on_the_ground(alice))
                for message in case.frame(flavour, pilot.home_amsl_m):
                    pilot.acks.clear()
                    send(message)
                    answered = (message.command, M.MAV_RESULT_ACCEPTED)
                    await pilot.until(lambda: answered in pilot.acks, f"{case.name}: {pilot.acks}")  # noqa: B023
                given.append(frame(case))
                if case.row == "mode" or case.name == "goto":
                    # Waits before the same command, because within a second it would count as a repetition.
                    await rows(len(given))

            await fly(pilot, flavour, by_connect, frame)
            await rows(len(given))
        assert rows_of(root) == given
