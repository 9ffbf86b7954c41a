"""The challenge flown from end to end: a mission written through the tower, a target with a random letter, heading,
place and light on the simulator's land, another one with another letter, wind. How far the reported place and the
payload are from the truth, and how long it takes.

All in one process and on one clock, with the pictures that the simulator's camera draws; `--flown`: with tower, agent
and simulator as programs, in real time. `--painted`: the published challenge's own target instead, white with a
coloured square. `--model sensing`: on sensors with errors.
`--rounds N` flies so many (20), `--seed N` others; `--keep FOLDER` keeps logs.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import re
import tempfile
import time
from pathlib import Path
from typing import Any, Final

import httpx

from bench.challenge_one_clock import fly_on_one_clock
from bench.challenge_task import Flown, Task, apart_m, mission, on_map
from bench.person import Person
from bench.rig import HOME, Kind, Rig, free_udp_port, wait_for
from bench.rows import Report
from bench.video.video_rig import free_tcp_port
from simulator.airframe_model import AirframeModel
from wire.plans import plan_to_json

FLIGHTS: Final = 20
SPEED: Final = 1.0
"""Of the simulator's clock."""
FOUND_WITHIN_M: Final = 1.0
DROPPED_WITHIN_M: Final = 1.5
FLIES_WITHIN_S: Final = 400.0
_LANDED: Final = re.compile(r"Payload landed at (-?[\d.]+),(-?[\d.]+)")


class ChallengeRig(Rig):
    """A Rig without a tap: the simulator starts anew for each flight, on the same ports."""

    def __init__(self, folder: Path, model: AirframeModel) -> None:
        super().__init__(folder, Kind("ardupilot", radio=True), None)
        self._model = model
        self._agent_port, self._camera_port = free_udp_port(), free_tcp_port()
        self._simulator: asyncio.subprocess.Process | None = None
        self.flights = 0

    async def _start_drone(self, tower: str, token: str) -> None:
        camera = f"http://127.0.0.1:{self._camera_port}/camera?tilt=90&rate=10"
        self.agent = await self._run(
            "agent",
            *self._drone_command("tower-agent", "run", "--tower", tower, "--token", token),
            *("--autopilot", f"udpin:127.0.0.1:{self._agent_port}", "--camera", camera),
            *("--controller-camera", f"down,tilt=90,fov=75,up=0.25 {camera}"),
        )
        await self.prepare(Task.drawn(0, 0))

    async def prepare(self, task: Task) -> None:
        """A simulator with the targets of this task."""
        if self._simulator is not None:
            self._simulator.terminate()
            await self._simulator.wait()
        self.flights += 1
        self._simulator = await self._run(
            f"simulator-{self.flights}",
            *self._drone_command("tower-sim", "--home", ",".join(str(one) for one in HOME) + ",0"),
            *("--out", f"udp:127.0.0.1:{self._agent_port}", "--camera", str(self._camera_port), "--boot-s", "3"),
            *("--param", "GRIP_ENABLE=1", "--param", "SERVO9_FUNCTION=28"),
            *("--model", self._model, "--speed", f"{SPEED:g}", "--seed", str(self.flights), *task.options()),
        )

    def payload(self) -> tuple[float, float] | None:
        """Where the payload of this flight landed."""
        log = (self._folder / f"simulator-{self.flights}.log").read_text(errors="replace")
        landed = _LANDED.search(log)
        return None if landed is None else (float(landed[1]), float(landed[2]))


async def fly(rig: ChallengeRig, task: Task) -> Flown:
    """Flies one task. Raises TimeoutError."""
    await rig.prepare(task)
    pilot = rig.operator
    await _done(pilot, "PUT", "/drones/1/mission", {"items": json.loads(plan_to_json(mission()))}, ("done",))
    body = {"controller": "challenge", "may_take_off": True, "for_s": 600, "settings": task.settings}
    began_at, heard = time.monotonic(), len(pilot.events)
    end = await _done(pilot, "POST", "/drones/1/controller", body, ("done", "failed", "timed_out", "cancelled"))
    took_s = time.monotonic() - began_at
    events = [event for _, event in pilot.events[heard:]]
    found = [event["finding"] for event in events if event["type"] == "finding"]
    phases = [one["operation"]["phase"] for one in events if one["type"] == "operation"]
    phase = next((one for one in reversed(phases) if "searching" in one), "")
    truth = on_map(*task.place_m)
    target_m = apart_m((found[-1]["lat_deg"], found[-1]["lon_deg"]), truth) if found else None
    payload = rig.payload()
    payload_m = None if payload is None else apart_m(payload, truth)
    letter = found[-1]["letter"] if found else ""
    return Flown(end["words"], target_m, payload_m, letter, took_s, phase)


