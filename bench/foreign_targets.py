"""Pictures of targets that nothing of the product draws: characters by Pillow in typefaces that only judge, laid on the
ground by OpenCV, with tilt, shadow, blur, noise, the colours of real paint, JPEG, and things that resemble a target.

A picture depends on its seed and number, and on the installed typefaces. Seeds from 1 to 9 are for reports alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from bench.characters.faces import Face
from onboard_agent.vision.letter_reading import CHARACTERS

Picture = npt.NDArray[np.uint8]
WIDTH_PX, HEIGHT_PX = 640, 480
FIELD_OF_VIEW_DEG: Final = 75.0
FOCAL_PX: Final = WIDTH_PX / 2 / math.tan(math.radians(FIELD_OF_VIEW_DEG / 2))
SIDE_M, INNER_M = 2.0, 1.0
HEIGHTS_M: Final = (4.0, 12.0)
MAX_TILT_DEG: Final = 25.0
WITH_TARGET: Final = 0.65
BOARD_PX: Final = 640
PAINTS: Final = {
    "red": (196, 30, 40),
    "blue": (28, 70, 170),
    "green": (25, 120, 60),
    "yellow": (240, 205, 20),
    "orange": (240, 120, 20),
    "purple": (105, 45, 140),
    "black": (25, 25, 28),
    "brown": (110, 70, 40),
}
INKS: Final = {
    "white": (245, 245, 245),
    "black": (15, 15, 15),
    "yellow": (245, 215, 30),
    "white again": (230, 232, 235),
}
_DARK: Final = ("red", "blue", "green", "purple", "black", "brown")


@dataclass(frozen=True, slots=True)
class Truth:
    """`top_deg`: where the text's top lies from the target's centre, from the picture's top, clockwise.
    `text_px`: height of the characters."""

    centre_px: tuple[float, float]
    side_px: float
    text: str
    top_deg: float
    text_px: float
    face: str


@dataclass(frozen=True, slots=True)
class ForeignPicture:
    """`pixels`: blue, green, red. `truth` is None where there is no target."""

    pixels: Picture
    truth: Truth | None
    decoys: tuple[str, ...]


def _font(face: Face | None, px: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(px) if face is None else ImageFont.truetype(face.path, px, index=face.index)


def _write(board: Image.Image, text: str, face: Face | None, room_px: float, ink: tuple[int, int, int]) -> float:
    """Writes in the middle, as large as there is room. Returns the height of its characters."""
    size = 400
    while True:
        left, top, right, bottom = _font(face, size).getbbox(text)
        if right - left <= room_px and bottom - top <= room_px:
            break
        size = min(size - 1, int(size * room_px / max(right - left, bottom - top)))
    place = ((BOARD_PX - left - right) / 2, (BOARD_PX - top - bottom) / 2)
    ImageDraw.Draw(board).text(place, text, ink, _font(face, size))
    return float(bottom - top)


def _board(rng: np.random.Generator, text: str, face: Face | None, inner: float) -> tuple[Image.Image, float]:
    """The source's target: a white square, a coloured one in it, characters in that."""
    white = int(rng.integers(225, 256))
    board = Image.new("RGB", (BOARD_PX, BOARD_PX), (white, white, white))
    name = list(PAINTS)[int(rng.integers(len(PAINTS)))]
    inks = [one for one in INKS if (name in _DARK) == (one != "black") and not (name == "brown" and one == "yellow")]
    ink = INKS[inks[int(rng.integers(len(inks)))]]
    edge = BOARD_PX * (1 - inner) / 2
    ImageDraw.Draw(board).rectangle((edge, edge, BOARD_PX - edge, BOARD_PX - edge), PAINTS[name])
    height = _write(board, text, face, BOARD_PX * inner * float(rng.uniform(0.6, 0.8)), ink)
    return board, height


def _text(rng: np.random.Generator, alphabet: str, longest: int) -> str:
    length = 1 + int(rng.integers(longest))
    return "".join(alphabet[int(rng.integers(len(alphabet)))] for _ in range(length))


