"""Unauthenticated attackers of a tower on loopback: `python -m bench.attackers KIND URL UDP_PORT SECONDS`.

Each kind is a separate process at the lowest priority: on a small machine the attack must cost the tower only its own
work, not the processor that the attacker uses. Source addresses are 127.K.N.1, each in its own /24, none of which is a
trusted proxy. At the end a line of JSON on standard output reports what was done.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import random
import socket
import struct
import sys
import time
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Final
from urllib.parse import urlsplit

from wire.control_messages import KEY_SUBPROTOCOL
from wire.sealing import VERSION

NETWORKS: Final = 20
"""Each kind uses this many source networks: a small botnet."""
LARGE_HEAD_BYTES: Final = 1 << 20
DOWNLOAD: Final = "/basemap/land.json"
CONNECTIONS: Final = 1_000
DATAGRAMS_PER_S: Final = 14_000
CATCHES_UP: Final = 200
_SHORT_REST_S: Final = 0.002


class Attack:
    """Target, duration and results of an attack."""

    def __init__(self, kind: int, url: str, udp_port: int, seconds: float) -> None:
        place = urlsplit(url)
        assert place.hostname is not None and place.port is not None
        self.host, self.port, self.udp_port = place.hostname, place.port, udp_port
        self._kind = kind
        self._ends_at = time.monotonic() + seconds
        self.done: Counter[str] = Counter()
        self.chance = random.Random(kind)

    @property
    def goes_on(self) -> bool:
        return time.monotonic() < self._ends_at

    def source(self, number: int) -> str:
        """Returns a source address of this attack."""
        return f"127.{self._kind}.{number % NETWORKS}.1"

    @contextlib.asynccontextmanager
    async def connection(
        self, number: int, source: str = ""
    ) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
        local = (source or self.source(number), 0)
        reader, writer = await asyncio.open_connection(self.host, self.port, local_addr=local)
        self.done["connections"] += 1
        try:
            yield reader, writer
        finally:
            writer.transport.abort()

    async def over_and_over(self, number: int, once: Callable[[int], Awaitable[None]]) -> None:
        """Repeats until the end, also after the tower has closed the connection."""
        while self.goes_on:
            try:
                async with asyncio.timeout(max(0.1, self._ends_at - time.monotonic())):
                    await once(number)
            except (OSError, EOFError, TimeoutError, ValueError):
                self.done["ended by the tower"] += 1
                await asyncio.sleep(_SHORT_REST_S)


def _request(method: str, path: str, *more: str, body: bytes = b"") -> bytes:
    lines = [f"{method} {path} HTTP/1.1", "Host: tower", *more]
    if body:
        lines += ["Content-Type: application/json", f"Content-Length: {len(body)}"]
    return "\r\n".join([*lines, "", ""]).encode() + body


async def _answer(reader: asyncio.StreamReader) -> int:
    """Returns the status of one response, after reading it to its end."""
    head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").lower()
    _, _, length = head.partition("content-length:")
    if length:
        await reader.readexactly(int(length.split("\r\n")[0]))
    return int(head.split(" ")[1])


async def post_sign_in(url: str, name: str, password: str, address: str, within_s: float = 30.0) -> int:
    """Signs in from a local address, on a separate connection. Returns the status. Raises OSError, EOFError or
    TimeoutError without a response."""
    place = urlsplit(url)
    body = json.dumps({"name": name, "password": password}).encode()
    async with asyncio.timeout(within_s):
        reader, writer = await asyncio.open_connection(place.hostname, place.port, local_addr=(address, 0))
        try:
            writer.write(_request("POST", "/api/v1/session", body=body))
            return await _answer(reader)
        finally:
            writer.transport.abort()


async def heads(attack: Attack) -> None:
    """Endless request heads: `a:b` lines for as long as the tower accepts them."""

    async def once(number: int) -> None:
        async with attack.connection(number) as (_, writer):
            writer.write(b"GET / HTTP/1.1\r\nHost: tower\r\n")
            while attack.goes_on:
                writer.write(b"a:b\r\n" * 4_000)
                attack.done["bytes"] += 20_000
                await writer.drain()

    await asyncio.gather(*(attack.over_and_over(number, once) for number in range(40)))


async def large_heads(attack: Attack) -> None:
    """Complete heads of 1 MB, alternating between one header and 200,000 of them."""
    one = _request("GET", "/api/v1/health", "x: " + "y" * LARGE_HEAD_BYTES)
    many = _request("GET", "/api/v1/health", *["a:b"] * (LARGE_HEAD_BYTES // 5))

    async def once(number: int) -> None:
        async with attack.connection(number) as (reader, writer):
            writer.write(attack.chance.choice((one, many)))
            attack.done[f"answered {await _answer(reader)}"] += 1

    await asyncio.gather(*(attack.over_and_over(number, once) for number in range(40)))


async def requests(attack: Attack) -> None:
    """As many requests and upgrades as the tower accepts, with a cookie that it must look up."""
    cookie = "Cookie: tower_session=" + "x" * 43
    upgrade = ("Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13", "Origin: http://tower")
    key = "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="

    async def once(number: int) -> None:
        async with attack.connection(number) as (reader, writer):
            if number % 4 == 0:
                writer.write(_request("GET", "/api/v1/live", cookie, key, *upgrade))
                await reader.readuntil(b"\r\n\r\n")
                attack.done["upgrades"] += 1
                return
            while attack.goes_on:
                writer.write(_request("GET", "/api/v1/me", cookie))
                attack.done[f"answered {await _answer(reader)}"] += 1

    await asyncio.gather(*(attack.over_and_over(number, once) for number in range(80)))


async def pipelines(attack: Attack) -> None:
    """Thousands of short requests in one write, before the first answer."""
    many = b"GET / HTTP/1.1\r\n\r\n" * 8_000

    async def once(number: int) -> None:
        async with attack.connection(number) as (reader, writer):
            writer.write(many)
            attack.done["requests"] += 8_000
            while await reader.read(65_536):
                pass
        raise EOFError

    await asyncio.gather(*(attack.over_and_over(number, once) for number in range(40)))


async def downloads(attack: Attack) -> None:
    """The console's largest files, and one byte of them in many ranges, as fast as they come."""
    ranges = ",".join(f"{at}-{at}" for at in range(0, 4_000, 2))
    whole, parts = (_request("GET", DOWNLOAD), _request("GET", DOWNLOAD, f"Range: bytes={ranges}"[:15_000]))

    async def once(number: int) -> None:
        async with attack.connection(number) as (reader, writer):
            writer.write(parts if number % 4 == 0 else whole)
            while data := await reader.read(262_144):
                attack.done["bytes"] += len(data)
        raise EOFError

    await asyncio.gather(*(attack.over_and_over(number, once) for number in range(80)))


