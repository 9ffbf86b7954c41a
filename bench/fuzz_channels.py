"""Sends mutated messages to a running tower through real WebSockets, and checks the account: sent = accepted + refused.

Refusals are known from what the tower itself reports: the counts in its notices, and its documented close codes.
Accepted binary messages must arrive at the drone. The product's own decoders give the expected result for a message;
this checks that the tower follows it.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
from collections import Counter
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from bench.fuzz_messages import MAX_READ_BYTES, MessageFuzzer
from bench.key_sign_in import say_hello
from server.live.live_messages import MalformedRequest, decode_request
from wire.control_messages import KEY_SUBPROTOCOL, MalformedMessage, decode_to_tower
from wire.drone_key import parse_drone_key
from wire.frames import MalformedFrame
from wire.tagged import MAX_UPWARD_MESSAGE_BYTES, split_stamp, split_tagged

_ANSWER_WITHIN_S: Final = 20.0
_BATCH: Final = 32
_MISUSED, _NO_UTF8, _TOO_LARGE = 4400, 1007, 1009
_MAX_MALFORMED: Final = 20
"""Malformed texts after which the tower closes the live channel."""
_MAX_REPORTED: Final = 10


@dataclass
class Account:
    """The results for a number of messages (for binary ones: of the frames in them)."""

    messages: int = 0
    accepted: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    connections: int = 0
    wrong: list[str] = field(default_factory=list)

    def announce(self, words: str) -> None:
        """Records a fault."""
        if len(self.wrong) < _MAX_REPORTED:
            self.wrong.append(words)


@dataclass(frozen=True)
class Target:
    """A running tower, a user's session in it, and drones."""

    url: str
    cookie: str
    drone_ids: tuple[int, ...]
    """The user has the controls of the first one."""
    keys: tuple[str, ...]
    """Keys of drones attacked as their own agents, in turn: the tower limits the reports per second of each."""


