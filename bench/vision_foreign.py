"""Target finding on targets as people lay them out, in pictures that nothing of the product draws: the published
challenge's white square of 2 m with a coloured one of 1 m and one to three characters in it, seen from 4 to 12 m, in
typefaces that neither training nor thresholds have seen, among things that resemble it.

`--rounds N` renders so many (600), `--seed N` others; seeds from 1 to 9 are for reports alone. The typefaces' packages
are in `bench/characters/faces.py`.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from dataclasses import dataclass, field
from typing import Final

import cv2

from bench.characters.faces import JUDGING, Face, installed
from bench.foreign_targets import ForeignPicture, foreign_picture
from bench.rows import Report
from onboard_agent.vision.character_reader import CharacterReader
from onboard_agent.vision.letter_reading import may_be
from onboard_agent.vision.ring_detector import RingDetector
from onboard_agent.vision.target_kind import parse_kind

PICTURES: Final = 600
KIND: Final = "white 2, any 1"
READABLE_PX: Final = 14.0
"""Height of characters from which they are asked to be read."""
MAX_CENTRE_ERROR: Final = 0.05


@dataclass
class Tally:
    """Readings of found targets. `alike`: one of two that look alike, which is said."""

    right: int = 0
    alike: int = 0
    wrong: int = 0
    unread: int = 0

    @property
    def count(self) -> int:
        return self.right + self.alike + self.wrong + self.unread


@dataclass
class Score:
    targets: int = 0
    found: int = 0
    wrong: int = 0
    upright: int = 0
    turned: int = 0
    centre: list[float] = field(default_factory=list)
    busy_ms: list[float] = field(default_factory=list)
    readings: dict[str, Tally] = field(default_factory=dict)
    mistaken: Counter[str] = field(default_factory=Counter)
    misread: Counter[str] = field(default_factory=Counter)

    def tally(self, name: str) -> Tally:
        return self.readings.setdefault(name, Tally())


def judge(score: Score, picture: ForeignPicture, detector: RingDetector, reader: CharacterReader) -> None:
    """Adds what is seen in one picture."""
    truth = picture.truth
    began = time.thread_time()
    seen = detector.find(picture.pixels)
    score.busy_ms.append((time.thread_time() - began) * 1e3)
    limit_px = 0.0 if truth is None else max(MAX_CENTRE_ERROR * truth.side_px, 2.0)
    hits = [] if truth is None else [one for one in seen if math.dist(one.centre_px, truth.centre_px) <= limit_px]
    if len(seen) > bool(hits):
        score.wrong += len(seen) - bool(hits)
        score.mistaken[" + ".join(sorted(set(picture.decoys))) or "ground"] += 1
    if truth is None:
        return
    score.targets += 1
    if not hits:
        return
    score.found += 1
    score.centre.append(math.dist(hits[0].centre_px, truth.centre_px) / truth.side_px * 100.0)
    reading = reader.read(picture.pixels, hits[0])
    size = "readable" if truth.text_px >= READABLE_PX else "smaller"
    for name in (size, f"{size}, {len(truth.text)} characters"):
        tally = score.tally(name)
        if reading is None:
            tally.unread += 1
        elif reading.words == truth.text:
            tally.right += 1
        elif may_be(reading.words, truth.text):
            tally.alike += 1
        else:
            tally.wrong += 1
    if reading is not None and not may_be(reading.words, truth.text):
        score.misread[f"{truth.text} as {reading.words}"] += 1
    if reading is not None and reading.words == truth.text and not set(truth.text) <= set("HINOSXZ0186MW9"):
        score.turned += 1
        off_deg = abs((hits[0].headings_deg[reading.quarter_turns] - truth.top_deg + 180.0) % 360.0 - 180.0)
        score.upright += off_deg < 20.0


async def run(report: Report, options: argparse.Namespace) -> None:
    cv2.setNumThreads(1)
    count = options.rounds or (60 if options.quick else PICTURES)
    faces: list[Face | None] = [None, *installed(list(JUDGING))]
    report.say(f"{len(faces)} faces: Pillow's own, {', '.join(sorted({one.family for one in faces if one}))}")
    detector, reader, score = RingDetector(parse_kind(KIND)), CharacterReader(), Score()
    for number in range(count):
        judge(score, foreign_picture(options.seed, number, faces), detector, reader)
    case = f"{KIND}: {count} pictures of seed {options.seed}"
    report.add(case, "targets", score.targets, "count")
    report.add(case, "recall", score.found / max(score.targets, 1), "share")
    report.add(case, "precision", score.found / max(score.found + score.wrong, 1), "share")
    report.spread(case, "centre_error", score.centre, "% of side")
    report.spread(case, "processor_time", score.busy_ms, "ms")
    for name, tally in sorted(score.readings.items()):
        if tally.count:
            report.add(f"text, {name}", "targets", tally.count, "count")
            report.add(f"text, {name}", "right", tally.right / tally.count, "share")
            report.add(f"text, {name}", "one_of_two_that_look_alike", tally.alike / tally.count, "share")
            report.add(f"text, {name}", "unread", tally.unread / tally.count, "share")
            report.add(f"text, {name}", "wrong", tally.wrong / tally.count, "share")
    report.add("text", "right_way_up", score.upright / max(score.turned, 1), "share")
    for what, tallied in (("taken for a target", score.mistaken), ("read", score.misread)):
        for name, times in tallied.most_common():
            report.say(f"{what}: {name} ({times})")
