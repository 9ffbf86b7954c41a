"""Sends mutated units, texts and tickets to a running tower through the two WebSockets of video, and checks the
account.

The product's own decoders give the expected result for a message. A viewer must meanwhile receive only whole units,
each decodable with those before it.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
from collections.abc import AsyncIterator, Callable
from typing import Final

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Subprotocol

from bench.fuzz_bytes import Mutator
from bench.fuzz_channels import Account, Target
from bench.fuzz_messages import MessageFuzzer
from bench.key_sign_in import say_hello
from server.video.core.viewer_messages import MAX_REQUEST_BYTES, MalformedVideoRequest, decode_video_request
from wire.control_messages import KEY_SUBPROTOCOL, decode_to_agent
from wire.drone_key import parse_drone_key
from wire.video import (
    AGENT_VIDEO_SUBPROTOCOL,
    MAX_UNIT_BYTES,
    VIDEO,
    VIEWER_VIDEO_SUBPROTOCOL,
    Codec,
    MalformedUnit,
    Quality,
    Unit,
    VideoWanted,
    decode_head,
    decode_unit,
    encode_unit,
)

_ANSWER_WITHIN_S: Final = 20.0
_MISUSED, _NO_UTF8, _TOO_LARGE, _CUT_OFF = 4400, 1007, 1009, 1006
_MAX_UNITS: Final = 1000
"""On one connection: below the tower's flood limit."""
_MAX_REQUESTS: Final = 500


@contextlib.asynccontextmanager
async def _socket(address: str, subprotocol: str, headers: dict[str, str]) -> AsyncIterator[ClientConnection]:
    connection = await connect(
        address,
        subprotocols=[Subprotocol(subprotocol)],
        additional_headers=headers,
        compression=None,
        proxy=None,
        max_size=None,
        open_timeout=_ANSWER_WITHIN_S,
    )
    try:
        yield connection
    finally:
        await connection.close()


@contextlib.asynccontextmanager
async def _watching(target: Target, drone_id: int) -> AsyncIterator[ClientConnection]:
    address = f"{target.url.replace('http', 'ws', 1)}/api/v1/drones/{drone_id}/video?quality=medium&codec=mpeg1"
    headers = {"Cookie": target.cookie, "Origin": target.url}
    async with _socket(address, VIEWER_VIDEO_SUBPROTOCOL, headers) as connection:
        yield connection


async def attack_video_in_text(target: Target, chance: random.Random, messages: int) -> Account:
    """As a viewer: sends requests of which some are valid; the first that is not must close the connection."""
    account = Account()
    fuzzer = MessageFuzzer(chance, target.drone_ids)
    while account.messages < messages:
        account.connections += 1
        async with _watching(target, target.drone_ids[0]) as viewer:
            await _until_closed(viewer, lambda: fuzzer.viewer_text().data, _text_earns, account, messages, text=True)
    return account


def _text_earns(text: bytes) -> tuple[int, ...]:
    if len(text) > MAX_REQUEST_BYTES:
        return (_TOO_LARGE,)
    try:
        text.decode()
    except UnicodeDecodeError:
        return _NO_UTF8, _MISUSED  # depends on which of the two receives it
    try:
        decode_video_request(text)
    except MalformedVideoRequest:
        return (_MISUSED,)
    return ()


async def attack_video_in_bytes(target: Target, chance: random.Random, messages: int) -> Account:
    """As a signed-in agent: sends mutated units while somebody watches, and invalid tickets."""
    account = Account()
    fuzzer = _UnitFuzzer(chance)
    key = parse_drone_key(target.keys[0])
    tower = target.url.replace("http", "ws", 1)
    async with _socket(f"{tower}/api/v1/agent", KEY_SUBPROTOCOL, {}) as link:
        await say_hello(link, key, takes=(VIDEO,))
        ticket = await _ticket(link)
        async with _watching(target, int(key.drone_id)) as viewer:
            watching = asyncio.create_task(_watch(viewer, account))
            while account.messages < messages:
                account.connections += 1
                await _bad_ticket(f"{tower}/api/v1/agent/video", fuzzer.ticket(ticket), account)
                headers = {"Authorization": f"Bearer {ticket}"}
                async with _socket(f"{tower}/api/v1/agent/video", AGENT_VIDEO_SUBPROTOCOL, headers) as channel:
                    reading = asyncio.create_task(_read(channel))
                    await _until_closed(channel, fuzzer.unit, _unit_earns, account, messages, text=False)
                    await channel.close()
                    await reading
            if watching.done():
                account.announce(f"the viewer was closed with {viewer.close_code}")
            await viewer.close()
            if await watching == 0:
                account.announce("the viewer got nothing")
    return account


