"""Passwords: generated, and hashed with Argon2id, few at a time, because each hash takes tens of megabytes.

`password_policy.py` decides which ones are acceptable.
"""

from __future__ import annotations

import asyncio
import secrets
from itertools import count
from typing import Any

from passlib.hash import argon2

from server.accounts.store.hash_worker import PARALLELISM
from server.accounts.store.hashing_process import Hashing, HashingFailed, HashingThreads
from server.anonymous.core.budget import AnonymousBudget, Over
from server.anonymous.core.fair_queue import Priority, Ticket
from server.anonymous.core.hashing import Caller, HashingSlots
from server.anonymous.core.limits import LIMITS
from server.anonymous.core.networks import Origin
from server.kernel.refusal import RetryLater


class TooManySignIns(RetryLater):
    def __init__(self) -> None:
        super().__init__("too many people are signing in: try again", retry_after_s=5)


def generate_password() -> str:
    """About 95 random bits, without letters that look alike."""
    letters = "abcdefghijkmnpqrstuvwxyz23456789"
    return "-".join("".join(secrets.choice(letters) for _ in range(5)) for _ in range(4))


class Passwords:
    """Runs `concurrency` hashes at a time, in `hashing`. `server.anonymous.core.hashing` orders the queue."""

    def __init__(
        self,
        *,
        concurrency: int,
        memory_kib: int,
        rounds: int,
        budget: AnonymousBudget | None = None,
        hashing: Hashing | None = None,
    ) -> None:
        """`hashing` None: threads of this process."""
        self._hasher = argon2.using(type="ID", memory_cost=memory_kib, rounds=rounds, parallelism=PARALLELISM)
        self._costs = {"memory_kib": memory_kib, "rounds": rounds}
        self._hashing = hashing or HashingThreads(concurrency)
        self._limits = budget.limits if budget is not None else LIMITS
        self._budget = budget
        self._slots = HashingSlots[asyncio.Future[None]](concurrency, self._limits)
        self._signed_in = count()
        self._running: set[asyncio.Task[str | bool]] = set()
        self._dummy_hash: str | None = None

    async def close(self) -> None:
        """Ends the process or the threads."""
        await self._hashing.close()

    async def warm_up(self) -> None:
        """Creates the hash that unknown names are checked against, so that even the first check takes the full time."""
        self._dummy_hash = await self.hash(secrets.token_urlsafe())

    async def hash(self, password: str, *, caller: Caller | None = None) -> str:
        """`caller` None: a signed-in user. Raises TooManySignIns."""
        return str(await self._ask(caller, {"password": password, **self._costs}))

    async def verify(self, password: str, password_hash: str | None, *, caller: Caller | None = None) -> bool:
        """With None (no such user) takes as long as with a real hash, and returns False. `caller` as above."""
        if password_hash is None:
            if self._dummy_hash is None:
                await self.warm_up()
            await self._ask(caller, {"password": password, "hash": self._dummy_hash})
            return False
        return bool(await self._ask(caller, {"password": password, "hash": password_hash}))

    def needs_rehash(self, password_hash: str) -> bool:
        """Whether the hash was made with different cost parameters than today's."""
        return bool(self._hasher.needs_update(password_hash))

    async def _ask(self, caller: Caller | None, question: dict[str, Any]) -> str | bool:
        if caller is None:  # one caller each: they do not share the limits of an address
            number = f"signed in {next(self._signed_in)}"
            caller = Caller(Origin(number, number), Priority.KNOWN)
        ticket = await self._turn(caller)
        # A caller that disconnects does not stop the hash, and its slot stays taken until it is done.
        running = asyncio.create_task(self._answered(ticket, question))
        self._running.add(running)
        running.add_done_callback(self._running.discard)
        return await asyncio.shield(running)

    async def _answered(self, ticket: Ticket[asyncio.Future[None]], question: dict[str, Any]) -> str | bool:
        try:
            return await self._hashing.ask(question)
        except HashingFailed:
            raise TooManySignIns from None
        finally:
            self._done(ticket)

    async def _turn(self, caller: Caller) -> Ticket[asyncio.Future[None]]:
        """Returns when a thread is free for this caller. Raises TooManySignIns."""
        waiting = asyncio.get_running_loop().create_future()
        place = self._slots.ask(waiting, caller)
        if place.pushed_out is not None and not place.pushed_out.item.done():
            place.pushed_out.item.set_exception(TooManySignIns())
        if place.ticket is None:
            self._refused(Over.HASHES)
            raise TooManySignIns
        self._begin()
        has_turn = False
        try:
            async with asyncio.timeout(self._limits.hash_wait_s):
                await waiting
            has_turn = True
        except TimeoutError:
            self._refused(Over.HASH_TIME)
            raise TooManySignIns from None
        except TooManySignIns:
            self._refused(Over.HASHES)
            raise
        finally:
            if not has_turn:
                self._give_up(place.ticket)
            self._notify()
        return place.ticket

    def _give_up(self, ticket: Ticket[asyncio.Future[None]]) -> None:
        called = ticket.item.done() and not ticket.item.cancelled() and ticket.item.exception() is None
        if called:  # the turn came at the moment of giving up
            self._done(ticket)
        else:
            self._slots.leave(ticket)

    def _done(self, ticket: Ticket[asyncio.Future[None]]) -> None:
        self._slots.done(ticket)
        self._begin()

    def _begin(self) -> None:
        while (ticket := self._slots.next()) is not None:
            if ticket.item.done():
                self._slots.done(ticket)
            else:
                ticket.item.set_result(None)
        self._notify()

    def _refused(self, over: Over) -> None:
        if self._budget is not None:
            self._budget.refused[over] += 1

    def _notify(self) -> None:
        if self._budget is not None:
            self._budget.waiting["hashes"] = self._slots.waiting
