"""Targets as people lay them out: the setting, the source's own target in pictures that nothing of the product draws,
markers, and `tower-agent vision try`."""

from __future__ import annotations

import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from worlds.tiers import examples

from bench.foreign_targets import FOCAL_PX, SIDE_M, foreign_picture
from onboard_agent import cli
from onboard_agent.autonomy.challenge_settings import BadSetting, ChallengeSettings
from onboard_agent.vision.character_reader import CharacterReader
from onboard_agent.vision.letter_reading import may_be
from onboard_agent.vision.ring_detector import RingDetector
from onboard_agent.vision.target_finder import detector_of
from onboard_agent.vision.target_kind import BadKind, Marker, Ring, TargetKind, parse_kind

SOURCES = "white 2, any 1"
PICTURES = examples(25, long=60)


def test_kinds() -> None:
    assert parse_kind("squares") == TargetKind()
    assert parse_kind("white 2, any 1") == TargetKind((Ring("white", 2.0), Ring("any", 1.0)))
    assert parse_kind(" white 2,blue 1.2 , yellow 0.5").shares == pytest.approx((1.0, 0.6, 0.25))
    assert parse_kind("apriltag-36h11 7 0.5").marker == Marker("apriltag-36h11", 7, 0.5)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "COLOUR METRES"),
        ("round 2, any 1", "none of"),
        ("white 2", "2 to 6 squares"),
        ("white 1, any 2", "smaller"),
        ("white 2, white 1", "colour of the one around"),
        ("white nan, any 1", "0.05 to 20"),
        ("white 2, any 0.01", "0.05 to 20"),
        ("apriltag-36h11 7", "FAMILY NUMBER METRES"),
        ("apriltag-36h11 -1 0.5", "FAMILY NUMBER METRES"),
        ("circle", "COLOUR METRES"),
    ],
)
def test_what_is_no_kind_says_why(text: str, words: str) -> None:
    with pytest.raises(BadKind, match=words):
        parse_kind(text)
    with pytest.raises(BadSetting, match=words):
        ChallengeSettings.of({"target": text})


def test_settings_of_a_challenge_with_characters() -> None:
    settings = ChallengeSettings.of({"target": SOURCES, "letter": "A7"})
    assert (settings.target, settings.letter) == (SOURCES, "A7")
    for bad in ("a", "ABCD", "A-"):
        with pytest.raises(BadSetting, match="letter"):
            ChallengeSettings.of({"letter": bad})
    with pytest.raises(BadSetting, match="a marker has none"):
        ChallengeSettings.of({"target": "aruco-4x4-50 3 0.5", "letter": "A"})
    with pytest.raises(BadSetting, match="alphabet"):
        ChallengeSettings.of({"alphabet": "abc"})


def test_the_sources_target_is_found_and_read_in_foreign_pictures() -> None:
    """`python -m bench vision_foreign` has the figures of many more, in more typefaces."""
    detector, reader = RingDetector(parse_kind(SOURCES)), CharacterReader()
    targets = found = wrong_targets = right = read_wrong = 0
    for number in range(PICTURES):
        picture = foreign_picture(2100, number, [None], longest=1)
        truth, hits = picture.truth, []
        seen = detector.find(picture.pixels)
        if truth is not None:
            targets += 1
            hits = [one for one in seen if math.dist(one.centre_px, truth.centre_px) < 0.05 * truth.side_px]
        wrong_targets += len(seen) - bool(hits)
        if truth is None or not hits:
            continue
        found += 1
        reading = reader.read(picture.pixels, hits[0])
        right += reading is not None and may_be(reading.words, truth.text)
        read_wrong += reading is not None and not may_be(reading.words, truth.text)
    assert targets >= PICTURES // 3
    assert found >= 0.9 * targets
    assert wrong_targets <= 1
    assert right >= 0.7 * found, "one typeface; the bench has the figures"
    assert read_wrong <= 1


