"""Reads the letter by Tesseract, if its program is installed (Debian: `tesseract-ocr`). Takes tenths of a second: call
it for targets that are sure, never for each picture."""

from __future__ import annotations

import shutil
import subprocess
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from onboard_agent.vision.letter_patch import PATCH_PX, ink_of, letter_patch
from onboard_agent.vision.letter_reading import LETTERS, LetterReading
from onboard_agent.vision.square_target import SquareTarget

NAME: Final = "tesseract"
MIN_CONFIDENCE: Final = 60.0
"""Of 100, by Tesseract."""
TIMEOUT_S: Final = 5.0
_MARGIN_PX: Final = 24


def find_tesseract() -> str | None:
    """Returns the program's path, or None."""
    return shutil.which("tesseract")


class TesseractReader:
    """`program`: from `find_tesseract`. A program that fails or hangs reads nothing."""

    def __init__(self, program: str, alphabet: str = LETTERS) -> None:
        self._program = program
        self._alphabet = alphabet

    def read(self, picture: npt.NDArray[np.uint8], target: SquareTarget) -> LetterReading | None:
        ink = ink_of(letter_patch(picture, target))
        if ink is None:
            return None
        upright = np.full((PATCH_PX + 2 * _MARGIN_PX, PATCH_PX + 2 * _MARGIN_PX), 255, np.uint8)
        upright[_MARGIN_PX:-_MARGIN_PX, _MARGIN_PX:-_MARGIN_PX] = 255 - ink
        best: LetterReading | None = None
        for turn in range(4):
            said = self._ask(np.ascontiguousarray(np.rot90(upright, turn)))
            if said is not None and (best is None or said[1] > best.score):
                best = LetterReading(said[0], turn, said[1], NAME)
        return best

    def _ask(self, page: npt.NDArray[np.uint8]) -> tuple[str, float] | None:
        """Returns the letter and its confidence from 0 to 1."""
        _, encoded = cv2.imencode(".png", page)
        command = [self._program, "stdin", "stdout", "--psm", "10", "-c", f"tessedit_char_whitelist={self._alphabet}"]
        try:
            answer = subprocess.run(  # noqa: S603 - a fixed program, and words of ours
                [*command, "tsv"],
                input=encoded.tobytes(),
                capture_output=True,
                timeout=TIMEOUT_S,
                check=True,
                env={"OMP_THREAD_LIMIT": "1", "PATH": "/usr/bin:/bin"},
            )
        except (OSError, subprocess.SubprocessError):
            return None
        return parse_tsv(answer.stdout.decode("utf-8", "replace"), self._alphabet)


def parse_tsv(text: str, alphabet: str) -> tuple[str, float] | None:
    """Returns the surest line that is one letter of the alphabet, if Tesseract is sure enough, with 0 to 1."""
    best: tuple[str, float] | None = None
    for line in text.splitlines()[1:]:
        fields = line.split("\t")
        if len(fields) != 12 or len(fields[11].strip()) != 1 or fields[11].strip() not in alphabet:
            continue
        try:
            confidence = float(fields[10])
        except ValueError:
            continue
        if confidence >= MIN_CONFIDENCE and (best is None or confidence / 100.0 > best[1]):
            best = (fields[11].strip(), min(confidence / 100.0, 1.0))
    return best
