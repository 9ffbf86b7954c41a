"""Target finding of `onboard_agent/vision`: 500 rendered pictures, of which about 60 % have a target of concentric
squares, among decoys, with tilt, blur, noise, shadows. Precision, recall, errors, letters, time per picture.

`--seed N` makes other pictures, `--rounds N` another number. The detector was tuned on seeds from 1001 on; 1 to 9 are
for reports alone.
"""

from __future__ import annotations

import argparse
import itertools
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2

from bench.rows import Report
from onboard_agent.vision.character_reader import CharacterReader
from onboard_agent.vision.concentric_squares import ConcentricSquareDetector
from onboard_agent.vision.letter_reading import LETTERS, SAME_AFTER_HALF_TURN, may_be
from onboard_agent.vision.square_target import SquareTarget
from simulator.target_pictures.render import MAX_TILT_DEG, TargetPicture, Truth, render

PICTURES = 500
MAX_CENTRE_ERROR = 0.05
"""Of the true side; what is further off is a false positive."""
MIN_CENTRE_ERROR_PX = 2.0
TILTS = (0.0, 20.0, 35.0, MAX_TILT_DEG)


@dataclass
class Score:
    """Outcomes over all pictures."""

    right: int = 0
    wrong: int = 0
    targets: int = 0
    pictures_with_wrong: int = 0
    centre: list[float] = field(default_factory=list)
    side: list[float] = field(default_factory=list)
    heading_deg: list[float] = field(default_factory=list)
    ms: list[float] = field(default_factory=list)
    ms_without: list[float] = field(default_factory=list)
    busy_ms: list[float] = field(default_factory=list)
    """Of the processor, which other programs' load does not lengthen much."""
    tilts: list[tuple[float, bool]] = field(default_factory=list)
    found: list[tuple[TargetPicture, SquareTarget]] = field(default_factory=list)


def angle_between_deg(a: float, b: float) -> float:
    return abs((a - b + 180.0) % 360.0 - 180.0)


def is_right(target: SquareTarget, truth: Truth) -> bool:
    limit_px = max(MAX_CENTRE_ERROR * truth.side_px, MIN_CENTRE_ERROR_PX)
    return math.dist(target.centre_px, truth.centre_px) <= limit_px


def judge(score: Score, picture: TargetPicture, targets: Sequence[SquareTarget]) -> None:
    """Adds the outcome of one picture. A second report of the same target is wrong."""
    truth = picture.truth
    hits = [] if truth is None else [target for target in targets if is_right(target, truth)]
    score.right += bool(hits)
    wrong = len(targets) - bool(hits)
    score.wrong += wrong
    score.pictures_with_wrong += wrong > 0
    if truth is None:
        return
    score.targets += 1
    score.tilts.append((truth.tilt_deg, bool(hits)))
    if hits:
        best = hits[0]
        score.centre.append(math.dist(best.centre_px, truth.centre_px) / truth.side_px * 100.0)
        score.side.append(abs(best.side_px / truth.side_px - 1.0) * 100.0)
        score.heading_deg.append(min(angle_between_deg(best.heading_deg, true) for true in truth.headings_deg))
        score.found.append((picture, best))


async def run(report: Report, options: argparse.Namespace) -> None:
    cv2.setNumThreads(1)  # what one core of the companion computer does
    count = options.rounds or (50 if options.quick else PICTURES)
    detector = ConcentricSquareDetector()
    score = Score()
    detector.find(render(options.seed, 0).pixels)  # loads what is loaded once
    for number in range(count):
        picture = render(options.seed, number)
        began, began_busy = time.perf_counter(), time.thread_time()
        targets = detector.find(picture.pixels)
        score.busy_ms.append((time.thread_time() - began_busy) * 1e3)
        (score.ms if picture.truth else score.ms_without).append((time.perf_counter() - began) * 1e3)
        judge(score, picture, targets)
    _squares(report, f"squares, {count} pictures of seed {options.seed}", score)
    _letters(report, "letter", score, CharacterReader(LETTERS))


def _squares(report: Report, case: str, score: Score) -> None:
    report.add(case, "targets", score.targets, "count")
    report.add(case, "found", score.right, "count")
    report.add(case, "wrong", score.wrong, "count")
    report.add(case, "pictures_with_wrong", score.pictures_with_wrong, "count")
    report.add(case, "precision", score.right / max(score.right + score.wrong, 1), "share")
    report.add(case, "recall", score.right / max(score.targets, 1), "share")
    for low, high in itertools.pairwise(TILTS):
        hits = [hit for tilt, hit in score.tilts if low <= tilt < high]
        if hits:
            report.add(case, f"recall_tilt_{low:.0f}_to_{high:.0f}", sum(hits) / len(hits), "share")
    report.spread(case, "centre_error", score.centre, "% of side")
    report.spread(case, "side_error", score.side, "%")
    report.spread(case, "heading_error", score.heading_deg, "deg")
    report.spread(case, "processor_time", score.busy_ms, "ms")
    report.spread(case, "time_with_target", score.ms, "ms")
    report.spread(case, "time_without_target", score.ms_without, "ms")


def _letters(report: Report, case: str, score: Score, reader: CharacterReader) -> None:
    right = wrong = unread = upright = turned = 0
    ms = []
    for picture, target in score.found:
        truth = picture.truth
        assert truth is not None
        began = time.perf_counter()
        reading = reader.read(picture.pixels, target)
        ms.append((time.perf_counter() - began) * 1e3)
        if reading is None:
            unread += 1
        elif not may_be(reading.words, truth.letter):
            wrong += 1
        else:
            right += 1
            if truth.letter not in SAME_AFTER_HALF_TURN:
                heading_deg = target.headings_deg[reading.quarter_turns]
                errors = [angle_between_deg(heading_deg, true) for true in truth.headings_deg]
                turned += 1
                upright += errors.index(min(errors)) == 0
    report.add(case, "targets", len(score.found), "count")
    report.add(case, "right", right / max(len(score.found), 1), "share")
    report.add(case, "wrong", wrong / max(len(score.found), 1), "share")
    report.add(case, "unread", unread / max(len(score.found), 1), "share")
    report.add(case, "right_way_up", upright / max(turned, 1), "share")
    report.spread(case, "time", ms, "ms")
