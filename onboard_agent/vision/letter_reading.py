"""What a reader made of the letter in a target. Pure: values and the interface of readers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from onboard_agent.vision.square_target import SquareTarget

LETTERS: Final = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
SAME_AFTER_HALF_TURN: Final = "HINOSXZ"
"""These leave the heading open by half a turn, O and X by a quarter. N and Z, M and W, and in some faces C and U are
each other's turns: an alphabet should have one of each."""


@dataclass(frozen=True, slots=True)
class LetterReading:
    """`quarter_turns`: clockwise from the target's first side to the letter's top, 0 to 3. `score`: 0 to 1, by the
    reader's own measure. `reader`: which one, `templates` or `tesseract`."""

    letter: str
    quarter_turns: int
    score: float
    reader: str


class LetterReader(Protocol):
    def read(self, picture: npt.NDArray[np.uint8], target: SquareTarget) -> LetterReading | None:
        """None if the reader sees no letter, or is in doubt."""
        ...