async def _ticket(link: ClientConnection) -> str:
    async with asyncio.timeout(_ANSWER_WITHIN_S):
        while True:
            message = decode_to_agent(str(await link.recv()))
            if isinstance(message, VideoWanted):
                return message.ticket


async def _bad_ticket(address: str, ticket: str, account: Account) -> None:
    try:
        async with _socket(address, AGENT_VIDEO_SUBPROTOCOL, {"Authorization": f"Bearer {ticket}"}):
            account.announce(f"the ticket {ticket!r} was taken")
    except InvalidStatus as error:
        if error.response.status_code != 401:
            account.announce(f"status {error.response.status_code} for the ticket {ticket!r}")


async def _read(channel: ClientConnection) -> None:
    with contextlib.suppress(ConnectionClosed):
        async for _ in channel:
            pass


async def _watch(viewer: ClientConnection, account: Account) -> int:
    """Returns the number of units that arrived; records their faults."""
    came, sequence = 0, -1
    with contextlib.suppress(ConnectionClosed):
        async for message in viewer:
            if isinstance(message, str):
                continue
            unit = decode_unit(message)
            if not unit.key and (unit.is_break or unit.sequence != (sequence + 1) % (1 << 32)):
                account.announce(f"a viewer got {unit.sequence} after {sequence}, and no key")
            came, sequence = came + 1, unit.sequence
            await viewer.send(json.dumps({"type": "got", "sequence": sequence}))
    return came


def _unit_earns(message: bytes) -> tuple[int, ...]:
    if len(message) > MAX_UNIT_BYTES:
        return _TOO_LARGE, _CUT_OFF  # the reason may be lost with data in transit
    try:
        decode_head(message)
    except MalformedUnit:
        return (_MISUSED,)
    return ()


async def _until_closed(
    connection: ClientConnection,
    make: Callable[[], bytes],
    earns: Callable[[bytes], tuple[int, ...]],
    account: Account,
    messages: int,
    *,
    text: bool,
) -> None:
    for _ in range(_MAX_REQUESTS if text else _MAX_UNITS):
        if account.messages >= messages:
            return
        message = make()
        account.messages += 1
        earned = earns(message)
        try:
            await connection.send(message, text=text)
        except ConnectionClosed:
            account.announce(f"closed with {connection.close_code} before {message[:200]!r}")
            return
        if not earned:
            account.accepted += 1
            continue
        account.refused[str(earned[0])] += 1
        try:
            await asyncio.wait_for(connection.wait_closed(), _ANSWER_WITHIN_S)
        except TimeoutError:
            account.announce(f"not closed after {message[:200]!r}")
        if connection.close_code not in earned:
            account.announce(f"closed with {connection.close_code} instead of {earned} after {message[:200]!r}")
        return


class _UnitFuzzer:
    """Units of one stream as from a camera, some of which are wrong or have false contents."""

    def __init__(self, chance: random.Random) -> None:
        self._chance = chance
        self._mutator = Mutator(chance)
        self._sequence = chance.choice((0, (1 << 32) - 20))

    def ticket(self, right: str) -> str:
        """Never the right one."""
        begun = right[: self._chance.randrange(len(right))]
        return self._chance.choice(("", "none", begun, right + "A", right.swapcase(), "A" * 5000))

    def unit(self) -> bytes:
        """Usually valid."""
        chance, pick = self._chance, self._chance.random()
        right = encode_unit(self._genuine())
        if pick < 0.93:
            return right
        if pick < 0.96:
            return self._mutator.mutate(right[:28]) + right[28:]
        if pick < 0.98:
            return right[: chance.randrange(40)]
        if pick < 0.99:
            return chance.randbytes(chance.randint(0, 300))
        return right + bytes(MAX_UNIT_BYTES)

    def _genuine(self) -> Unit:
        chance = self._chance
        leaps = chance.random() < 0.05
        self._sequence = chance.getrandbits(32) if leaps else (self._sequence + 1) % (1 << 32)
        return Unit(
            quality=Quality.MEDIUM if chance.random() < 0.9 else chance.choice(tuple(Quality)),
            codec=Codec.MPEG1,
            sequence=self._sequence,
            key=chance.random() < 0.2,
            is_break=chance.random() < 0.02,
            capture_us=chance.choice((0, 1, chance.getrandbits(40), (1 << 64) - 1)),
            width=chance.choice((320, 1, 0xFFFF)),
            height=240,
            rate_hz=chance.choice((24.0, 0.01, 655.35)),
            bits_per_s=chance.choice((450_000, 0, (1 << 32) - 1)),
            held_ms=3,
            payload=chance.randbytes(chance.choice((1, 188, 2_000, 60_000))),
        )