def _decoy(rng: np.random.Generator, faces: list[Face | None]) -> tuple[str, Image.Image, Image.Image]:
    """Returns its name, what it looks like, and where it covers the ground."""
    board, mask = Image.new("RGB", (BOARD_PX, BOARD_PX), (238, 238, 236)), Image.new("L", (BOARD_PX, BOARD_PX), 255)
    draw, face = ImageDraw.Draw(board), faces[int(rng.integers(len(faces)))]
    paint = PAINTS[list(PAINTS)[int(rng.integers(len(PAINTS)))]]
    full, mid = BOARD_PX, BOARD_PX / 2
    kind = int(rng.integers(9))
    if kind == 0:
        _write(board, _text(rng, CHARACTERS, 3), face, 0.6 * full, (20, 20, 20))
        return "a white board with characters", board, mask
    if kind == 1:
        size = float(rng.uniform(0.3, 0.5)) * full
        x, y = (float(rng.choice([0.02, 0.48])) * full for _ in range(2))
        draw.rectangle((x, y, x + size, y + size), paint)
        return "a coloured square off the middle", board, mask
    if kind == 2:
        draw.ellipse((0.25 * full, 0.25 * full, 0.75 * full, 0.75 * full), paint)
        _write(board, _text(rng, CHARACTERS, 1), face, 0.3 * full, (245, 245, 245))
        return "a circle in a white square", board, mask
    if kind == 3:
        inner = float(rng.choice([0.3, 0.72, 0.82]))
        edge = full * (1 - inner) / 2
        draw.rectangle((edge, edge, full - edge, full - edge), paint)
        _write(board, _text(rng, CHARACTERS, 1), face, 0.7 * inner * full, (245, 245, 245))
        return "squares of another ratio", board, mask
    if kind == 4:
        draw.polygon([(mid, 0.15 * full), (0.85 * full, mid), (mid, 0.85 * full), (0.15 * full, mid)], paint)
        _write(board, _text(rng, CHARACTERS, 1), face, 0.3 * full, (245, 245, 245))
        return "a turned square in a white one", board, mask
    if kind == 5:
        cells = int(rng.integers(2, 7))
        for row in range(cells):
            for column in range(row % 2, cells, 2):
                x, y = column * full / cells, row * full / cells
                draw.rectangle((x, y, x + full / cells, y + full / cells), (30, 30, 30))
        return "chequers", board, mask
    if kind == 6:
        draw.rectangle((0, 0, full, full), (70, 75, 80))
        draw.rectangle((0.1 * full, 0.1 * full, 0.9 * full, 0.9 * full), (130, 150, 165))
        draw.line((mid, 0, mid, full), (60, 60, 60), 24)
        draw.line((0, mid, full, mid), (60, 60, 60), 24)
        return "a window", board, mask
    if kind == 7:
        draw.rectangle((0, 0, full, full), paint)
        draw.rectangle((0.25 * full, 0.25 * full, 0.75 * full, 0.75 * full), (240, 240, 240))
        _write(board, _text(rng, CHARACTERS, 1), face, 0.3 * full, (20, 20, 20))
        return "a white square in a coloured one", board, mask
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
    tag = cv2.aruco.generateImageMarker(dictionary, int(rng.integers(50)), int(0.5 * full))
    board.paste(Image.fromarray(tag), (int(0.25 * full), int(0.25 * full)))
    return "a marker on a white board", board, mask


def _pose(rng: np.random.Generator, height_m: float) -> npt.NDArray[np.float64]:
    """Returns the homography from the ground, in metres about the board's middle, to pixels."""
    tilt, axis, spin = (
        math.radians(rng.uniform(0, MAX_TILT_DEG)),
        rng.uniform(0, 2 * math.pi),
        rng.uniform(0, 2 * math.pi),
    )
    turn = cv2.Rodrigues(np.array([math.cos(axis), math.sin(axis), 0.0]) * tilt)[0]
    turn = turn @ cv2.Rodrigues(np.array([0.0, 0.0, spin]))[0]
    x, y = rng.uniform(0, WIDTH_PX), rng.uniform(0, HEIGHT_PX)
    lens = np.array([[FOCAL_PX, 0, (WIDTH_PX - 1) / 2], [0, FOCAL_PX, (HEIGHT_PX - 1) / 2], [0, 0, 1.0]])
    place = np.array([(x - WIDTH_PX / 2) * height_m / FOCAL_PX, (y - HEIGHT_PX / 2) * height_m / FOCAL_PX, height_m])
    return np.asarray(lens @ np.column_stack([turn[:, 0], turn[:, 1], place]))


def _at(homography: npt.NDArray[np.float64], x_m: float, y_m: float) -> npt.NDArray[np.float64]:
    u, v, w = homography @ (x_m, y_m, 1.0)
    return np.array([u / w, v / w])


_CORNERS: Final = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))


