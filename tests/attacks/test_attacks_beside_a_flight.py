"""Strangers attack a real tower through real sockets while a drone is flown by hand. Its pilot notices nothing.

Time limits are wide because the machine is shared with other tests. `python -m bench anonymous` measures the narrow
ones.
"""

import asyncio
import contextlib
import os
import random
import socket
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import httpx
import pytest
import pytest_asyncio
from unharmed import assert_unharmed, make_patient, unharmed

from bench.as_installed import run_as_installed
from bench.attackers import attacking, post_sign_in
from bench.flown_by_hand import HandFlight, figures_of, flown_by_hand
from bench.load_agents import LoadAgent, kept_alive, sign_in_all
from bench.load_frames import STATE_KINDS, stamped_frame
from bench.load_tower import ADMIN, PASSWORD, load_tower
from bench.process_cost import rss_mb
from server.anonymous.core.limits import LIMITS

pytestmark = pytest.mark.asyncio(loop_scope="module")

ATTACK_S = 2.0
MAX_ATTACK_S = 32.0
NICE = min(19, os.getpriority(os.PRIO_PROCESS, 0) + 10)
"""Always below the flight, which runs at the priority of the tests."""
PILOT = "pilot"
KNOWN_AT = "127.200.0.1"
SETTINGS = {"TOWER_ARGON2_MEMORY_KIB": "65536", "TOWER_ARGON2_ROUNDS": "3"}


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def flight(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[HandFlight]:
    """Drone 2, flown by the admin. Drone 1 is free for attackers that play its agent.

    With the priority of the units, where it is granted: a busy machine must not look like an attack.
    """
    folder: Path = tmp_path_factory.mktemp("attacks")
    async with (
        load_tower(folder, drones=2, settings=SETTINGS, operators=[PILOT]) as tower,
        flown_by_hand(folder, tower) as made,
    ):
        make_patient(tower, 2)
        nice = os.getpriority(os.PRIO_PROCESS, 0)
        run_as_installed(tower_pid=tower.process.pid, agent_pid=made.agent_pid)
        try:
            yield made
        finally:
            os.setpriority(os.PRIO_PROCESS, 0, nice)


async def attacked(
    flight: HandFlight, *kinds: str, enough: Callable[[Counter[str]], bool]
) -> tuple[Counter[str], dict[str, float]]:
    """Returns the attackers' counts, summed, and the growth of the tower's metrics. The flight goes on meanwhile.

    The attackers run at low priority: beside other tests they attack for longer, until they have done enough.
    """
    tower = flight.tower
    before = await figures_of(tower)
    done, attack_s = Counter[str](), ATTACK_S
    while not enough(done) and attack_s <= MAX_ATTACK_S:
        attackers = attacking(kinds, tower.url, tower.udp_port, attack_s, nice=NICE)
        async with attackers as attacks, flight.noticing() as noticed:
            done += sum(await asyncio.gather(*attacks.values()), Counter[str]())
            done["seconds"] += round(attack_s)
        assert_unharmed(noticed)
        attack_s *= 2
    assert enough(done), done
    after = await figures_of(tower)
    return done, {name: after[name] - before.get(name, 0.0) for name in after}


def refused(grown: dict[str, float], what: str) -> float:
    return grown[f'tower_anonymous_refused_total{{what="{what}"}}']


async def test_heads_without_end_cut_nobodys_link(flight: HandFlight) -> None:
    done, grown = await attacked(flight, "heads", enough=lambda done: done["bytes"] > 1_000_000)
    assert refused(grown, "head") > 0
    assert done["connections"] > refused(grown, "head") / 2


async def test_heads_of_a_megabyte_block_nothing(flight: HandFlight) -> None:
    done, grown = await attacked(
        flight, "large-heads", enough=lambda done: done["answered 431"] + done["ended by the tower"] > 0
    )
    assert not any(what.startswith("answered 2") for what in done)
    assert refused(grown, "head") + refused(grown, "unread") > 0


async def test_a_flood_of_requests_is_paced(flight: HandFlight) -> None:
    def answered(done: Counter[str]) -> int:
        return done["upgrades"] + sum(count for what, count in done.items() if what.startswith("answered"))

    done, _ = await attacked(flight, "requests", enough=lambda done: answered(done) > 0)
    most = LIMITS.requests_per_s * (done["seconds"] + 2.0) + LIMITS.requests_burst
    assert answered(done) < 2 * most


async def test_thousands_of_requests_in_one_write_delay_nothing(flight: HandFlight) -> None:
    """Before the fix, frames stopped for two seconds and the tower took 760 MB."""
    _, grown = await attacked(flight, "pipelines", enough=lambda done: done["requests"] > 100_000)
    assert refused(grown, "pipeline") > 0


async def test_pings_of_a_socket_that_does_not_sign_in_hold_no_drone(flight: HandFlight) -> None:
    """Before the fix, 80 such sockets stopped frames for two seconds, and the tower ordered a hold."""
    _, grown = await attacked(flight, "pings", enough=lambda done: done["pings"] > 100_000)
    assert refused(grown, "handshake-bytes") > 0


async def test_bodies_in_chunks_of_a_byte_delay_nothing(flight: HandFlight) -> None:
    done, _ = await attacked(flight, "chunks", enough=lambda done: done["connections"] > 40)
    assert not any(what.startswith("answered 2") for what in done)


async def test_bodies_that_come_a_byte_at_a_time_keep_nobody_else_out(flight: HandFlight) -> None:
    async def others() -> list[int]:
        await asyncio.sleep(ATTACK_S / 2)
        return [await post_sign_in(flight.tower.url, PILOT, PASSWORD, f"127.202.{n}.1") for n in range(2)]

    attack = attacked(flight, "slow-bodies", enough=lambda done: done["bytes"] > 100)
    _, answers = await asyncio.gather(attack, others())
    assert answers == [200, 200]


async def test_a_thousand_connections_are_not_kept_and_keep_nobody_else_out(flight: HandFlight) -> None:
    async def others() -> tuple[int, float]:
        await asyncio.sleep(ATTACK_S / 2)
        status = await post_sign_in(flight.tower.url, PILOT, PASSWORD, "127.203.0.1")
        return status, (await figures_of(flight.tower))["tower_anonymous_connections"]

    attack = attacked(flight, "connections", enough=lambda done: done["connections"] > LIMITS.max_connections)
    (done, grown), (status, kept) = await asyncio.gather(attack, others())
    assert refused(grown, "connections") + done["ended by the tower"] > 0
    assert kept <= LIMITS.max_connections + 10
    assert status == 200


async def test_a_flood_of_sign_ins_locks_nobody_out(flight: HandFlight) -> None:
    """Before the fix, 12 sign-ins a second locked everybody out, because all shared one queue of 64."""
    url = flight.tower.url
    for name in (ADMIN, PILOT):
        assert await post_sign_in(url, name, PASSWORD, KNOWN_AT) == 200

    async def owners() -> list[int]:
        found = []
        for number in range(2):
            await asyncio.sleep(ATTACK_S / 4)
            found.append(await post_sign_in(url, ADMIN, PASSWORD, KNOWN_AT))  # an account that the attackers guess at
            found.append(await post_sign_in(url, PILOT, PASSWORD, f"127.204.{number}.1"))
        return found

    attack = attacked(flight, "sign-ins", enough=lambda done: done["connections"] > 30)
    _, statuses = await asyncio.gather(attack, owners())
    assert statuses == [200] * 4


async def test_tries_from_one_64_lock_nobody_out(flight: HandFlight) -> None:
    """This program is a trusted proxy that reports client addresses, so it can send from many IPv6 addresses."""
    async with httpx.AsyncClient(base_url=flight.tower.url, trust_env=False, timeout=30) as proxy:

        async def sign_in(name: str, address: str) -> int:
            body, headers = {"name": name, "password": PASSWORD}, {"X-Forwarded-For": address}
            return (await proxy.post("/api/v1/session", json=body, headers=headers)).status_code

        async def owners() -> list[int]:
            await asyncio.sleep(ATTACK_S / 2)
            found = []
            for number in range(2):
                found.append(await sign_in(ADMIN, "192.0.2.1"))
                found.append(await sign_in(PILOT, f"198.51.{number}.1"))
            return found

        assert await sign_in(ADMIN, "192.0.2.1") == 200
        attack = attacked(flight, "one-64", enough=lambda done: done["answered 429"] + done["answered 503"] > 30)
        _, statuses = await asyncio.gather(attack, owners())
    assert statuses == [200] * 4


async def test_junk_datagrams_are_counted_and_nothing_else(flight: HandFlight) -> None:
    _, grown = await attacked(flight, "junk", enough=lambda done: done["datagrams"] > 2_000)
    assert grown['tower_drops_total{reason="unknown_link"}'] > 500
    assert refused(grown, "datagrams") > 0


async def test_forged_and_replayed_datagrams_move_nothing(flight: HandFlight) -> None:
    """An attacker on the path replays a drone's datagrams, and mutated ones, from another address."""
    tower = flight.tower
    agents = await sign_in_all(tower.url, tower.keys[:1])
    async with kept_alive(agents):
        seen = _recorded(agents[0])
        before = await figures_of(tower)
        async with unharmed(flight):
            sent = await _replay(seen, tower.udp_port)
        after = await figures_of(tower)
        assert await flight.is_online(1)
    grown = Counter({name: after[name] - before.get(name, 0.0) for name in after})
    dropped = grown['tower_drops_total{reason="not_authentic"}'] + grown['tower_drops_total{reason="replayed"}']
    assert dropped > sent * 0.5
    assert grown['tower_messages_total{direction="in",peer="agent"}'] < sent * 0.5 + 1_000


def _recorded(agent: LoadAgent) -> list[bytes]:
    """Returns datagrams of the drone that the tower has already received."""
    seen: list[bytes] = []
    send = agent._send

    def recording(datagram: bytes) -> None:
        seen.append(datagram)
        send(datagram)

    agent._send = recording  # type: ignore[method-assign]
    for number in range(100):
        now = time.monotonic()
        agent.send([stamped_frame(STATE_KINDS[0], int(now * 1e6), 0, number)], now)
    agent._send = send  # type: ignore[method-assign]
    return seen


async def _replay(seen: list[bytes], udp_port: int) -> int:
    chance, sent = random.Random(16), 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as elsewhere:
        elsewhere.bind(("127.205.0.1", 0))
        elsewhere.setblocking(False)
        for number in range(4_000):
            datagram = bytearray(chance.choice(seen))
            if number % 2:
                datagram[chance.randrange(14, len(datagram))] ^= 1 + chance.randrange(255)
            with contextlib.suppress(OSError):
                elsewhere.sendto(datagram, ("127.0.0.1", udp_port))
                sent += 1
            if number % 16 == 0:
                await asyncio.sleep(0.005)
    return sent


async def test_everything_at_once(flight: HandFlight) -> None:
    await attacked(
        flight, "heads", "requests", "connections", "sign-ins", "junk", enough=lambda done: done["connections"] > 100
    )
    assert flight.tower.process.returncode is None
    assert rss_mb(flight.tower.process.pid) < 400


async def test_a_pilot_whose_hands_are_off_is_noticed(flight: HandFlight) -> None:
    """Shows that these tests can fail. Runs last, because the drone is held from here on."""
    async with flight.noticing() as noticed:
        flight.hands_off = True
        async with asyncio.timeout(30):
            await flight.something_wrong()
    assert noticed.wrong["tower_hold_steps_total"] > 0
    with pytest.raises(AssertionError):
        assert_unharmed(noticed)
