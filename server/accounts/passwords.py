"""Passwords: what is acceptable, and Argon2id in threads, few at a time, because each hash takes tens of megabytes."""

from __future__ import annotations

import asyncio
import secrets
from typing import Final

from passlib.hash import argon2

from server.refusal import Refusal, RetryLater

SHORTEST: Final = 8
LONGEST: Final = 256
"""Hashing time does not grow with it, but a request has to end somewhere."""
MOST_WAITING: Final = 64
"""More sign-ins than this waiting for a thread: the tower says so, instead of letting everybody wait for minutes."""


class BadPassword(Refusal):
    """Not acceptable as a new password."""


class TooManySignIns(RetryLater):
    def __init__(self) -> None:
        super().__init__("too many people are signing in at this moment", retry_after_s=5)


def check_password(password: str) -> None:
    """Raises BadPassword. Any characters will do; only the length counts."""
    if len(password) < SHORTEST:
        raise BadPassword(f"a password has at least {SHORTEST} characters")
    if len(password) > LONGEST:
        raise BadPassword(f"a password has at most {LONGEST} characters")


def generate_password() -> str:
    """About 95 random bits, without letters that look alike."""
    letters = "abcdefghijkmnpqrstuvwxyz23456789"
    return "-".join("".join(secrets.choice(letters) for _ in range(5)) for _ in range(4))


class Passwords:
    def __init__(self, *, concurrency: int, memory_kib: int, rounds: int) -> None:
        self._hasher = argon2.using(type="ID", memory_cost=memory_kib, rounds=rounds, parallelism=4)
        self._threads = asyncio.Semaphore(concurrency)
        self._waiting = 0
        self._dummy_hash: str | None = None

    async def warm_up(self) -> None:
        """Makes the hash that unknown names are checked against, so that even the first one takes its time."""
        self._dummy_hash = await self.hash(secrets.token_urlsafe())

    async def hash(self, password: str) -> str:
        return str(await self._in_thread(self._hasher.hash, password))

    async def verify(self, password: str, password_hash: str | None) -> bool:
        """With None (nobody of that name) takes as long as with a real hash, and answers False."""
        if password_hash is None:
            if self._dummy_hash is None:
                await self.warm_up()
            await self._in_thread(self._hasher.verify, password, self._dummy_hash or "")
            return False
        return bool(await self._in_thread(self._hasher.verify, password, password_hash))

    def needs_rehash(self, password_hash: str) -> bool:
        """The hash was made with other costs than today's."""
        return bool(self._hasher.needs_update(password_hash))

    async def _in_thread(self, work: object, *arguments: str) -> object:
        if self._waiting >= MOST_WAITING:
            raise TooManySignIns
        self._waiting += 1
        try:
            async with self._threads:
                return await asyncio.to_thread(work, *arguments)  # type: ignore[arg-type]
        finally:
            self._waiting -= 1