def _lay(
    ground: Picture, board: Image.Image, mask: Image.Image, homography: npt.NDArray[np.float64], side_m: float
) -> None:
    """Draws at three times the size, for smooth edges."""
    to_m = np.array([[side_m / BOARD_PX, 0, -side_m / 2], [0, side_m / BOARD_PX, -side_m / 2], [0, 0, 1.0]])
    large = np.array([[3.0, 0, 1.0], [0, 3.0, 1.0], [0, 0, 1.0]]) @ homography @ to_m
    size = (3 * WIDTH_PX, 3 * HEIGHT_PX)
    pixels = np.asarray(board)[:, :, ::-1].copy()
    drawn = cv2.warpPerspective(pixels, large, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    cover = cv2.warpPerspective(np.asarray(mask), large, size, flags=cv2.INTER_LINEAR)
    drawn = cv2.resize(drawn, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA)
    share = cv2.resize(cover, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA)[:, :, None] / 255.0
    ground[:] = np.round(ground * (1 - share) + drawn * share).astype(np.uint8)


def _ground(rng: np.random.Generator) -> Picture:
    """Grass, earth, asphalt or sand, with tracks and lines."""
    base = np.array([(70, 120, 75), (80, 105, 130), (95, 95, 95), (150, 180, 195)][int(rng.integers(4))], np.float32)
    ground = np.tile(base, (HEIGHT_PX, WIDTH_PX, 1))
    for cells in (5, 24, 110):
        grain = rng.normal(0, rng.uniform(3, 14), (cells * 3 // 4, cells)).astype(np.float32)
        ground += cv2.resize(grain, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_LINEAR)[:, :, None]
    picture = np.clip(ground, 0, 255).astype(np.uint8)
    for _ in range(int(rng.integers(0, 4))):
        ends = [(int(rng.integers(-50, WIDTH_PX + 50)), int(rng.integers(-50, HEIGHT_PX + 50))) for _ in range(2)]
        level = int(rng.integers(40, 240))
        cv2.line(picture, ends[0], ends[1], (level, level, level), int(rng.integers(1, 14)), cv2.LINE_AA)
    return picture


def _taken(scene: Picture, rng: np.random.Generator) -> Picture:
    """Light, a shadow with an edge, the lens's blur and the flight's, noise, and JPEG."""
    light = np.full((HEIGHT_PX, WIDTH_PX), float(rng.uniform(0.45, 1.1)), np.float32)
    if rng.random() < 0.5:
        shadow = np.ones((HEIGHT_PX, WIDTH_PX), np.float32)
        points = rng.uniform(-0.3, 1.3, (4, 2)) * (WIDTH_PX, HEIGHT_PX)
        hull = cv2.convexHull(points.astype(np.float32)).astype(np.int32)
        cv2.fillConvexPoly(shadow, hull, float(rng.uniform(0.5, 0.85)))
        light *= cv2.GaussianBlur(shadow, (0, 0), float(rng.uniform(1, 12)))
    lit: npt.NDArray[np.floating] = (
        scene.astype(np.float32) * light[:, :, None] * rng.uniform(0.9, 1.0, 3).astype(np.float32)
    )
    lit = np.asarray(cv2.GaussianBlur(lit, (0, 0), float(rng.uniform(0.3, 1.2))), np.float32)
    length = int(rng.integers(0, 4))
    if length:
        kernel = np.zeros((7, 7), np.float32)
        angle = rng.uniform(0, math.pi)
        dx, dy = round(length * math.cos(angle)), round(length * math.sin(angle))
        cv2.line(kernel, (3 - dx // 2, 3 - dy // 2), (3 - dx // 2 + dx, 3 - dy // 2 + dy), 1.0)
        lit = np.asarray(cv2.filter2D(lit, -1, kernel / kernel.sum()), np.float32)
    lit = lit + rng.normal(0, rng.uniform(1, 8), lit.shape)
    _, jpeg = cv2.imencode(
        ".jpg", np.clip(lit, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(75, 96))]
    )
    return np.asarray(cv2.imdecode(jpeg, cv2.IMREAD_COLOR), np.uint8)


def foreign_picture(
    seed: int, number: int, faces: list[Face | None], alphabet: str = CHARACTERS, longest: int = 3
) -> ForeignPicture:
    """`faces`: None is the one that Pillow brings. `longest`: text."""
    rng = np.random.default_rng([seed, number, 77])
    scene, truth, names = _ground(rng), None, []
    has_target = bool(rng.random() < WITH_TARGET)
    for _ in range(int(rng.integers(0, 2)) if has_target else int(rng.integers(1, 4))):
        name, board, mask = _decoy(rng, faces)
        names.append(name)
        _lay(scene, board, mask, _pose(rng, float(rng.uniform(*HEIGHTS_M))), float(rng.uniform(1.0, 2.5)))
    if has_target:
        text, face = _text(rng, alphabet, longest), faces[int(rng.integers(len(faces)))]
        board, text_px = _board(rng, text, face, INNER_M / SIDE_M)
        height_m = float(rng.uniform(*HEIGHTS_M))
        while True:
            homography = _pose(rng, height_m)
            corners = np.array([_at(homography, SIDE_M * x, SIDE_M * y) for x, y in _CORNERS])
            if (corners > 4).all() and (corners < (WIDTH_PX - 4, HEIGHT_PX - 4)).all():
                break
        _lay(scene, board, Image.new("L", board.size, 255), homography, SIDE_M)
        centre, up = _at(homography, 0, 0), _at(homography, 0, -SIDE_M / 2)
        side_px = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).mean())
        top_deg = math.degrees(math.atan2(up[0] - centre[0], centre[1] - up[1])) % 360.0
        place = (float(centre[0]), float(centre[1]))
        truth = Truth(place, side_px, text, top_deg, text_px / BOARD_PX * side_px, face.family if face else "Pillow's")
    return ForeignPicture(_taken(scene, rng), truth, tuple(names))
