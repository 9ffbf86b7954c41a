"""Reads the characters in the innermost square of a target, whichever quarter turn is up, and says nothing in doubt."""

from __future__ import annotations

import itertools
from collections import Counter
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from onboard_agent.vision.character_ink import Ink, Spot, cut, ink_of, inner_patch, spots_of
from onboard_agent.vision.characters import glyph_of, logits_of
from onboard_agent.vision.letter_reading import CHARACTERS, LOOK_ALIKES, MAX_CHARACTERS, LetterReading
from onboard_agent.vision.square_target import SquareTarget

MIN_SURE: Final = 0.93
"""Of what it says among all texts that it may be, by the reader's own account."""
MIN_TEXT: Final = 0.3
"""Of that it is this text, and not ink of another kind."""
_LIKELIEST: Final = 3
"""So many characters of each spot are tried in each turn."""
_TOUCH: Final = 0.95
"""A spot wider than this share of its height may be several characters that touch."""
_CLEAR_CUT: Final = 6.0
"""A cut into characters counts by this power of how well they fit."""
_ALIKE: Final = {frozenset(pair) for pair in LOOK_ALIKES}
Logs = npt.NDArray[np.float64]


class _Row(NamedTuple):
    """One way to cut the ink into characters. `layout`: quarter turns of the line's upper side, 0 or 1."""

    layout: int
    ink: Ink
    spots: list[Spot]


class CharacterReader:
    """`alphabet`: the characters that occur; with fewer it is surer. Raises ValueError for others than A-Z, 0-9."""

    def __init__(self, alphabet: str = CHARACTERS) -> None:
        if not alphabet or not set(alphabet) <= set(CHARACTERS):
            raise ValueError("an alphabet is to be capital letters and digits")
        self._occurs = np.array([one in alphabet for one in CHARACTERS])
        # What looks like one that occurs is taken for that one. The others stay possible, and are not read.
        self._stands_in = np.array(
            [
                one not in alphabet and any(one in pair and set(pair) & set(alphabet) for pair in LOOK_ALIKES)
                for one in CHARACTERS
            ]
        )

    def read(self, picture: npt.NDArray[np.uint8], target: SquareTarget) -> LetterReading | None:
        """None: there are no characters, or it is in doubt."""
        ink = ink_of(inner_patch(picture, target))
        rows = [] if ink is None else _rows(ink)
        probabilities, turns = self._texts(rows)
        ordered = probabilities.most_common(2)
        if not ordered:
            return None
        text, probability = ordered[0]
        all_texts = sum(probabilities.values())
        if probability < MIN_TEXT:
            return None
        if probability >= MIN_SURE * all_texts:
            return LetterReading(text, turns[text], min(probability, 1.0))
        if len(ordered) == 2 and _alike(text, ordered[1][0]) and probability + ordered[1][1] >= MIN_SURE * all_texts:
            first, second = sorted((text, ordered[1][0]))
            return LetterReading(first, turns[first], min(probability + ordered[1][1], 1.0), second)
        return None

    def likeness(self, picture: npt.NDArray[np.uint8], target: SquareTarget) -> float:
        """Returns 0 to 1: how much what is in the innermost square looks like a row of any characters."""
        ink = ink_of(inner_patch(picture, target))
        rows = [] if ink is None else _rows(ink)
        return max((self._texts_of(row)[0] for row in rows), default=0.0)

    def _texts(self, rows: list[_Row]) -> tuple[Counter[str], dict[str, int]]:
        """Returns the probabilities of texts over all cuts, and the likeliest turn of each."""
        cuts = [self._texts_of(row) for row in rows]
        weights = np.array([fit for fit, _, _ in cuts]) ** _CLEAR_CUT
        found: Counter[str] = Counter()
        turns: dict[str, int] = {}
        for weight, (_, texts, turns_of) in zip(weights / max(float(weights.sum()), 1e-12), cuts, strict=True):
            for text, probability in texts.items():
                if weight * probability > found[text] / 2:
                    turns[text] = turns_of[text]
                found[text] += float(weight * probability)  # type: ignore[assignment]
        return found, turns

    def _texts_of(self, row: _Row) -> tuple[float, Counter[str], dict[str, int]]:
        """Returns how well the ink fits this cut, the probabilities of texts, and the likeliest turn of each."""
        joint, none = self._joint([cut(row.ink, spot) for spot in row.spots])
        count = len(row.spots)
        turns = [0, 2] if count > 1 else [0, 1, 2, 3]
        tried = []
        for turn in turns:
            best = [np.argsort(-characters[turn])[:_LIKELIEST] for characters in joint]
            for numbers in itertools.product(*best):
                fits = np.array([joint[spot, turn, number] for spot, number in enumerate(numbers)])
                # Upside down, the row begins at its other end.
                ordered = numbers[::-1] if turn == 2 else numbers
                tried.append((float(np.prod(fits)), turn, "".join(CHARACTERS[number] for number in ordered)))
        # A character that has no direction shares its probability among the turns; the row has only one.
        peaks = np.maximum(joint.max(axis=(1, 2)), 1e-9)
        fit = max(float(np.prod([joint[spot, turn].max() / peaks[spot] for spot in range(count)])) for turn in turns)
        is_text = float(np.prod(1.0 - none))
        total = sum(one[0] for one in tried)
        found: Counter[str] = Counter()
        best_turn: dict[str, tuple[float, int]] = {}
        for value, turn, text in tried:
            share = value / max(total, 1e-12) * is_text * min(fit * 2.0, 1.0)
            found[text] += share  # type: ignore[assignment]
            best_turn[text] = max(best_turn.get(text, (0.0, 0)), (share, (turn + row.layout) % 4))
        return (fit * is_text) ** (1.0 / count), found, {text: turn for text, (_, turn) in best_turn.items()}

    def _joint(self, inks: list[Ink]) -> tuple[Logs, Logs]:
        """Returns probabilities (spots, turns, characters), and (spots) that it is no character of the alphabet."""
        # Boxes cut a little wider and higher give opinions of their own.
        wider = [np.pad(ink, ((0, 0), (2, 2))) for ink in inks]
        higher = [np.pad(ink, ((2, 2), (0, 0))) for ink in inks]
        glyphs = [glyph_of(ink) for ink in (*inks, *wider, *higher)]
        logits = logits_of(glyphs).astype(np.float64).reshape(3, len(inks), 4, -1).mean(axis=0)
        characters, none = logits[:, :, :-1], logits[:, :, -1].mean(axis=1)
        characters[:, :, self._stands_in] = -np.inf
        top = np.maximum(characters.max(axis=(1, 2)), none)
        odds, other = np.exp(characters - top[:, None, None]), np.exp(none - top)
        total = odds.sum(axis=(1, 2)) + other
        joint = odds / total[:, None, None]
        unknown = other / total + joint[:, :, ~self._occurs].sum(axis=(1, 2))
        joint[:, :, ~self._occurs] = 0.0
        return joint, unknown


