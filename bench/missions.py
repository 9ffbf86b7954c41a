"""`python -m bench missions`: plans and parameters through the agent, compared with MAVSDK on the same emulated line.

Ours: a user's program sends a plan to a real tower, whose agent writes it to the local simulator and reads it back.
MAVSDK: its server uses MAVLink over UDP with the same simulator (another vehicle of the same process), over the same
line. They alternate round by round. See docs/bench.md.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import shutil
import tempfile
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bench.ground_station import NotAnswered
from bench.link_model import Profile
from bench.missions_figures import OURS, PEER, Figures
from bench.missions_plan import survey
from bench.missions_rig import DRONE, MissionsRig, RestPerson, connect_time_s
from bench.namespaces import Carried, Network, emulated_network, why_not
from bench.peers.environment import CannotInstall
from bench.peers.mavsdk_server import Installed, PeerFailed, mavsdk_in
from bench.rig import wait_for
from bench.rows import Report
from wire.autopilots.ardupilot_plans import ArduPilot
from wire.plan_keeping import same_plan
from wire.plans import PlanKind, plan_from_json

ITEMS: Final = 200
ROUNDS: Final = 5
LINE: Final = Profile(delay_s=0.15, loss=0.025)
"""An access link, each way: 300 ms round trip, 2.5 % of the packets lost in either direction."""
LINE_WORDS: Final = "300 ms RTT, 2.5 % lost each way"
FAR: Final = ", person behind a line too"
UPLOAD, DOWNLOAD, PARAMETERS = "upload and verify", "download", "all parameters"
CONNECTION: Final = "ground station connects"
READ_ANEW: Final = "all parameters, read again"
TOWER_NEW: Final = "all parameters at a tower that has just been started"
KNOCKS: Final = 10
MAX_TOWERS: Final = 5
PEERS_PLANS: Final = 1000
"""MAVSDK's plans are numbered from here: it never sends a plan that the agent has sent."""


