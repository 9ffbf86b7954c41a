"""Several drones at one tower, each with its own agent, operator and autopilot; one admin for all.

Each drone gets a fresh autopilot and a fresh agent for each flight (`equip`), so that no flight affects the next.
Without a path to a real autopilot, `tower-sim` flies.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, Final

from bench.autopilot_tap import AutopilotTap
from bench.person import Event, Person
from bench.real_autopilot import QUADCOPTER, Airframe, RealAutopilot, Receiver
from bench.real_px4 import RealPx4
from bench.rig import HOME, PASSWORD, Kind, Rig, free_udp_port, wait_for
from bench.tap import ADMIN, OPERATOR, Tap

SIMULATED: Final = Kind("ardupilot", radio=True)
DRONES_OF_A_BENCH: Final = 16
INSTANCES: Final = 10_000
"""Numbers of PX4's instances, so that several benchmarks may fly at once."""
BOOTS_AT_ONCE: Final = 2
"""A booting autopilot uses all the processor time that it gets."""


def is_px4(binary: Path) -> bool:
    """ArduCopter is named by its program, PX4 by the folder of its build."""
    return binary.is_dir()


class Squadron(Rig):
    """`drones` exist after `start`. `binary`: of a real autopilot (is_px4), or None."""

    def __init__(self, folder: Path, count: int, binary: Path | None, airframe: Airframe) -> None:
        super().__init__(folder, SIMULATED, None)
        self.folder = folder
        self.binary = binary
        self.airframe = airframe
        self.booting = asyncio.Semaphore(BOOTS_AT_ONCE)
        self.drones: list[FlownDrone] = []
        self._count = count

    async def start(self) -> None:
        await self._tower_command("migrate")
        operators = [f"operator-{number}" for number in range(1, self._count + 1)]
        for name in ("admin", *operators):
            role = "admin" if name == "admin" else "operator"
            words = ("user", "add", name, "--role", role, "--password-stdin", "--for-good")
            await self._tower_command(*words, stdin=PASSWORD)
        await self.start_tower()
        self.admin = Person("admin", ADMIN, self.address, 1)
        await self.admin.sign_in(PASSWORD)
        await self.admin.go_live()
        users = {user["name"]: user["id"] for user in await self.admin.ask("GET", "/users")}
        for number, name in enumerate(operators, 1):
            made = await self.admin.ask("POST", "/drones", {"name": f"Kestrel {number}"})
            drone_id = made["drone"]["id"]
            await self.admin.ask("PUT", f"/drones/{drone_id}/owners/{users[name]}")
            token = self.folder / f"drone-{number}.token"
            token.touch(mode=0o600)
            begun = await self.admin.ask("POST", f"/drones/{drone_id}/enrolments", {"lasts_s": 86_400})
            token.write_text(begun["token"])  # its agent's first start replaces it with a key
            drone = FlownDrone(self, drone_id, made["drone"]["name"], name, token)
            self.drones.append(drone)
            await drone.sign_in()

    @property
    def tcp_port(self) -> int:
        return self._port

    @property
    def udp_port(self) -> int:
        """The tower's own port, at the same address."""
        return self._fixed_udp_port()

    async def spawn(self, name: str, *command: str) -> asyncio.subprocess.Process:
        return await self._run(name, *command)

    def program(self, *words: str) -> list[str]:
        return self._drone_command(*words)

    async def stop(self) -> None:
        for drone in self.drones:
            with contextlib.suppress(OSError):
                await drone.leave()
            await drone.operator.close()
        await super().stop()