def _alike(text: str, other: str) -> bool:
    """Whether two texts differ only in characters that look alike."""
    return len(text) == len(other) and all(
        a == b or frozenset(a + b) in _ALIKE for a, b in zip(text, other, strict=True)
    )


def _rows(ink: Ink) -> list[_Row]:
    """Returns the ways to cut the ink into a row of characters, along and across the patch."""
    found = []
    for layout in (0, 1):
        turned = np.ascontiguousarray(np.rot90(ink, layout))
        spots = sorted(spots_of(turned), key=lambda spot: spot.left)
        if not spots or len(spots) > MAX_CHARACTERS or not _is_row(spots):
            continue
        if layout == 0 or len(spots) > 1:  # one alone lies along as well as across
            found.append(_Row(layout, turned, spots))
        widest = max(spots, key=lambda spot: spot.wide / spot.high)
        if widest.wide < _TOUCH * widest.high:
            continue
        for parts in range(2, MAX_CHARACTERS - len(spots) + 2):
            pieces = _split(turned, widest, parts)
            found.append(_Row(layout, turned, sorted([one for one in spots if one is not widest] + pieces)))
    return found


def _is_row(spots: list[Spot]) -> bool:
    """Whether they stand side by side, of one height."""
    high = max(spot.high for spot in spots)
    middle = sum(spot.top + spot.high / 2 for spot in spots) / len(spots)
    level = all(spot.high >= 0.6 * high and abs(spot.top + spot.high / 2 - middle) <= 0.22 * high for spot in spots)
    return level and all(second.left >= first.left + 0.75 * first.wide for first, second in itertools.pairwise(spots))


def _split(ink: Ink, spot: Spot, parts: int) -> list[Spot]:
    """Cuts a spot where there is the least ink near equal widths."""
    columns = cut(ink, spot).sum(axis=0)
    reach = max(round(0.2 * spot.wide / parts), 1)
    edges = [0]
    for number in range(1, parts):
        middle = round(spot.wide * number / parts)
        edges.append(middle - reach + int(np.argmin(columns[middle - reach : middle + reach + 1])))
    edges.append(spot.wide)
    return [
        Spot(spot.left + start, spot.top, end - start, spot.high, spot.area // parts)
        for start, end in itertools.pairwise(edges)
        if end > start
    ]