async def _done(
    pilot: Person, method: str, path: str, body: dict[str, Any], ends: tuple[str, ...], within_s: float = FLIES_WITHIN_S
) -> dict[str, Any]:
    """Asks until the operation ends in one of `ends`: an autopilot that is starting refuses at first."""
    deadline = pilot.now + within_s
    while True:
        answer = await pilot.http.request(method, path, json=body)
        if answer.is_success:
            over = await _end(pilot, answer.json()["id"], within_s)
            if over["state"] in ends and "arming" not in over["words"]:
                return over
        elif answer.status_code != httpx.codes.CONFLICT:
            raise RuntimeError(f"{path}: {answer.status_code} {answer.text}")
        if pilot.now > deadline:
            raise TimeoutError(f"{path}: {answer.text}")
        await asyncio.sleep(0.5)


async def _end(pilot: Person, identity: str, within_s: float) -> dict[str, Any]:
    def ends() -> list[dict[str, Any]]:
        changes = [event["operation"] for _, event in pilot.events if event["type"] == "operation"]
        return [one for one in changes if one["id"] == identity and one["state"] != "running"]

    await wait_for("the end of an operation", ends, within_s)
    return ends()[0]


async def run(report: Report, options: argparse.Namespace) -> None:
    count = options.rounds or (2 if options.quick else FLIGHTS)
    flights: list[Flown] = []
    try:
        if options.flown:
            await _with_programs(report, options, count, flights)
        else:
            for number in range(1, count + 1):
                task = Task.drawn(options.seed, number, painted=options.painted)
                flights.append(fly_on_one_clock(task, number, options.model))
                _say(report, number, task, flights[-1])
    finally:
        kind = "painted targets" if options.painted else "squares"
        _rows(report, f"{len(flights)} flights of seed {options.seed}, {options.model}, {kind}", flights)


async def _with_programs(report: Report, options: argparse.Namespace, count: int, flights: list[Flown]) -> None:
    folder = (options.keep or Path(tempfile.mkdtemp(prefix="challenge-"))) / f"flights-{options.seed}"
    folder.mkdir(parents=True)
    rig = ChallengeRig(folder, options.model)
    try:
        await rig.start()
        await rig.operator.control("acquire")
        for number in range(1, count + 1):
            task = Task.drawn(options.seed, number, painted=options.painted)
            flights.append(await fly(rig, task))
            _say(report, number, task, flights[-1])
    finally:
        await asyncio.shield(rig.stop())


def _say(report: Report, number: int, task: Task, flown: Flown) -> None:
    errors = " ".join("none" if one is None else f"{one:.2f} m" for one in (flown.target_m, flown.payload_m))
    report.say(f"{number}: {task.letter} read as {flown.letter or '-'}, {errors}, {flown.took_s:.0f} s")
    report.say(f"   light {task.light:.2f}, wind {task.wind[0]:.1f} m/s. {flown.words}")
    report.say(f"   {flown.phase}")


def _rows(report: Report, case: str, flights: list[Flown]) -> None:
    found = [one.target_m for one in flights if one.target_m is not None]
    dropped = [one.payload_m for one in flights if one.payload_m is not None]
    report.add(case, "flights", len(flights), "count")
    report.add(case, "found_within_1_m", sum(one <= FOUND_WITHIN_M for one in found), "count")
    report.add(case, "dropped_within_1.5_m", sum(one <= DROPPED_WITHIN_M for one in dropped), "count")
    report.add(case, "landed", sum("has landed" in one.words for one in flights), "count")
    report.spread(case, "target_error", found, "m")
    report.spread(case, "payload_error", dropped, "m")
    report.spread(case, "time", [one.took_s for one in flights], "s")
