"""From pictures to one target: detector, tracker, and the letter once the target is confirmed."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from onboard_agent.vision.concentric_squares import ConcentricSquareDetector
from onboard_agent.vision.letter_reading import LetterReader, LetterReading
from onboard_agent.vision.square_target import SquareTarget
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


class TargetFinder:
    """One for each camera. `readers` are asked in turn until one reads something."""

    def __init__(
        self,
        detector: ConcentricSquareDetector,
        tracker: TargetTracker,
        readers: tuple[LetterReader, ...] = (),
    ) -> None:
        self._detector = detector
        self._tracker = tracker
        self._readers = readers
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
        if self._asked >= MAX_READINGS:
            return
        self._asked += 1
        for reader in self._readers:
            reading = reader.read(picture, track.latest)
            if reading is not None:
                break
        else:
            return
        self._tally[reading.letter] += 1
        if self._tally[reading.letter] >= AGREEING_READINGS:
            self._letter = reading
            self._heading_deg = track.latest.headings_deg[reading.quarter_turns]


def _nearest(headings_deg: tuple[float, ...], before_deg: float) -> float:
    """Returns the one that is nearest to the heading before."""
    return min(headings_deg, key=lambda heading_deg: abs((heading_deg - before_deg + 180.0) % 360.0 - 180.0))


def letter_readers(alphabet: str, *, with_tesseract: bool = True) -> tuple[LetterReader, ...]:
    """Returns the templates, then Tesseract, if it is installed, for what they leave in doubt: it is slower, and reads
    letters that may lie in any direction worse (docs/target_finding.md)."""
    from onboard_agent.vision.template_reader import TemplateReader
    from onboard_agent.vision.tesseract_reader import TesseractReader, find_tesseract

    program = find_tesseract() if with_tesseract else None
    templates = TemplateReader(alphabet)
    return (templates,) if program is None else (templates, TesseractReader(program, alphabet))
