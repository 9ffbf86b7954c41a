"""Reads the letter by correlation with letters drawn in OpenCV's Hershey faces, in four quarter turns."""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from onboard_agent.vision.letter_patch import Glyph, glyph_of, ink_of, letter_patch
from onboard_agent.vision.letter_reading import LETTERS, LetterReading
from onboard_agent.vision.square_target import SquareTarget

NAME: Final = "templates"
MIN_SCORE: Final = 0.75
MIN_LEAD: Final = 0.015
"""Of the best letter before the second."""

_FACES: Final = (
    cv2.FONT_HERSHEY_SIMPLEX,
    cv2.FONT_HERSHEY_DUPLEX,
    cv2.FONT_HERSHEY_COMPLEX,
    cv2.FONT_HERSHEY_TRIPLEX,
)
_WIDTHS: Final = (8, 18, 28)
_SCALE: Final = 8.0


class _Templates(NamedTuple):
    """`rows`: (n, pixels), each of mean 0 and length 1; `letters` and `turns` say which each is."""

    rows: npt.NDArray[np.float32]
    letters: list[str]
    turns: list[int]


@lru_cache(maxsize=4)
def _templates(alphabet: str) -> _Templates:
    rows, letters, turns = [], [], []
    for letter in alphabet:
        for face in _FACES:
            for width in _WIDTHS:
                canvas = np.zeros((400, 400), np.uint8)
                cv2.putText(canvas, letter, (90, 300), face, _SCALE, 255, width, cv2.LINE_AA)
                glyph = glyph_of(np.asarray((canvas > 127) * 255, np.uint8))
                for turn in range(4):
                    # A letter whose top is a quarter turn clockwise of the patch's.
                    rows.append(_row(np.asarray(np.rot90(glyph, -turn))))
                    letters.append(letter)
                    turns.append(turn)
    return _Templates(np.array(rows), letters, turns)


def _row(glyph: Glyph) -> npt.NDArray[np.float32]:
    row = glyph.ravel() - glyph.mean()
    return np.asarray(row / max(float(np.linalg.norm(row)), 1e-6), np.float32)


class TemplateReader:
    """Fewer letters in `alphabet` (capitals, at least two) are told apart more surely. Raises ValueError for others."""

    def __init__(self, alphabet: str = LETTERS) -> None:
        if len(set(alphabet)) < 2 or not set(alphabet) <= set(LETTERS):
            raise ValueError("alphabet is to be two or more capital letters")
        self._alphabet = "".join(sorted(set(alphabet)))

    def read(self, picture: npt.NDArray[np.uint8], target: SquareTarget) -> LetterReading | None:
        ink = ink_of(letter_patch(picture, target))
        if ink is None:
            return None
        templates = _templates(self._alphabet)
        scores = templates.rows @ _row(glyph_of(ink))
        best = int(np.argmax(scores))
        letter = templates.letters[best]
        others = np.array([other != letter for other in templates.letters])
        lead = float(scores[best] - scores[others].max())
        if scores[best] < MIN_SCORE or lead < MIN_LEAD:
            return None
        return LetterReading(letter, templates.turns[best], min(float(scores[best]), 1.0), NAME)