class _Browser:
    """A connection to the live channel that reads everything, answers pings and sums the notices."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.refused: Counter[str] = Counter()
        self.not_understood = 0
        """Texts: each is answered at once and separately."""
        self.news = asyncio.Event()
        self._reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for message in self.connection:
                if isinstance(message, bytes):
                    continue
                event = json.loads(message)
                if event["type"] == "ping":
                    await self.connection.send(json.dumps({"type": "pong", "sequence": event["sequence"]}))
                elif event["type"] == "notice" and event["text"].startswith("Not understood"):
                    self.not_understood += 1
                elif event["type"] == "notice":
                    self.refused[event["code"]] += event["count"]
                self.news.set()
        self.news.set()

    async def until(self, reached: Callable[[], bool]) -> bool:
        """Returns False after the deadline."""
        try:
            async with asyncio.timeout(_ANSWER_WITHIN_S):
                while not reached():
                    self.news.clear()
                    await self.news.wait()
        except TimeoutError:
            return False
        return True

    def has_answered(self, texts: int) -> bool:
        """Returns whether this many are answered, or the connection is closed."""
        return self.closed or self.not_understood >= texts

    @property
    def closed(self) -> bool:
        return self._reading.done()

    async def close(self) -> None:
        await self.connection.close()
        await self._reading


@contextlib.asynccontextmanager
async def _live(target: Target) -> AsyncIterator[_Browser]:
    connection = await connect(
        target.url.replace("http", "ws", 1) + "/api/v1/live",
        subprotocols=[Subprotocol("tower.v1")],
        additional_headers={"Cookie": target.cookie, "Origin": target.url},
        compression=None,
        proxy=None,
        max_size=None,
        open_timeout=_ANSWER_WITHIN_S,
    )
    browser = _Browser(connection)
    try:
        yield browser
    finally:
        await browser.close()


async def attack_live_in_bytes(
    target: Target, chance: random.Random, messages: int, *, arrived: Callable[[], int]
) -> Account:
    """Sends mutated tagged frames. `arrived`: the number of frames that have reached the drones so far."""
    account = Account(connections=1)
    fuzzer = MessageFuzzer(chance, target.drone_ids)
    before = arrived()
    frames = 0
    async with _live(target) as browser:
        await browser.connection.send(json.dumps({"type": "watch", "rate_hz": 1}))
        for number in range(messages):
            message = fuzzer.binary().data
            frames += _frames_in(message)
            await browser.connection.send(message)
            if number % _BATCH == 0:
                await asyncio.sleep(0.001)
            if browser.closed:
                account.announce(f"closed with {browser.connection.close_code}")
                break
        account.messages = messages

        def balanced() -> bool:
            return browser.refused.total() + arrived() - before >= frames

        await browser.until(balanced)
        account.accepted = arrived() - before
        account.refused = browser.refused
    if account.accepted + account.refused.total() != frames:
        account.announce(
            f"{frames} frames were sent, {account.accepted} arrived, {account.refused.total()} were refused"
        )
    return account


def _frames_in(message: bytes) -> int:
    """Returns how many results a binary message has: one for each frame, or one if it is dropped whole."""
    if len(message) > MAX_UPWARD_MESSAGE_BYTES:
        return 1
    try:
        return len(split_tagged(split_stamp(message)[1]))
    except MalformedFrame:
        return 1


async def attack_live_in_text(target: Target, chance: random.Random, messages: int) -> Account:
    """Sends mutated requests. Reconnects whenever the tower has closed, which it must do at the right moment."""
    account = Account()
    fuzzer = MessageFuzzer(chance, target.drone_ids)
    while account.messages < messages:
        account.connections += 1
        async with _live(target) as browser:
            await _texts_until_closed(browser, fuzzer, account, messages)
    return account


async def _texts_until_closed(browser: _Browser, fuzzer: MessageFuzzer, account: Account, messages: int) -> None:
    malformed = 0
    while account.messages < messages:
        text = fuzzer.browser_text().data
        account.messages += 1
        deserved = _deserved(text, decode_request)
        await browser.connection.send(text, text=True)
        if deserved == _MISUSED:
            malformed += 1
            account.refused["malformed"] += 1
            if malformed < _MAX_MALFORMED:
                if not await browser.until(partial(browser.has_answered, malformed)):
                    account.announce(f"no answer to {text[:200]!r}")
                if browser.closed:
                    account.announce(f"closed with {browser.connection.close_code} after {text[:200]!r}")
                    return
                continue
        elif deserved is None:
            account.accepted += 1
            continue
        else:
            account.refused[str(deserved)] += 1
        await _expect_close(browser.connection, deserved, text, account)
        return


async def attack_agent(target: Target, chance: random.Random, messages: int) -> Account:
    """As a signed-in agent: sends messages of which some are valid. One that makes no sense must cost nothing else; one
    that cannot even be read as text must close the channel."""
    account = Account()
    fuzzer = MessageFuzzer(chance, target.drone_ids)
    while account.messages < messages:
        key = parse_drone_key(target.keys[account.connections % len(target.keys)])
        account.connections += 1
        connection = await connect(
            target.url.replace("http", "ws", 1) + "/api/v1/agent",
            subprotocols=[Subprotocol(KEY_SUBPROTOCOL)],
            compression=None,
            proxy=None,
            open_timeout=_ANSWER_WITHIN_S,
        )
        try:
            await say_hello(connection, key)
            await connection.recv()
            await _agent_until_closed(connection, fuzzer, account, messages)
        except ConnectionClosed as closed:
            account.announce(f"closed in between: {closed}")
        finally:
            await connection.close()
    return account


async def _agent_until_closed(
    connection: ClientConnection, fuzzer: MessageFuzzer, account: Account, messages: int
) -> None:
    while account.messages < messages:
        text = fuzzer.agent_text().data
        account.messages += 1
        deserved = _deserved(text, decode_to_tower)
        await connection.send(text, text=True)
        if deserved is None:
            account.accepted += 1
            continue
        account.refused[str(deserved)] += 1
        if deserved == _MISUSED:
            await asyncio.wait_for(await connection.ping(), _ANSWER_WITHIN_S)
            continue
        await _expect_close(connection, deserved, text, account)
        return


def _deserved(text: bytes, decode: Callable[[str], Any]) -> int | None:
    """Returns the expected close code for a text message (with others of its kind), or None if it is valid."""
    if len(text) > MAX_READ_BYTES:
        return _TOO_LARGE
    try:
        decode(text.decode())
    except UnicodeDecodeError:
        return _NO_UTF8
    except (MalformedRequest, MalformedMessage):
        return _MISUSED
    return None


async def _expect_close(connection: ClientConnection, code: int, text: bytes, account: Account) -> None:
    try:
        await asyncio.wait_for(connection.wait_closed(), _ANSWER_WITHIN_S)
    except TimeoutError:
        account.announce(f"not closed after {text[:200]!r}")
        return
    if connection.close_code != code:
        account.announce(f"closed with {connection.close_code} instead of {code} after {text[:200]!r}")
