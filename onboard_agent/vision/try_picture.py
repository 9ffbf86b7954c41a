"""`tower-agent vision try FILE`: says what target finding sees in a picture, and draws it into a copy."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from onboard_agent.installation import video_remedy
from onboard_agent.unusable import Unusable
from onboard_agent.vision.letter_reading import CHARACTERS
from onboard_agent.vision.target_kind import BadKind, TargetKind, parse_kind


def try_picture(options: dict[str, Any]) -> bool:
    """Prints what is seen. Returns whether it is anything. Raises Unusable."""
    try:
        kind = parse_kind(options["target"])
        import cv2

        from onboard_agent.vision.character_reader import CharacterReader
        from onboard_agent.vision.target_finder import detector_of

        reader = CharacterReader(options["alphabet"] or CHARACTERS)
    except BadKind as error:
        raise Unusable(str(error)) from None
    except ValueError as error:
        raise Unusable(f"--alphabet: {error}") from None
    except ImportError:
        raise Unusable(f"vision needs OpenCV, which is not installed: {video_remedy()}") from None
    picture = cv2.imread(str(options["file"]), cv2.IMREAD_COLOR)
    if picture is None:
        raise Unusable(f"{options['file']} is no picture that can be read")
    seen = []
    for target in detector_of(kind).find(picture):  # type: ignore[arg-type]
        reading = reader.read(picture, target) if kind.has_text else None  # type: ignore[arg-type]
        seen.append(
            {
                "centre_px": [round(one, 1) for one in target.centre_px],
                "side_px": round(target.side_px, 1),
                "confidence": round(target.confidence, 2),
                "text": reading.words if reading else "",
                "top_deg": round(target.headings_deg[reading.quarter_turns]) if reading else None,
                "distance_m": _distance_m(kind, target.side_px, picture.shape[1], options["fov"]),
                "corners_px": [[round(one, 1) for one in corner] for corner in target.corners_px],
            }
        )
    if options["out"] is not None:
        _draw(picture, seen, options["out"])
    if options["json"]:
        print(json.dumps({"width_px": picture.shape[1], "height_px": picture.shape[0], "targets": seen}))
    else:
        print("\n".join(_sentence(one, kind) for one in seen) or f"no target of the kind {options['target']!r}")
    return bool(seen)


def _distance_m(kind: TargetKind, side_px: float, width_px: int, field_of_view_deg: float | None) -> float | None:
    """How far away a target of this size is, if it is seen from straight ahead."""
    side_m = kind.marker.side_m if kind.marker else kind.rings[0].side_m if kind.rings else None
    if side_m is None or not field_of_view_deg:
        return None
    focal_px = width_px / 2 / math.tan(math.radians(field_of_view_deg / 2))
    return round(side_m * focal_px / side_px, 2)


def _sentence(seen: dict[str, Any], kind: TargetKind) -> str:
    x, y = seen["centre_px"]
    words = [f"target at {x:g}, {y:g}", f"{seen['side_px']:g} pixels wide", f"confidence {seen['confidence']:g}"]
    if seen["distance_m"] is not None:
        words.append(f"{seen['distance_m']:g} m away")
    if kind.has_text:
        words.append(f"reads {seen['text']}, its top at {seen['top_deg']} degrees" if seen["text"] else "not read")
    return ", ".join(words)


def _draw(picture: Any, seen: list[dict[str, Any]], out: Path) -> None:
    import cv2
    import numpy as np

    for one in seen:
        cv2.polylines(picture, [np.round(one["corners_px"]).astype(np.int32)], True, (60, 220, 60), 2, cv2.LINE_AA)
        x, y = (round(part) for part in one["centre_px"])
        text = one["text"] or "?"
        cv2.putText(picture, text, (x + 8, y - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.9, (0, 0, 0), 5, cv2.LINE_AA)
        cv2.putText(picture, text, (x + 8, y - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.9, (60, 220, 60), 2, cv2.LINE_AA)
    if not cv2.imwrite(str(out), picture):
        raise Unusable(f"{out} cannot be written")
