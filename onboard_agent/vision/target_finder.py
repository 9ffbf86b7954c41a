"""From pictures to one target: detector, tracker, and the characters once the target is confirmed."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
import numpy.typing as npt

from onboard_agent.vision.character_reader import CharacterReader
from onboard_agent.vision.concentric_squares import ConcentricSquareDetector
from onboard_agent.vision.letter_reading import CHARACTERS, LetterReading
from onboard_agent.vision.markers import MarkerTargets
from onboard_agent.vision.ring_detector import RingDetector
from onboard_agent.vision.square_target import SquareTarget
from onboard_agent.vision.target_kind import TargetKind
from onboard_agent.vision.target_tracker import TargetTracker, Track, TrackState

AGREEING_READINGS: Final = 2
"""Equal readings that settle the letter of a track."""
MAX_READINGS: Final = 12
"""For each track. What is not settled by then stays unread."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """What is known after a picture. `targets`: all in it. `track`: the followed one, None if none. `letter`: of a
    confirmed track, once readings agree. `heading_deg`: of the letter's top, from the picture's top, clockwise, 0 to
    360; None until the letter is known."""

    targets: list[SquareTarget]
    track: Track | None
    letter: LetterReading | None
    heading_deg: float | None


class Detector(Protocol):
    """Finds the targets of one kind."""

    def find(self, picture: npt.NDArray[np.uint8]) -> list[SquareTarget]:
        """Takes (height, width) grey or (height, width, 3) blue, green, red. Returns targets, the surest first."""
        ...


class TargetFinder:
    """One for each camera."""

    def __init__(self, detector: Detector, tracker: TargetTracker, reader: CharacterReader | None = None) -> None:
        self._detector = detector
        self._tracker = tracker
        self._reader = reader
        self._track_number = 0
        self._begin(0)

    def _begin(self, track_number: int) -> None:
        self._track_number = track_number
        self._tally: Counter[str] = Counter()
        self._asked = 0
        self._letter: LetterReading | None = None
        self._heading_deg: float | None = None

    def look(self, picture: npt.NDArray[np.uint8], now_s: float) -> Sighting:
        """Takes one picture, grey or blue, green, red. `now_s`: when it was taken; never goes back."""
        targets = self._detector.find(picture)
        track = self._tracker.update(targets, now_s)
        if track is None:
            self._begin(0)
            return Sighting(targets, None, None, None)
        if track.number != self._track_number:
            self._begin(track.number)
        seen_now = track.seen_s == now_s and any(track.latest is target for target in targets)
        if seen_now and track.state is TrackState.CONFIRMED and self._letter is None:
            self._read(picture, track)
        if seen_now and self._heading_deg is not None:
            self._heading_deg = _nearest(track.latest.headings_deg, self._heading_deg)
        return Sighting(targets, track, self._letter, self._heading_deg)

    def _read(self, picture: npt.NDArray[np.uint8], track: Track) -> None:
        if self._reader is None or self._asked >= MAX_READINGS:
            return
        self._asked += 1
        reading = self._reader.read(picture, track.latest)
        if reading is None:
            return
        self._tally[reading.words] += 1
        if self._tally[reading.words] >= AGREEING_READINGS:
            self._letter = reading
            self._heading_deg = track.latest.headings_deg[reading.quarter_turns]


def _nearest(headings_deg: tuple[float, ...], before_deg: float) -> float:
    """Returns the one that is nearest to the heading before."""
    return min(headings_deg, key=lambda heading_deg: abs((heading_deg - before_deg + 180.0) % 360.0 - 180.0))


def detector_of(kind: TargetKind) -> Detector:
    """Returns what finds targets of this kind."""
    if kind.marker is not None:
        return MarkerTargets(kind.marker)
    return RingDetector(kind) if kind.rings else ConcentricSquareDetector()


def finder_of(kind: TargetKind, alphabet: str = CHARACTERS) -> TargetFinder:
    """Returns what finds targets of this kind with these characters."""
    return TargetFinder(detector_of(kind), TargetTracker(), CharacterReader(alphabet) if kind.has_text else None)
