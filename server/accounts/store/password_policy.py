"""Which new passwords are acceptable: long enough, and not easy to guess. Existing passwords stay valid.

`zxcvbn` estimates how guessable a password is: it knows common passwords, names, words, dates, rows of keys, and usual
substitutions. It also receives the user's name and the tower's, which an attacker tries first.

Its cost is bounded by its input. The library takes 10 s for 72 characters that can each represent several letters
("l33t"), so only the first JUDGED_CHARACTERS are judged, and among such characters other than digits only the first
MAX_LEET_SIGNS different ones are read as letters. The library is pure Python and keeps the names in a global variable,
so it runs one check at a time in its own thread, beside the event loop.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Collection, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from server.kernel.refusal import Refusal, RetryLater

MIN_LENGTH: Final = 12
MAX_LENGTH: Final = 256
"""Hashing time does not grow with it, but a request needs a limit."""
MIN_SCORE: Final = 3
"""On a scale of 0 to 4: over 10^8 guesses, and over 10^10 for 4."""
JUDGED_CHARACTERS: Final = 32
MAX_LEET_SIGNS: Final = 2
MAX_WAITING: Final = 8
RESTS_FOR: Final = 4.0
"""Multiple of the time that a judgement took: judging uses at most a fifth of one core."""
_WARNINGS: Final[Mapping[str, str]] = {
    "This is a top-10 common password.": "it is one of the ten most common",
    "This is a top-100 common password.": "it is one of the hundred most common",
    "This is a very common password.": "many people use it",
    "This is similar to a commonly used password.": "it is like one that many people use",
    "A word by itself is easy to guess.": "it is a single word",
    "Names and surnames by themselves are easy to guess.": "it is a name",
    "Common names and surnames are easy to guess.": "it has a common name in it",
    "Straight rows of keys are easy to guess.": "it is a row of keys",
    "Short keyboard patterns are easy to guess.": "it is a short pattern of keys",
    'Repeats like "aaa" are easy to guess.': "it repeats a character",
    'Repeats like "abcabcabc" are only slightly harder to guess than "abc".': "it repeats the same characters",
    'Sequences like "abc" or "6543" are easy to guess.': "it has letters or digits in their order",
    "Recent years are easy to guess.": "it has a recent year in it",
    "Dates are often easy to guess.": "it has a date in it",
}
"""The library's warnings in our words, which the console translates. One without a row is not told."""
_NO_LETTER: Final = "#"
_ALWAYS_TRIED: Final = ("tower", "control", "controltower", "drone")


@cache
def _leet() -> frozenset[str]:
    from zxcvbn.matching import L33T_TABLE

    return frozenset(sign for signs in L33T_TABLE.values() for sign in signs if not sign.isdigit())


class BadPassword(Refusal):
    """Not acceptable as a new password."""


class TooManyJudgements(RetryLater):
    def __init__(self) -> None:
        super().__init__("too many passwords are being checked: try again", retry_after_s=2)


@dataclass(frozen=True)
class Judgement:
    """`message`: why the password is not acceptable, as a sentence for its user; empty if it is."""

    message: str = ""

    @property
    def acceptable(self) -> bool:
        return not self.message


def judge_password(password: str, names: Collection[str] = ()) -> Judgement:
    """`names`: of the user and of the tower. Takes tens of milliseconds, so never call it in the event loop."""
    if len(password) < MIN_LENGTH:
        return Judgement(f"a password needs at least {MIN_LENGTH} characters")
    if len(password) > MAX_LENGTH:
        return Judgement(f"a password has at most {MAX_LENGTH} characters")
    from zxcvbn import zxcvbn  # slow to load: in this thread, when somebody first chooses a password

    known = [part for name in (*names, *_ALWAYS_TRIED) if (part := name.strip().lower()[:64])]
    found: dict[str, Any] = zxcvbn(_bounded(password), user_inputs=known)
    if found["score"] >= MIN_SCORE:
        return Judgement()
    warning = _WARNINGS.get(found["feedback"]["warning"])
    if warning is None:
        return Judgement("this password is easy to guess: add another word or two")
    return Judgement(f"this password is easy to guess, because {warning}: add another word or two")


def check_password(password: str, names: Collection[str] = ()) -> None:
    """Raises BadPassword. Never call it in the event loop."""
    judgement = judge_password(password, names)
    if not judgement.acceptable:
        raise BadPassword(judgement.message)


def _bounded(password: str) -> str:
    """Returns the part to judge: see the top of this file."""
    kept: set[str] = set()
    judged = []
    for sign in password[:JUDGED_CHARACTERS]:
        if sign in _leet() and sign not in kept:
            if len(kept) == MAX_LEET_SIGNS:
                judged.append(_NO_LETTER)
                continue
            kept.add(sign)
        judged.append(sign)
    return "".join(judged)


def _judge_and_rest(password: str, names: Collection[str]) -> Judgement:
    """Pauses after each judgement, so that endless requests leave the interpreter to the frames most of the time."""
    began = time.thread_time()
    try:
        return judge_password(password, names)
    finally:
        time.sleep(min(RESTS_FOR * (time.thread_time() - began), 0.5))


class PasswordPolicy:
    """Judges passwords outside the event loop. `tower_name`: the host name that people type, or empty."""

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
