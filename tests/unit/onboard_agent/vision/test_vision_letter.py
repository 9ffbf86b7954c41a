"""The letter in a target: templates, what leaves them in doubt, and Tesseract where it is installed."""

from __future__ import annotations

import math
import stat
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from onboard_agent.vision import target_finder
from onboard_agent.vision.concentric_squares import ConcentricSquareDetector
from onboard_agent.vision.letter_reading import LetterReading
from onboard_agent.vision.template_reader import TemplateReader
from onboard_agent.vision.tesseract_reader import TesseractReader, find_tesseract, parse_tsv

Picture = npt.NDArray[np.uint8]
ALPHABET = "ABDEFGJKLPRTUVY"
"""Letters that are not each other's turns."""


def with_letter(letter: str, turn_deg: float) -> Picture:
    """A dark-edged target of three squares with a light middle, turned clockwise."""
    picture = np.full((400, 400), 120, np.uint8)
    for number, side in enumerate((240, 176, 112)):
        edge = 200 - side // 2
        picture[edge : edge + side, edge : edge + side] = (20, 230, 20)[number]
    if letter:
        (wide, high), _ = cv2.getTextSize(letter, cv2.FONT_HERSHEY_SIMPLEX, 2.4, 7)
        cv2.putText(
            picture, letter, (200 - wide // 2, 200 + high // 2), cv2.FONT_HERSHEY_SIMPLEX, 2.4, 230, 7, cv2.LINE_AA
        )
    turn = cv2.getRotationMatrix2D((199.5, 199.5), -turn_deg, 1.0)
    return np.asarray(cv2.warpAffine(picture, turn, (400, 400), borderValue=120), np.uint8)


def read(reader: TemplateReader | TesseractReader, picture: Picture) -> tuple[LetterReading | None, float]:
    """Returns the reading, and the heading of the letter's top if there is one."""
    (target,) = ConcentricSquareDetector().find(picture)
    reading = reader.read(picture, target)
    return reading, target.headings_deg[reading.quarter_turns] if reading else math.nan


@pytest.mark.parametrize("turn_deg", [0.0, 100.0, 190.0, 280.0])
@pytest.mark.parametrize("letter", ALPHABET)
def test_each_letter_is_read_with_its_heading(letter: str, turn_deg: float) -> None:
    reading, heading_deg = read(TemplateReader(ALPHABET), with_letter(letter, turn_deg))
    assert reading is not None
    assert (reading.letter, reading.reader) == (letter, "templates")
    assert abs((heading_deg - turn_deg + 180.0) % 360.0 - 180.0) < 2.0


def test_no_letter_is_not_read() -> None:
    assert read(TemplateReader(), with_letter("", 10.0))[0] is None


def test_a_shape_that_is_no_letter_is_not_read() -> None:
    picture = with_letter("", 0.0)
    picture[170:230:6, 170:230] = 230
    picture[170:230, 170:230:10] = 230
    assert read(TemplateReader(ALPHABET), picture)[0] is None


@pytest.mark.parametrize("alphabet", ["", "A", "AA", "ab", "A1"])
def test_an_alphabet_is_capital_letters(alphabet: str) -> None:
    with pytest.raises(ValueError, match="alphabet"):
        TemplateReader(alphabet)


HEADER = "level\tpage_num\tblock_num\tpar_num\tline_num\tword_num\tleft\ttop\twidth\theight\tconf\ttext\n"


def row(confidence: str, text: str) -> str:
    return "\t".join(["5", "1", "1", "1", "1", "1", "0", "0", "9", "9", confidence, text]) + "\n"


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (row("91.5", "K"), ("K", 0.915)),
        (row("70", "B") + row("88", "R"), ("R", 0.88)),
        (row("59.9", "K"), None),
        (row("95", "KL"), None),
        (row("95", "7"), None),
        (row("-1", ""), None),
        (row("much", "K"), None),
        ("K\n", None),
        ("", None),
    ],
)
def test_tesseracts_table(lines: str, said: tuple[str, float] | None) -> None:
    assert parse_tsv(HEADER + lines, "BKR") == said


def test_without_tesseract_the_templates_read_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert [type(reader).__name__ for reader in target_finder.letter_readers(ALPHABET)] == ["TemplateReader"]


def test_a_tesseract_that_fails_reads_nothing(tmp_path: Path) -> None:
    program = tmp_path / "tesseract"
    program.write_text("#!/bin/sh\nexit 1\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    assert read(TesseractReader(str(program)), with_letter("K", 0.0))[0] is None
    assert read(TesseractReader(str(tmp_path / "absent")), with_letter("K", 0.0))[0] is None


@pytest.mark.skipif(find_tesseract() is None, reason="tesseract is not installed")
def test_tesseract_reads_a_letter() -> None:
    reading, _ = read(TesseractReader(find_tesseract() or "", "BKR"), with_letter("K", 0.0))
    assert reading is not None
    assert (reading.letter, reading.reader) == ("K", "tesseract")