class FlownDrone:
    """One drone. `tap` and its records are those of the present flight."""

    def __init__(self, squadron: Squadron, drone_id: int, name: str, operator: str, token: Path) -> None:
        self.squadron = squadron
        self.drone_id = drone_id
        self.name = name
        self.operator = Person(operator, OPERATOR, squadron.address, drone_id)
        self.tap: Tap
        self.tower_address: str | None = None
        """The agent's address of the tower, if not the tower's own."""
        self.agent: asyncio.subprocess.Process | None = None
        self.autopilot: RealAutopilot | RealPx4 | None = None
        self.loss_sentences: tuple[str, ...] = ()
        """Of the newest check before flight."""
        self._simulator: asyncio.subprocess.Process | None = None
        self._token = token
        self._flights = 0
        self._equipped = False
        self._equipped_at = 0.0
        self._agent_port = 0
        self._beside: asyncio.Task[None] | None = None

    def keep(self, work: asyncio.Task[None]) -> None:
        """Runs beside this flight, and ends with it."""
        self._beside = work

    @property
    def admin(self) -> Person:
        return self.squadron.admin

    @property
    def folder(self) -> Path:
        """Of this flight."""
        return self.squadron.folder / f"drone-{self.drone_id}-flight-{self._flights}"

    async def sign_in(self) -> None:
        await self.operator.sign_in(PASSWORD)
        await self.operator.go_live()

    async def equip(self, receiver: Receiver, parameters: dict[str, float], *, agent_on_second: bool = False) -> None:
        """Starts a fresh autopilot and a fresh agent; nobody has the controls; the tower receives the autopilot's
        heartbeats. `agent_on_second`: as for RealAutopilot."""
        await self.leave()
        self._flights += 1
        self._equipped_at = self.admin.now
        self.folder.mkdir(parents=True)
        self._agent_port = free_udp_port()
        if self.squadron.binary is not None:
            await self._real(self.squadron.binary, receiver, parameters, agent_on_second)
        else:
            await self._simulated(receiver, parameters)
        await self.start_agent()

        async def heard() -> bool:
            drone = await self.view()
            return bool(drone["online"] and drone["autopilot_heard"])

        await wait_for("the tower to hear the autopilot", heard)
        await self.free()

    async def _real(
        self, binary: Path, receiver: Receiver, parameters: dict[str, float], agent_on_second: bool
    ) -> None:
        if is_px4(binary):
            self.autopilot = RealPx4(
                binary,
                self.folder / "autopilot",
                receiver=receiver,
                parameters=parameters,
                number=(os.getpid() * DRONES_OF_A_BENCH + self.drone_id) % INSTANCES,
            )
        else:
            self.autopilot = self._arducopter(binary, receiver, parameters, agent_on_second)
        async with self.squadron.booting:
            await self.autopilot.start()
        self.tap = AutopilotTap(("127.0.0.1", self._agent_port), self.autopilot)
        self.tap.open()
        self._equipped = True

    def _arducopter(
        self, binary: Path, receiver: Receiver, parameters: dict[str, float], agent_on_second: bool
    ) -> RealAutopilot:
        return RealAutopilot(
            binary,
            self.folder / "autopilot",
            receiver=receiver,
            parameters=parameters,
            agent_on_second=agent_on_second,
            airframe=self.squadron.airframe,
        )

    async def _simulated(self, receiver: Receiver, parameters: dict[str, float]) -> None:
        self.tap = Tap(("127.0.0.1", self._agent_port))
        self.tap.open()
        self._equipped = True
        home = ",".join(str(number) for number in HOME)
        words = ["--home", f"{home},0", "--out", f"udp:127.0.0.1:{self.tap.port}", "--boot-s", "3"]
        words += [word for name, value in parameters.items() for word in ("--param", f"{name}={value:g}")]
        command = self.squadron.program("tower-sim", "--flavour", "ardupilot", "--radio", receiver.value, *words)
        self._simulator = await self.squadron.spawn(f"{self.folder.name}/simulator", *command)

    async def start_agent(self) -> None:
        """Also restarts it after a kill, with the state that the previous process left."""
        command = self.squadron.program("tower-agent", "run", "--tower", self.tower_address or self.squadron.address)
        command += ["--token", str(self._token), "--autopilot", f"udpin:127.0.0.1:{self._agent_port}"]
        command += ["--state", str(self.folder / "state")]
        self.agent = await self.squadron.spawn(f"{self.folder.name}/agent", *command)

    async def kill_agent(self) -> None:
        """SIGKILL: no clean shutdown."""
        if self.agent is not None and self.agent.returncode is None:
            self.agent.kill()
            await self.agent.wait()

    async def leave(self) -> None:
        """Ends agent and autopilot."""
        self.operator.sticks = None
        if self._beside is not None:
            self._beside.cancel()
            await asyncio.gather(self._beside, return_exceptions=True)
            self._beside = None
        await self.kill_agent()
        if self._simulator is not None and self._simulator.returncode is None:
            self._simulator.kill()
            await self._simulator.wait()
        if self._equipped:
            self._equipped = False
            self.tap.close()
        if self.autopilot is not None:
            await self.autopilot.stop()
            self.autopilot = None

    def disarm(self) -> None:
        """Disarms in any state, bypassing agent and tower."""
        if self.autopilot is not None:
            self.autopilot.truth.disarm()
        else:
            self.tap.disarm()

    async def view(self) -> Any:
        return await self.admin.ask("GET", f"/drones/{self.drone_id}")

    async def order(self, person: Person, verb: str, **body: Any) -> Any:
        path = f"/drones/{self.drone_id}/control/{verb}"
        return await person.ask("POST", path, {"reason": "bench", **body})

    async def free(self) -> None:
        """Frees the controls; nobody is excluded any more."""
        await self.operator.vanish()
        await self.operator.go_live()
        self.operator.pong_delay_s = 0.0
        drone = await self.view()
        if drone["holder"] is None and drone["taken_from"] is None:
            return
        if drone["holder"] is None or drone["holder"]["name"] != "admin":
            await self.order(self.admin, "take")
        await self.order(self.admin, "release")

    async def acknowledge_losses(self) -> None:
        """Acknowledges everything that the pre-flight check reports as dangerous. Needs the name of the drone."""
        path = f"/drones/{self.drone_id}/loss-check"

        async def complete() -> bool:
            check = await self.operator.ask("GET", path)
            self.loss_sentences = tuple(one["text"] for one in check["sentences"])
            return bool(check["complete"])

        await wait_for("the loss check to be complete", complete, 60)
        await self.operator.ask("POST", f"{path}/acknowledge", {"drone": self.name})

    def events_since(self, person: Person, since: float) -> list[tuple[float, Event]]:
        """Returns this person's events about this drone."""
        found = []
        for at, event in person.events:
            about = event.get("drone_id") or (event.get("drone") or {}).get("id")
            if at >= since and about == self.drone_id:
                found.append((at, event))
        return found

    def write_down(self, title: str, since: float) -> None:
        """Writes the flight's log, for people. Times are relative to `since`."""
        if not self._equipped:
            return
        lines: list[tuple[float, str]] = []
        for name, person in (("admin", self.admin), ("operator", self.operator)):
            events = self.events_since(person, self._equipped_at)
            lines += [(at, f"{name}: {_in_short(event)}") for at, event in events if event["type"] != "loss_check"]
        shown: tuple[int, bool] | None = None
        for seen in self.tap.modes:
            if (seen.custom_mode, seen.armed) != shown:
                shown = (seen.custom_mode, seen.armed)
                lines.append((seen.at, f"mode {seen.custom_mode} {'armed' if seen.armed else 'disarmed'}"))
        lines += [(at, f"text {text}") for at, text in getattr(self.tap, "timed_texts", [])]
        last = 0.0
        for motion in self.tap.motions:
            if motion.at - last >= 0.5:
                last = motion.at
                words = f"height {motion.alt_m:.2f} climb {motion.climb_mps:+.2f} speed {motion.speed_mps:.2f}"
                lines.append((motion.at, words))
        sent = self.tap.sticks
        lines += [(at, "mode requested by the agent") for at in self.tap.mode_requests]
        for before, stick in zip([None, *sent], sent, strict=False):
            if before is None or (before.who, before.x, before.y, before.z) != (stick.who, stick.x, stick.y, stick.z):
                lines.append((stick.at, f"sticks of {stick.who}: {stick.x} {stick.y} {stick.z} {stick.r}"))
            elif stick.at - before.at > 0.3:
                lines.append((before.at, f"sticks of {before.who} stop"))
        if sent:
            lines.append((sent[-1].at, "the last stick"))
        text = f"{title}\n" + "".join(f"{at - since:+9.2f} {words}\n" for at, words in sorted(lines))
        (self.folder / "flight.txt").write_text(text)


def _in_short(event: Event) -> str:
    """Of a whole drone only the fields about its hold."""
    if event["type"] != "drone":
        return json.dumps(event)
    drone = event["drone"]
    holder = drone["holder"]["name"] if drone["holder"] is not None else None
    about = {name: drone.get(name) for name in ("epoch", "online", "armed", "airborne", "hold")}
    return json.dumps({"type": "drone", "holder": holder, **about})


@contextlib.asynccontextmanager
async def squadron_of(
    folder: Path, count: int, binary: Path | None, airframe: Airframe = QUADCOPTER
) -> AsyncIterator[Squadron]:
    folder.mkdir(parents=True)  # noqa: ASYNC240 (once, before anything runs)
    squadron = Squadron(folder, count, binary, airframe)
    try:
        await squadron.start()
        yield squadron
    finally:
        await asyncio.shield(squadron.stop())
