"""One run of `tower connect`: finds the drones, acquires their controls if asked to, carries frames, releases them.

This shell connects the parts. It never decides who may fly: the tower does.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Coroutine, Hashable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from connect.bridge import Bridge
from connect.control_view import ControlView
from connect.endpoints import Endpoint
from connect.ground import Ground
from connect.live import Live
from connect.loss_check import before_flight
from connect.rest import Rest
from connect.squad import Chosen, choose_all
from connect.terminal import Terminal
from connect.tower_url import TowerUrl
from connect.unusable import Ended, Unusable

ALREADY_OURS: Final = "already-yours"
WATCH_RATE_HZ: Final = 0.5
"""For the other drones of the squad, of which programs get the positions only (`squad_traffic`)."""

RELEASE_WITHIN_S: Final = 5.0
_BODIES: Final[dict[str, Any]] = {"accept": {"sticks_centred": True}}


@dataclass(frozen=True)
class Options:
    """The options of the command line. `drones`: each a name or an id."""

    drones: list[str]
    tower: TowerUrl
    token: str = field(repr=False)
    endpoints: list[Endpoint]
    fly: bool
    acknowledge_loss_check: bool


async def run(options: Options, say: Callable[[str], None]) -> None:
    """Runs until cancelled. Raises Ended with the reason if it cannot continue: the first drone that ends ends all."""
    answer = await Rest(options.tower, options.token).ask("GET", "/drones")
    if not answer.done:
        raise Unusable(f"{options.tower.origin} refuses: {answer.words}")
    drones = choose_all(answer.body, options.drones)
    ground = Ground(options.endpoints, [one.drone_id for one in drones])
    terminal = Terminal(lambda line: _typed(line, sessions, say))
    # One person flies one drone at a time: the others wait for `acquire NAME`.
    sessions = [Session(options, one, ground, terminal, say, flies=options.fly and one is drones[0]) for one in drones]
    async with contextlib.AsyncExitStack() as stack:
        stack.callback(ground.close)
        await ground.open()
        if options.fly:
            terminal.open()
            stack.callback(terminal.close)
        try:
            async with asyncio.TaskGroup() as group:
                for session in sessions:
                    group.create_task(session.run())
        except BaseExceptionGroup as group_error:
            raise group_error.exceptions[0] from None


def _typed(line: str, sessions: Sequence[Session], say: Callable[[str], None]) -> None:
    word, _, name = line.partition(" ")
    if not word:
        return
    wanted = [one for one in sessions if one.is_called(name.strip())] if name or len(sessions) > 1 else sessions
    if word not in ("acquire", "release", "accept") or not wanted:
        which = "" if len(sessions) == 1 else " and the drone's name"
        say(f"type acquire, release or accept{which}; Ctrl-C ends it")
        return
    for session in wanted:
        session.ask_for(word)


class Session:
    """One drone. `flies`: its controls are acquired at once. Call `run` once."""

    def __init__(
        self,
        options: Options,
        drone: Chosen,
        ground: Ground,
        terminal: Terminal,
        say: Callable[[str], None],
        *,
        flies: bool,
    ) -> None:
        self._flies = flies
        self._is_to_release = False
        self._options = options
        self._drone = drone
        self._ground = ground
        self._terminal = terminal
        self._say = say
        self._rest = Rest(options.tower, options.token)
        self._asking: set[asyncio.Task[None]] = set()
        self._there = True
        self._bridge = Bridge(drone.drone_id, is_alone=ground.system_of(drone.drone_id) is None)
        self._view = ControlView(drone.drone_id, drone.name)

    def is_called(self, name: str) -> bool:
        return name.casefold() in (self._drone.name.casefold(), str(self._drone.drone_id))

    async def run(self) -> None:
        """Runs until cancelled. Raises Ended with the reason if it cannot continue."""
        options, drone = self._options, self._drone
        self._loop = asyncio.get_running_loop()
        hello = [{"type": "watch", "rate_hz": WATCH_RATE_HZ}, {"type": "focus", "drone_id": drone.drone_id}]
        self._live = Live(
            options.tower, options.token, hello=hello, received=self._from_tower, say=self._say, shut=self._tower_closed
        )
        self._ground.attach(drone.drone_id, self._from_program, self._bridge.program_gone)
        async with contextlib.AsyncExitStack() as stack:
            stack.push_async_callback(self._release, drone)
            if self._flies:
                self._is_to_release = await self._acquire(drone)
                await self._loss_check(drone)
            system = self._ground.system_of(drone.drone_id)
            which = "" if system is None else f", as system {system}"
            self._say(f"{drone.name} is at {self._ground.places}{which}: you {'fly' if self._flies else 'watch'}")
            await self._live.run(watch_only=self._watch_only)

    # Frames

    def _from_program(self, program: Hashable, data: bytes) -> None:
        # While no program runs, the connection is open for watching only and must not carry commands.
        self._bridge.has_controls = self._view.has_controls and self._live.may_fly
        now = self._loop.time()
        for message in self._bridge.from_program(program, data, now):
            if not self._live.send_frames(message):
                self._view.say("the tower is out of reach: what a program sent was dropped, and is not sent later", now)
                self._say_all()
        if self._options.fly and not self._live.may_fly:
            self._live.refresh()

    def _from_tower(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            frames = self._bridge.from_tower(message, self._loop.time())
            if frames:
                self._ground.send(self._drone.drone_id, frames)
            return
        view = self._view
        for reply in view.event(message, self._loop.time()):
            self._live.send_text(reply)
        self._say_all()
        if view.loss_check_asked:
            view.loss_check_asked = False
            if self._options.fly and not self._asking:
                self._in_background(self._loss_check(self._drone))
        if view.out_of_squad:
            raise Ended(f"{view.name} is not in your squad any more")

    def _say_all(self) -> None:
        for sentence in self._view.pop_sentences():
            self._say(sentence)

    def _watch_only(self) -> bool:
        """Without --fly always; with it while every ground station is silent, so that the user does not count as a
        pilot."""
        if not self._options.fly:
            return True
        there = self._bridge.has_programs(self._loop.time())
        if there != self._there:
            self._there = there
            self._say("a ground station is there again" if there else "no ground station is heard: the pilot is gone")
        return not there

    async def _tower_closed(self, why: str) -> None:
        """Handles a sign-out. A new password or role causes one, and the token is still valid; otherwise raises."""
        answer = await self._rest.ask("GET", "/drones")
        if not answer.done:
            raise Unusable(f"{self._options.tower.origin} ended the connection: {why}")

    # The controls

    async def _acquire(self, drone: Chosen) -> bool:
        """Returns False if the user had the controls before, perhaps in a browser: then they are not released at the
        end."""
        answer = await self._rest.ask("POST", f"/drones/{drone.drone_id}/control/acquire", {})
        if answer.code == ALREADY_OURS:
            self._say(f"you had the controls of {drone.name} before, and they stay yours when this ends")
            return False
        if not answer.done:
            raise Ended(f"the controls of {drone.name} are not available: {answer.words}")
        return True

    async def _release(self, drone: Chosen) -> None:
        if not self._is_to_release or (self._view.user_id is not None and not self._view.has_controls):
            return
        try:
            async with asyncio.timeout(RELEASE_WITHIN_S):
                answer = await self._rest.ask("POST", f"/drones/{drone.drone_id}/control/release", {})
            self._say(f"the controls of {drone.name} are released" if answer.done else answer.words)
        except (Ended, TimeoutError):
            self._say(f"the tower could not be told; it takes back control of {drone.name} after its grace time")

    async def _loss_check(self, drone: Chosen) -> None:
        acknowledge = self._options.acknowledge_loss_check
        await before_flight(self._rest, drone, acknowledge=acknowledge, say=self._say, ask=self._terminal.ask)

    def ask_for(self, word: str) -> None:
        """`word`: acquire, release or accept."""
        self._in_background(self._ask_for(word))

    async def _ask_for(self, word: str) -> None:
        path = f"/drones/{self._drone.drone_id}/control/{word}"
        answer = await self._rest.ask("POST", path, _BODIES.get(word, {}))
        if not answer.done:
            self._say(answer.words)
        elif word == "acquire":
            self._is_to_release = True

    def _in_background(self, work: Coroutine[Any, Any, None]) -> None:
        """Reports a failure without ending the flight."""

        async def done() -> None:
            try:
                await work
            except Ended as ended:
                self._say(str(ended))

        task = self._loop.create_task(done())
        self._asking.add(task)
        task.add_done_callback(self._asking.discard)