async def chunks(attack: Attack) -> None:
    """Bodies of sign-ins in chunks of one byte, as fast as the tower reads."""
    head = _request("POST", "/api/v1/session", "Content-Type: application/json", "Transfer-Encoding: chunked")
    many = b"1\r\n \r\n" * 15_000 + b"0\r\n\r\n"

    async def once(number: int) -> None:
        async with attack.connection(number) as (reader, writer):
            writer.write(head + many)
            attack.done[f"answered {await _answer(reader)}"] += 1

    await asyncio.gather(*(attack.over_and_over(number, once) for number in range(40)))


async def pings(attack: Attack) -> None:
    """WebSockets of agents that send pings, as fast as the tower reads, instead of signing in."""
    upgrade = ("Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13")
    key = "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="
    protocol = f"Sec-WebSocket-Protocol: {KEY_SUBPROTOCOL}"
    many = b"\x89\x80\0\0\0\0" * 4_000

    async def once(number: int) -> None:
        async with attack.connection(number) as (reader, writer):
            writer.write(_request("GET", "/api/v1/agent", key, protocol, *upgrade))
            await reader.readuntil(b"\r\n\r\n")
            attack.done["upgrades"] += 1
            draining = asyncio.create_task(reader.read(-1))
            try:
                while attack.goes_on and not draining.done():
                    writer.write(many)
                    await writer.drain()
                    attack.done["pings"] += 4_000
            finally:
                draining.cancel()
        raise EOFError

    await asyncio.gather(*(attack.over_and_over(number, once) for number in range(80)))


async def slow_bodies(attack: Attack) -> None:
    """Sign-ins with bodies sent a byte at a time."""

    async def once(number: int) -> None:
        async with attack.connection(number) as (_, writer):
            writer.write(_request("POST", "/api/v1/session", "Content-Type: application/json", "Content-Length: 9000"))
            while attack.goes_on:
                writer.write(b" ")
                await writer.drain()
                attack.done["bytes"] += 1
                await asyncio.sleep(0.2)

    await asyncio.gather(*(attack.over_and_over(number, once) for number in range(200)))


async def connections(attack: Attack) -> None:
    """Idle connections; each that is closed is opened again."""

    async def once(number: int) -> None:
        async with attack.connection(number) as (reader, _):
            await reader.read()
        await asyncio.sleep(0.1)
        raise EOFError

    await asyncio.gather(*(attack.over_and_over(number, once) for number in range(CONNECTIONS)))


async def sign_ins(attack: Attack) -> None:
    """Wrong passwords, for existing and non-existing names, from all networks in turn."""

    async def once(number: int) -> None:
        name = attack.chance.choice(("admin", "nobody", f"user {attack.chance.randrange(1_000)}"))
        body = json.dumps({"name": name, "password": f"wrong {attack.chance.random()}"}).encode()
        async with attack.connection(attack.chance.randrange(NETWORKS)) as (reader, writer):
            writer.write(_request("POST", "/api/v1/session", body=body))
            attack.done[f"answered {await _answer(reader)}"] += 1
        await asyncio.sleep(0.05)

    await asyncio.gather(*(attack.over_and_over(number, once) for number in range(64)))


