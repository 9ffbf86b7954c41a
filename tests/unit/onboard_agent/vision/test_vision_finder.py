"""The finder over pictures: the letter is read only once the target is sure, and an idle agent loads none of it."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import numpy.typing as npt
import pytest

from onboard_agent.vision.letter_reading import LetterReading
from onboard_agent.vision.square_target import SquareTarget
from onboard_agent.vision.target_finder import MAX_READINGS, TargetFinder
from onboard_agent.vision.target_tracker import TargetTracker, TrackerSettings

BLANK = np.zeros((8, 8), np.uint8)


class FakeDetector:
    """Finds what it was told to."""

    def __init__(self) -> None:
        self.targets: list[SquareTarget] = []

    def find(self, picture: npt.NDArray[np.uint8]) -> list[SquareTarget]:
        return self.targets


class FakeReader:
    def __init__(self, *letters: str) -> None:
        self.letters = list(letters)
        self.asked = 0

    def read(self, picture: npt.NDArray[np.uint8], target: SquareTarget) -> LetterReading | None:
        self.asked += 1
        letter = self.letters.pop(0) if self.letters else ""
        return LetterReading(letter, 1, 0.9) if letter else None


def target(heading_deg: float = 10.0) -> SquareTarget:
    corners = ((75.0, 55.0), (125.0, 55.0), (125.0, 105.0), (75.0, 105.0))
    headings = (heading_deg % 360, heading_deg + 90, heading_deg + 180, heading_deg + 270)
    return SquareTarget((100.0, 80.0), 50.0, headings, corners, (1.0, 0.7, 0.4), 0.8)


def finder(reader: FakeReader) -> tuple[TargetFinder, FakeDetector]:
    detector = FakeDetector()
    tracker = TargetTracker(TrackerSettings(confirm_of=3, window=5, lose_after_s=1.0))
    return TargetFinder(detector, tracker, reader), detector  # type: ignore[arg-type]


def test_the_letter_waits_for_the_confirmation_and_for_two_equal_readings() -> None:
    reader = FakeReader("K", "R", "K", "B")
    look, detector = finder(reader)
    detector.targets = [target()]
    asked, letters = [], []
    for number in range(7):
        sighting = look.look(BLANK, number * 0.1)
        asked.append(reader.asked)
        letters.append(sighting.letter.letter if sighting.letter else "")
    assert asked == [0, 0, 1, 2, 3, 3, 3]
    assert letters == ["", "", "", "", "K", "K", "K"]
    assert sighting.heading_deg == pytest.approx(100.0)


def test_an_unreadable_letter_is_given_up() -> None:
    reader = FakeReader()
    look, detector = finder(reader)
    detector.targets = [target()]
    for number in range(MAX_READINGS + 20):
        assert look.look(BLANK, number * 0.1).letter is None
    assert reader.asked == MAX_READINGS


def test_the_heading_follows_over_the_quarter() -> None:
    look, detector = finder(FakeReader("K", "K"))
    for number, heading_deg in enumerate([40.0, 40.0, 40.0, 40.0, 43.0, -44.0, -40.0]):
        detector.targets = [target(heading_deg)]
        sighting = look.look(BLANK, number * 0.1)
    assert sighting.heading_deg == pytest.approx(140.0)


def test_another_track_has_no_letter_yet() -> None:
    look, detector = finder(FakeReader("K", "K", "R", "R"))
    detector.targets = [target()]
    for number in range(4):
        sighting = look.look(BLANK, number * 0.1)
    assert sighting.letter is not None
    detector.targets = []
    assert look.look(BLANK, 2.0).track is None
    detector.targets = [target()]
    assert look.look(BLANK, 2.1).letter is None
    for number in range(3):
        sighting = look.look(BLANK, 2.2 + number * 0.1)
    assert sighting.letter is not None
    assert sighting.letter.letter == "R"


def test_an_idle_agent_loads_nothing_of_it() -> None:
    code = (
        "import sys, onboard_agent.cli, onboard_agent.onboard\n"
        "print([name for name in sys.modules if name.startswith(('cv2', 'numpy', 'onboard_agent.vision'))])"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"


def test_the_geometry_loads_no_picture_library() -> None:
    code = (
        "import sys, onboard_agent.vision.ground_position, onboard_agent.vision.landing_target\n"
        "import onboard_agent.vision.target_tracker\n"
        "print([name for name in sys.modules if name.startswith(('cv2', 'numpy'))])"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"
