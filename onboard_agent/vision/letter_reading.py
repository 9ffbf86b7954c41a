"""What a reader made of the characters in a target. Pure: values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

LETTERS: Final = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
CHARACTERS: Final = LETTERS + "0123456789"
MAX_CHARACTERS: Final = 3
LOOK_ALIKES: Final = ("0O", "1I", "69", "MW", "NZ")
"""Pairs that many typefaces draw alike, or as each other's turns. A target may lie in any direction."""
SAME_AFTER_HALF_TURN: Final = "HINOSXZ01869MW"
"""These leave the heading open by half a turn, O, 0 and X by a quarter."""


@dataclass(frozen=True, slots=True)
class LetterReading:
    """`letter`: one to `MAX_CHARACTERS` characters. `also`: it looks the same, or empty: 6 and 9 on one target are each
    other's half turns. `quarter_turns`: clockwise from the target's first side to the top, 0 to 3. `score`: 0 to 1, by
    the reader's own measure."""

    letter: str
    quarter_turns: int
    score: float
    also: str = ""

    @property
    def words(self) -> str:
        """For people: `6/9`."""
        return f"{self.letter}/{self.also}" if self.also else self.letter


def may_be(words: str, sought: str) -> bool:
    """Whether a reading's `words` may be these characters."""
    return sought in words.split("/")