@dataclass
class Trial:
    """One environment, loopback or the line, and its results."""

    rig: MissionsRig
    network: Network | None
    figures: Figures
    items: int
    connects_only: bool

    @contextlib.asynccontextmanager
    async def counted(self, system: str, what: str) -> AsyncIterator[None]:
        """Counts the traffic on the drone's line meanwhile, whoever sent it."""
        if self.network is None:
            yield
            return
        before = await self.network.carried("drone")
        yield
        after = await self.network.carried("drone")
        one = Carried(*(late - early for late, early in zip(after, before, strict=True)))
        self.figures.carried.setdefault((system, what), []).append(one)


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--case "ground station"` is a separate case that runs alone.

    `--rounds`, `--loopback`, `--network`, `--system`, `--peers`, `--keep`, `--quick` (20 items, one round).

    `--autopilot`: real ArduCopters in place of the simulator. `--peer-rounds`: the number of rounds for MAVSDK.
    """
    rounds = options.rounds or (1 if options.quick else ROUNDS)
    items = 20 if options.quick else ITEMS
    systems = options.system or [OURS, PEER]
    connects_only = any(case in CONNECTION for case in options.case or [])
    peer = await _peer(report, options.peers.resolve()) if PEER in systems and not connects_only else None
    places = [False] if options.loopback else [True] if options.network else [False, True]
    if True in places and (missing := why_not()) is not None:
        report.say(f"no emulated network: this needs {missing}")
        places = [False]
    with _folder(options.keep) as folder:
        for slow in places:
            where = f"{items} items, {LINE_WORDS if slow else 'loopback'}"
            report.say(f"[bold]{where}[/bold]")
            place = folder / ("line" if slow else "loopback")
            async with _trial(place, report, items, slow, options.autopilot, connects_only) as trial:
                try:
                    peer_rounds = rounds if options.peer_rounds is None else options.peer_rounds
                    await _all_rounds(trial, OURS in systems, peer, rounds, peer_rounds)
                finally:
                    trial.figures.announce(where)


async def _peer(report: Report, folder: Path) -> Installed | None:
    try:
        return await mavsdk_in(folder)
    except CannotInstall as reason:
        report.say(f"without MAVSDK: {reason}")
        return None


@contextlib.contextmanager
def _folder(keep: Path | None) -> Iterator[Path]:
    folder = Path(tempfile.mkdtemp(prefix="bench-missions-")) if keep is None else keep
    try:
        yield folder
    finally:
        if keep is None:
            shutil.rmtree(folder, ignore_errors=True)


@contextlib.asynccontextmanager
async def _trial(
    folder: Path, report: Report, items: int, slow: bool, autopilot: Path | None, connects_only: bool
) -> AsyncIterator[Trial]:
    folder.mkdir(parents=True)  # noqa: ASYNC240 (once, before anything runs)
    async with contextlib.AsyncExitStack() as stack:
        network = None
        if slow:
            network = await stack.enter_async_context(emulated_network({"drone": LINE, "browser": LINE}))
            stack.enter_context(network.inside("tower"))
        rig = MissionsRig(folder, network, autopilot, payloads=connects_only)
        stack.push_async_callback(rig.stop)
        await rig.start()
        yield Trial(rig, network, Figures(report), items, connects_only)


async def _all_rounds(trial: Trial, ours: bool, peer: Installed | None, rounds: int, peer_rounds: int) -> None:
    people: dict[str, RestPerson] = {}
    if trial.network is not None:
        await _line_measured(trial)
    if trial.connects_only:
        await _ground_station(trial, rounds)
        return
    if ours:
        people[""] = await trial.rig.near()
        if trial.network is not None:
            people[FAR] = await trial.rig.far()
        await trial.rig.operator.control("acquire")
        await _until_known(people[""])
    for number in range(rounds):
        if peer is not None and number < peer_rounds:
            await _mavsdk(trial, peer, PEERS_PLANS + number)
        for index, (whose, person) in enumerate(people.items()):
            await _ours(trial, person, whose, 2 * number + index)
    for _ in range(min(rounds, MAX_TOWERS) if ours else 0):
        await _tower_anew(trial)


async def _line_measured(trial: Trial) -> None:
    """Verifies the properties of the line: TCP's own round trip, from the drone to the tower."""
    for _ in range(KNOCKS):
        trial.figures.took(OURS, "TCP handshake of drone and tower", await connect_time_s(trial.rig))


async def _until_known(person: RestPerson) -> None:
    async def known() -> bool:
        return (await person.ask("GET", f"{DRONE}/parameters")).status == 200

    await wait_for("the tower to have the parameters", known)


async def _ours(trial: Trial, person: RestPerson, whose: str, number: int) -> None:
    """Uploads a plan that is new to the drone and reads it back; then downloads it; then reads all parameters."""
    figures, rows = trial.figures, survey(trial.items, number)
    await person.ask("GET", DRONE)  # opens the connection, as a page's is open already
    async with trial.counted(OURS, UPLOAD + whose):
        put = await person.ask("PUT", f"{DRONE}/mission", {"items": rows})
    if put.status != 200 or put.json["state"] != "done":
        figures.failed(OURS, UPLOAD + whose, f"{put.status} {put.json}"[:400])
        return
    figures.took(OURS, UPLOAD + whose, put.took_s)
    async with trial.counted(OURS, DOWNLOAD + whose):
        got = await person.ask("GET", f"{DRONE}/mission?fresh=true")
    if got.status != 200 or not _is_the_plan(got.json["items"], rows):
        figures.failed(OURS, DOWNLOAD + whose, f"{got.status}: not the plan that was sent")
    else:
        figures.took(OURS, DOWNLOAD + whose, got.took_s)
    async with trial.counted(OURS, PARAMETERS + whose):
        table = await person.ask("GET", f"{DRONE}/parameters")
    if table.status != 200 or not table.json["complete"]:
        figures.failed(OURS, PARAMETERS + whose, f"{table.status}")
    else:
        figures.took(OURS, PARAMETERS + whose, table.took_s)
        figures.counts[OURS, PARAMETERS + whose] = len(table.json["values"])
    await _read_anew(trial, person, whose)


async def _ground_station(trial: Trial, rounds: int) -> None:
    """Repeats all of QGroundControl's requests through `tower connect`."""
    figures, loop = trial.figures, asyncio.get_running_loop()
    await _until_known(await trial.rig.near())
    station = await trial.rig.ground_station()
    try:
        for _ in range(rounds):
            began = loop.time()
            try:
                await station.asks_for_messages()
                if trial.rig.has_payloads:
                    await station.asks_payloads()
                got, count, asked = await station.lists()
                figures.took(OURS, f"{CONNECTION}, by list", loop.time() - began)
                figures.report.say(f"    {got} of {count} by list, {asked} of them asked for one by one")
                listed = loop.time()
                in_file, said = await station.reads_file()
                figures.took(OURS, f"{CONNECTION}, by file", loop.time() - listed)
                figures.report.say(f"    {in_file} of {said} by file")
                await station.asks_for_plans()
            except NotAnswered as what:
                figures.failed(OURS, CONNECTION, f"{what} was never answered")
                continue
            if not got == count == in_file == said:
                figures.failed(OURS, CONNECTION, f"{got} of {count} by list, {in_file} of {said} by file")
            figures.counts[OURS, f"{CONNECTION}, by list"] = got
    finally:
        await station.close()


async def _read_anew(trial: Trial, person: RestPerson, whose: str) -> None:
    """Measures from the request until the newly read table is available."""
    figures, began = trial.figures, asyncio.get_running_loop().time()
    async with trial.counted(OURS, READ_ANEW + whose):
        read = await person.ask("POST", f"{DRONE}/parameters/read")
        table = await person.ask("GET", f"{DRONE}/parameters")
    took_s = asyncio.get_running_loop().time() - began
    if read.status != 200 or read.json["state"] != "done" or table.status != 200 or not table.json["complete"]:
        figures.failed(OURS, READ_ANEW + whose, f"{read.status} {table.status} {read.json}"[:300])
    else:
        figures.took(OURS, READ_ANEW + whose, took_s)
        figures.counts[OURS, READ_ANEW + whose] = len(table.json["values"])


def _is_the_plan(got: list[list[Any]], rows: list[list[Any]]) -> bool:
    """As the autopilot keeps it: the same criterion for the tower and MAVSDK."""
    back, sent = (tuple(plan_from_json(json.dumps(one))) for one in (got, rows))
    return same_plan(ArduPilot(), PlanKind.MISSION, sent, back)


async def _mavsdk(trial: Trial, installed: Installed, number: int) -> None:
    """Restarts its server, so that it has no cached data; the clock starts when it is connected."""
    figures, rows = trial.figures, survey(trial.items, number)
    what = "connect"
    try:
        async with trial.rig.mavsdk(installed) as peer:
            what = PARAMETERS
            async with trial.counted(PEER, what):
                table = await peer.do("parameters")
            figures.took(PEER, what, table["s"])
            figures.counts[PEER, what] = table["count"]
            what = UPLOAD
            async with trial.counted(PEER, what):
                up = await peer.do("upload", items=rows)
                down = await peer.do("download")
            if not _is_the_plan(down["items"], rows):
                raise PeerFailed("not the plan that was sent came down")
            figures.took(PEER, what, up["s"] + down["s"])
            figures.took(PEER, "upload", up["s"])
            figures.took(PEER, DOWNLOAD, down["s"])
    except PeerFailed as failure:
        figures.failed(PEER, what, str(failure))


async def _tower_anew(trial: Trial) -> None:
    """Kills and restarts the tower: from the drone being online again until a user gets all parameters."""
    rig = trial.rig
    rig.tower.kill()
    await rig.tower.wait()
    await rig.start_tower()
    person = await rig.near()
    loop = asyncio.get_running_loop()

    async def online() -> bool:
        return bool((await person.ask("GET", DRONE)).json["online"])

    await wait_for("the drone to be online again", online)
    began = loop.time()
    async with trial.counted(OURS, TOWER_NEW):
        await _until_known(person)
    trial.figures.took(OURS, TOWER_NEW, loop.time() - began)
