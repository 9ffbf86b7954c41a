"""The characters in a target: each with its heading, several in a row, and nothing said in doubt."""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from onboard_agent.vision.character_reader import CharacterReader
from onboard_agent.vision.characters import network
from onboard_agent.vision.concentric_squares import ConcentricSquareDetector
from onboard_agent.vision.letter_reading import CHARACTERS, LOOK_ALIKES, LetterReading, may_be

Picture = npt.NDArray[np.uint8]
ALIKE = {one for pair in LOOK_ALIKES for one in pair}
DISTINCT = [one for one in CHARACTERS if one not in ALIKE]


def with_text(text: str, turn_deg: float, colour: tuple[int, int, int] = (20, 20, 20)) -> Picture:
    """A target of three squares, the innermost of a colour, with light characters; turned clockwise."""
    picture = np.full((400, 400, 3), 120, np.uint8)
    for number, side in enumerate((240, 176, 128)):
        edge = 200 - side // 2
        picture[edge : edge + side, edge : edge + side] = (colour, (230, 230, 230), colour)[number]
    if text:
        scale = 2.6 / len(text) ** 0.8
        (wide, high), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_DUPLEX, scale, 6)
        at = (200 - wide // 2, 200 + high // 2)
        cv2.putText(picture, text, at, cv2.FONT_HERSHEY_DUPLEX, scale, (235, 235, 235), 6, cv2.LINE_AA)
    turn = cv2.getRotationMatrix2D((199.5, 199.5), -turn_deg, 1.0)
    return np.asarray(cv2.warpAffine(picture, turn, (400, 400), borderValue=(120, 120, 120)), np.uint8)


def read(picture: Picture, alphabet: str = CHARACTERS) -> tuple[LetterReading | None, float]:
    """Returns the reading, and the heading of the top if there is one."""
    (target,) = ConcentricSquareDetector().find(picture)
    reading = CharacterReader(alphabet).read(picture, target)
    return reading, target.headings_deg[reading.quarter_turns] if reading else math.nan


@pytest.mark.parametrize("turn_deg", [0.0, 100.0, 190.0, 280.0])
def test_characters_are_read_with_their_heading(turn_deg: float) -> None:
    said = {one: read(with_text(one, turn_deg)) for one in DISTINCT}
    wrong = {one: reading.words for one, (reading, _) in said.items() if reading and reading.words != one}
    assert wrong == {}
    right = [one for one, (reading, _) in said.items() if reading]
    assert len(right) >= 0.9 * len(DISTINCT)
    for one in set(right) - set("HISX80"):
        assert abs((said[one][1] - turn_deg + 180.0) % 360.0 - 180.0) < 3.0, one


@pytest.mark.parametrize("pair", LOOK_ALIKES)
def test_what_looks_alike_is_not_told_apart_by_guessing(pair: str) -> None:
    for one in pair:
        reading, _ = read(with_text(one, 90.0))
        assert reading is None or may_be(reading.words, one), (one, reading)


def test_an_alphabet_decides_between_look_alikes() -> None:
    reading, _ = read(with_text("6", 200.0), "ABC678")
    assert reading is not None
    assert reading.words == "6"


@pytest.mark.parametrize("text", ["K7", "B42", "RE"])
@pytest.mark.parametrize("turn_deg", [0.0, 75.0, 185.0, 265.0])
def test_a_row_of_characters_is_read_from_its_beginning(text: str, turn_deg: float) -> None:
    reading, heading_deg = read(with_text(text, turn_deg))
    assert reading is not None
    assert reading.words == text
    assert abs((heading_deg - turn_deg + 180.0) % 360.0 - 180.0) < 3.0


def test_a_coloured_square_with_ink_as_bright_as_itself_is_read() -> None:
    picture = with_text("", 0.0, colour=(200, 40, 40))
    cv2.putText(picture, "R", (178, 222), cv2.FONT_HERSHEY_DUPLEX, 2.2, (40, 40, 180), 6, cv2.LINE_AA)
    reading, _ = read(picture)
    assert reading is not None
    assert reading.words == "R"


def test_nothing_and_no_character_are_not_read() -> None:
    assert read(with_text("", 10.0))[0] is None
    cells = with_text("", 0.0)
    cells[170:230:6, 170:230] = 230
    cells[170:230, 170:230:10] = 230
    assert read(cells)[0] is None
    askew = with_text("", 0.0)
    cv2.ellipse(askew, (200, 200), (40, 14), 30.0, 0, 360, (235, 235, 235), -1)
    assert read(askew)[0] is None


@pytest.mark.parametrize("alphabet", ["", "ab", "A-1", "\u00c4"])
def test_an_alphabet_is_capital_letters_and_digits(alphabet: str) -> None:
    with pytest.raises(ValueError, match="alphabet"):
        CharacterReader(alphabet)


def test_words_of_a_reading() -> None:
    assert LetterReading("6", 0, 0.9, "9").words == "6/9"
    assert may_be("6/9", "9")
    assert not may_be("6/9", "8")
    assert not may_be("K7", "K")


def test_the_network_has_a_class_for_each_character_and_one_for_none() -> None:
    assert network().output.shape[1] == len(CHARACTERS) + 1