def board(inner: float, colour: tuple[int, int, int], ground: int = 110) -> np.ndarray:
    """A white square of 300 pixels with a coloured one in it, and a K."""
    picture = np.full((480, 640, 3), ground, np.uint8)
    picture[90:390, 170:470] = 235
    half = round(150 * inner)
    picture[240 - half : 240 + half, 320 - half : 320 + half] = colour
    cv2.putText(picture, "K", (286, 272), cv2.FONT_HERSHEY_DUPLEX, 3.0, (240, 240, 240), 8, cv2.LINE_AA)
    return picture


@pytest.mark.parametrize("name", ["red", "blue", "green", "yellow", "purple", "black"])
def test_a_named_colour_is_that_colour_alone(name: str) -> None:
    paints = {"red": (30, 30, 190), "blue": (170, 80, 30), "green": (60, 130, 30), "yellow": (30, 200, 230)}
    paints |= {"purple": (140, 40, 100), "black": (25, 25, 25)}
    picture = board(0.5, paints[name])
    if name == "yellow":
        picture = np.where((picture == 240).all(axis=2, keepdims=True), 20, picture).astype(np.uint8)
    for asked in (*paints, "any"):
        found = detector_of(parse_kind(f"white 2, {asked} 1")).find(picture)
        assert len(found) == (asked in (name, "any")), asked


def test_other_sizes_and_an_empty_square_are_no_target() -> None:
    detector = RingDetector(parse_kind(SOURCES))
    assert len(detector.find(board(0.5, (30, 30, 190)))) == 1
    assert detector.find(board(0.75, (30, 30, 190))) == []
    assert len(RingDetector(parse_kind("white 2, any 1.5")).find(board(0.75, (30, 30, 190)))) == 1
    empty = board(0.5, (30, 30, 190))
    empty[165:315, 245:395] = (30, 30, 190)
    assert detector.find(empty) == []


def test_a_target_on_ground_as_bright_as_itself_is_found_by_its_inner_square() -> None:
    picture = board(0.5, (30, 30, 190), ground=205)
    assert len(RingDetector(parse_kind(SOURCES)).find(picture)) == 1


def test_a_marker_is_a_target_by_its_number() -> None:
    picture = np.full((480, 640), 200, np.uint8)
    drawn = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), 7, 160)
    picture[150:310, 240:400] = drawn
    (target,) = detector_of(parse_kind("apriltag-36h11 7 0.5")).find(picture)
    assert math.dist(target.centre_px, (319.5, 229.5)) < 1.0
    assert target.side_px == pytest.approx(160.0, abs=2.0)
    assert detector_of(parse_kind("apriltag-36h11 8 0.5")).find(picture) == []


def tried(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    monkeypatch.setattr("sys.argv", ["tower-agent", "vision", "try", *words])
    try:
        cli.main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def test_a_picture_is_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "field.png", tmp_path / "seen.png"
    cv2.imwrite(str(file), board(0.5, (170, 80, 30)))
    assert tried(monkeypatch, str(file), "--target", SOURCES, "--fov", "75", "--out", str(out)) == 0
    said = capsys.readouterr().out
    assert "reads K, its top at 0 degrees" in said
    distance_m = SIDE_M * FOCAL_PX / 300
    assert f"{distance_m:.2f} m away" in said
    seen = cv2.imread(str(out))
    assert seen is not None
    assert (seen != board(0.5, (170, 80, 30))).any()
    assert tried(monkeypatch, str(file), "--target", SOURCES, "--json") == 0
    (one,) = json.loads(capsys.readouterr().out)["targets"]
    assert one["text"] == "K"
    assert math.dist(one["centre_px"], (319.5, 239.5)) < 2.0
    assert tried(monkeypatch, str(file), "--target", "white 2, red 1") == 1
    assert "no target" in capsys.readouterr().out


def test_what_cannot_be_tried_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (file := tmp_path / "notes.txt").write_text("no picture")
    for words, said in (
        ([str(file)], "is no picture"),
        ([str(tmp_path / "absent.jpg")], "is no picture"),
        ([str(file), "--target", "round 1"], "target:"),
        ([str(file), "--alphabet", "abc"], "alphabet"),
    ):
        assert tried(monkeypatch, *words) == cli.UNUSABLE_EXIT_CODE
        assert said in capsys.readouterr().err