async def one_64(attack: Attack) -> None:
    """Wrong passwords from the addresses of one IPv6 /64, as forwarded by a trusted proxy."""

    async def once(number: int) -> None:
        body = json.dumps({"name": f"nobody {number % 9}", "password": "wrong"}).encode()
        client = f"X-Forwarded-For: 2001:db8:1:2::{attack.chance.getrandbits(16):x}"
        async with attack.connection(number, "127.0.0.1") as (reader, writer):
            writer.write(_request("POST", "/api/v1/session", client, body=body))
            attack.done[f"answered {await _answer(reader)}"] += 1
        await asyncio.sleep(0.05)

    await asyncio.gather(*(attack.over_and_over(number, once) for number in range(180)))


async def junk(attack: Attack) -> None:
    """Datagrams: noise of all lengths, and imitations of datagrams of a link that does not exist."""
    sockets = []
    for number in range(NETWORKS):
        one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        one.bind((attack.source(number), 0))
        one.setblocking(False)
        sockets.append(one)
    noise = [attack.chance.randbytes(attack.chance.choice((1, 15, 60, 300, 1_400))) for _ in range(64)]
    forged = [
        struct.pack("<BBIQ", VERSION, 0, attack.chance.getrandbits(32), 1) + attack.chance.randbytes(60)
        for _ in range(192)
    ]
    began, sent = time.monotonic(), 0
    try:
        while attack.goes_on:
            due = int((time.monotonic() - began) * DATAGRAMS_PER_S) - sent
            for _ in range(min(due, CATCHES_UP)):  # after a delay by the machine it does not catch up all at once
                with contextlib.suppress(OSError):
                    sockets[sent % NETWORKS].sendto((noise + forged)[sent % 256], (attack.host, attack.udp_port))
                sent += 1
            await asyncio.sleep(_SHORT_REST_S)
    finally:
        for one in sockets:
            one.close()
    attack.done["datagrams"] = sent
    attack.done["datagrams a second"] = round(sent / (time.monotonic() - began))


KINDS: Final[dict[str, Callable[[Attack], Awaitable[None]]]] = {
    "heads": heads,
    "large-heads": large_heads,
    "requests": requests,
    "slow-bodies": slow_bodies,
    "connections": connections,
    "sign-ins": sign_ins,
    "junk": junk,
}

MORE_KINDS: Final[dict[str, Callable[[Attack], Awaitable[None]]]] = {
    "pipelines": pipelines,
    "chunks": chunks,
    "downloads": downloads,
    "pings": pings,
}
"""Not in "all at once": each keeps a processor busy by itself, and a small machine has two."""
_ALL: Final = KINDS | MORE_KINDS | {"one-64": one_64}
"""Includes kinds that need a tower that trusts 127.0.0.1 as a proxy."""


async def run(kind: str, url: str, udp_port: int, seconds: float) -> Counter[str]:
    """Runs until the time is over. Returns what was done."""
    attack = Attack(10 + list(_ALL).index(kind), url, udp_port, seconds)
    await _ALL[kind](attack)
    return attack.done


@contextlib.asynccontextmanager
async def attacking(
    kinds: tuple[str, ...], url: str, udp_port: int, seconds: float, *, nice: int = 19
) -> AsyncIterator[dict[str, asyncio.Task[Counter[str]]]]:
    """Runs a process for each kind at this low priority, until its time is over or the block ends."""
    tasks: dict[str, asyncio.Task[Counter[str]]] = {}
    processes = []
    try:
        for kind in kinds:
            words = [sys.executable, "-m", "bench.attackers", kind, url, str(udp_port), str(seconds), str(nice)]
            process = await asyncio.create_subprocess_exec(
                *words, stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE
            )
            processes.append(process)
            tasks[kind] = asyncio.create_task(_done(process))
        yield tasks
    finally:
        for process in processes:
            if process.returncode is None:
                with contextlib.suppress(ProcessLookupError):
                    process.kill()
        await asyncio.gather(*tasks.values(), return_exceptions=True)


async def _done(process: asyncio.subprocess.Process) -> Counter[str]:
    said, _ = await process.communicate()
    return Counter(json.loads(said)) if said.strip() else Counter()


def main(words: list[str]) -> None:
    kind, url, udp_port, seconds, nice = words
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))  # the parent may have precedence over everything else
    os.setpriority(os.PRIO_PROCESS, 0, int(nice))
    soft = CONNECTIONS * 2
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        now, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(now, min(soft, hard) if hard >= 0 else soft), hard))
    print(json.dumps(asyncio.run(run(kind, url, int(udp_port), float(seconds)))))


if __name__ == "__main__":
    main(sys.argv[1:])
