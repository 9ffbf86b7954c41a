"""Which new passwords are acceptable: long enough, and not easy to guess. Existing passwords stay valid.

`zxcvbn` estimates guessability: it knows common passwords, names, words, dates, keyboard rows and their usual
variations. It also gets the user's name and the tower's, which attackers try first.

Its input is bounded. The library takes 10 s for 72 characters that each can stand for several letters ("l33t"), so only
the first JUDGED_CHARACTERS are judged, and of such characters beside the digits only the first MAX_LEET_SIGNS different
ones count as letters. It is pure Python and keeps the names in a global variable: one call at a time, in its own
thread, so that the event loop continues.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Collection
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Final

from zxcvbn import zxcvbn
from zxcvbn.matching import L33T_TABLE

from server.domain.refusal import Refusal, RetryLater

MIN_LENGTH: Final = 12
MAX_LENGTH: Final = 256
"""Hashing time does not grow with it, but a request has to end somewhere."""
MIN_SCORE: Final = 3
"""From 0 to 4: over 10^8 guesses, and over 10^10 for 4."""
JUDGED_CHARACTERS: Final = 32
MAX_LEET_SIGNS: Final = 2
MAX_WAITING: Final = 8
RESTS_FOR: Final = 4.0
"""Times what a judgement took: at most a fifth of one core's time goes into judging passwords."""
_LEET: Final = frozenset(sign for signs in L33T_TABLE.values() for sign in signs if not sign.isdigit())
_NO_LETTER: Final = "#"
_ALWAYS_TRIED: Final = ("tower", "control", "controltower", "drone")


class BadPassword(Refusal):
    """Not acceptable as a new password."""


class TooManyJudgements(RetryLater):
    def __init__(self) -> None:
        super().__init__("too many passwords are being checked: try again", retry_after_s=2)


@dataclass(frozen=True)
class Judgement:
    """`message`: why it is not acceptable, in a sentence for its user; empty where it is."""

    message: str = ""

    @property
    def acceptable(self) -> bool:
        return not self.message


def judge_password(password: str, names: Collection[str] = ()) -> Judgement:
    """`names`: of the user, of the tower. Takes some tens of milliseconds: not for the event loop."""
    if len(password) < MIN_LENGTH:
        return Judgement(f"a password needs at least {MIN_LENGTH} characters")
    if len(password) > MAX_LENGTH:
        return Judgement(f"a password has at most {MAX_LENGTH} characters")
    known = [part for name in (*names, *_ALWAYS_TRIED) if (part := name.strip().lower()[:64])]
    found: dict[str, Any] = zxcvbn(_bounded(password), user_inputs=known)
    if found["score"] >= MIN_SCORE:
        return Judgement()
    warning = str(found["feedback"]["warning"]).rstrip(".")
    return Judgement(f"this password is easy to guess{f' ({warning})' if warning else ''}: add another word or two")


def check_password(password: str, names: Collection[str] = ()) -> None:
    """Raises BadPassword. Not for the event loop."""
    judgement = judge_password(password, names)
    if not judgement.acceptable:
        raise BadPassword(judgement.message)


def _bounded(password: str) -> str:
    """What is judged of it: see the top of this file."""
    kept: set[str] = set()
    judged = []
    for sign in password[:JUDGED_CHARACTERS]:
        if sign in _LEET and sign not in kept:
            if len(kept) == MAX_LEET_SIGNS:
                judged.append(_NO_LETTER)
                continue
            kept.add(sign)
        judged.append(sign)
    return "".join(judged)


def _judge_and_rest(password: str, names: Collection[str]) -> Judgement:
    """Whoever asks without end leaves the interpreter to the frames for most of the time."""
    began = time.thread_time()
    try:
        return judge_password(password, names)
    finally:
        time.sleep(min(RESTS_FOR * (time.thread_time() - began), 0.5))


class PasswordPolicy:
    """The judgement beside the event loop. `tower_name`: the host that people type, or nothing."""

    def __init__(self, tower_name: str = "") -> None:
        self._names = tuple(part for part in (tower_name, *tower_name.split(".")) if len(part) > 2)
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="password-policy")
        self._waiting = 0

    async def judge(self, password: str, *names: str) -> Judgement:
        """Raises TooManyJudgements."""
        if self._waiting >= MAX_WAITING:
            raise TooManyJudgements
        self._waiting += 1
        try:
            loop = asyncio.get_running_loop()
            return await loop.run_in_executor(self._thread, _judge_and_rest, password, (*self._names, *names))
        finally:
            self._waiting -= 1

    async def check(self, password: str, *names: str) -> None:
        """Raises BadPassword or TooManyJudgements."""
        judgement = await self.judge(password, *names)
        if not judgement.acceptable:
            raise BadPassword(judgement.message)

    def close(self) -> None:
        self._thread.shutdown(wait=False, cancel_futures=True)
