"""Reads shapes of zones from files: GeoJSON and KML. Pure, bounded, and nothing is loaded from elsewhere.

A KML with a document type is refused before any parser sees it, so no entity can grow or name a file. A file gives
shapes with names; what kind of zone each becomes is for a person to say.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, Final
from xml.etree import ElementTree
from xml.parsers import expat

import msgspec

from server.airspace.core.zones.zone import MAX_POINTS, MAX_REASON, BadZone, check_points
from server.kernel.refusal import Refusal

MAX_FILE_BYTES: Final = 400_000
MAX_SHAPES: Final = 200
MAX_DEPTH: Final = 40
"""Of elements in a KML, and of values in a GeoJSON."""
MAX_ELEMENTS: Final = 50_000
MAX_SKIPPED: Final = 100
"""Told one by one."""

_SHAPES: Final = frozenset({"Polygon", "LineString", "Point"})

Ring = tuple[tuple[float, float], ...]


class UnreadableFile(Refusal):
    """Not a file of shapes."""


@dataclass(frozen=True)
class FoundShape:
    """`is_line`: it needs a width."""

    name: str
    points: Ring
    is_line: bool = False
    reason: str = ""


@dataclass
class FoundShapes:
    """`skipped`: what cannot become a zone, in words; `more`: how many there are besides."""

    shapes: list[FoundShape] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)
    more: int = 0

    def skip(self, words: str) -> None:
        if len(self.skipped) < MAX_SKIPPED:
            self.skipped.append(words)
        else:
            self.more += 1

    def add(self, name: str, points: Any, *, is_line: bool, holes: bool, reason: str) -> None:
        """`points`: longitude and latitude first, as both formats have them."""
        name = _clean(name, 64) or f"Shape {len(self.shapes) + len(self.skipped) + self.more + 1}"
        if len(self.shapes) >= MAX_SHAPES:
            raise UnreadableFile(f"a file has at most {MAX_SHAPES} shapes")
        if holes:
            self.skip(f"{name}: it has a hole. Draw it as several areas without one.")
            return
        try:
            ring = tuple((_number(point[1]), _number(point[0])) for point in points)
            if not is_line and len(ring) > 1 and ring[0] == ring[-1]:
                ring = ring[:-1]
            if len(ring) > MAX_POINTS:
                raise BadZone("points", f"it has {len(ring)} points, and {MAX_POINTS} are the most")
            check_points(ring, 1.0 if is_line else None)
        except BadZone as bad:
            self.skip(f"{name}: {bad.message}.")
            return
        except (TypeError, IndexError, KeyError, ValueError):
            self.skip(f"{name}: its points are not numbers.")
            return
        self.shapes.append(FoundShape(name, ring, is_line, _clean(reason, MAX_REASON)))


def shapes_in(text: str) -> FoundShapes:
    """By its content: GeoJSON begins with a brace, KML with an angle bracket. Raises UnreadableFile."""
    if len(text.encode("utf-8", "replace")) > MAX_FILE_BYTES:
        raise UnreadableFile(f"a file has at most {MAX_FILE_BYTES // 1000} kB")
    start = text.lstrip("\ufeff \t\r\n")[:1]
    found = FoundShapes()
    if start == "{":
        _read_geojson(text.lstrip("\ufeff"), found)
    elif start == "<":
        _read_kml(text, found)
    else:
        raise UnreadableFile("this is neither GeoJSON nor KML")
    if not found.shapes and not found.skipped:
        raise UnreadableFile("there is no area and no line in this file")
    if found.more > 0:
        found.skipped.append(f"There are {found.more} more that cannot become a zone.")
    return found


# -- GeoJSON -------------------------------------------------------------------------------------------------


def _read_geojson(text: str, found: FoundShapes) -> None:
    try:
        document = msgspec.json.decode(text)
    except (msgspec.DecodeError, RecursionError):
        raise UnreadableFile("this is no JSON") from None
    _geojson_object(document, "", "", found, 0)


def _geojson_object(one: Any, name: str, reason: str, found: FoundShapes, depth: int) -> None:
    if not isinstance(one, dict) or depth > MAX_DEPTH:
        return
    match one.get("type"):
        case "FeatureCollection":
            for feature in _list(one.get("features")):
                _geojson_object(feature, name, reason, found, depth + 1)
        case "Feature":
            about = one.get("properties")
            about = about if isinstance(about, dict) else {}
            name = _text(about.get("name")) or _text(about.get("title")) or name
            reason = _text(about.get("reason")) or _text(about.get("description")) or reason
            _geojson_object(one.get("geometry"), name, reason, found, depth + 1)
        case "GeometryCollection":
            for geometry in _list(one.get("geometries")):
                _geojson_object(geometry, name, reason, found, depth + 1)
        case "Polygon":
            _geojson_polygon(one.get("coordinates"), name, reason, found)
        case "MultiPolygon":
            for number, rings in enumerate(_list(one.get("coordinates")), 1):
                _geojson_polygon(rings, f"{name} {number}" if name else "", reason, found)
        case "LineString":
            found.add(name, _list(one.get("coordinates")), is_line=True, holes=False, reason=reason)
        case "MultiLineString":
            for number, line in enumerate(_list(one.get("coordinates")), 1):
                found.add(f"{name} {number}" if name else "", _list(line), is_line=True, holes=False, reason=reason)
        case "Point" | "MultiPoint":
            found.skip(f"{_clean(name, 64) or 'A point'}: a point is no area.")
        case _:
            return


def _geojson_polygon(rings: Any, name: str, reason: str, found: FoundShapes) -> None:
    rings = _list(rings)
    if rings:
        found.add(name, _list(rings[0]), is_line=False, holes=len(rings) > 1, reason=reason)


# -- KML -----------------------------------------------------------------------------------------------------


def _read_kml(text: str, found: FoundShapes) -> None:
    """Each element is looked at once. A shape has the name of the innermost Placemark around it."""
    waiting: list[tuple[ElementTree.Element, tuple[str, str] | None]] = [(_parsed(text), None)]
    while waiting:
        one, about = waiting.pop()
        kind = _local(one)
        if kind == "Placemark":
            about = _child_text(one, "name"), _child_text(one, "description")
        elif about is not None and kind in _SHAPES:
            _kml_shape(one, kind, *about, found)
            continue
        waiting += [(child, about) for child in reversed(one)]


def _kml_shape(shape: ElementTree.Element, kind: str, name: str, reason: str, found: FoundShapes) -> None:
    if kind == "Polygon":
        outer = next((one for one in shape if _local(one) == "outerBoundaryIs"), None)
        holes = any(_local(one) == "innerBoundaryIs" for one in shape)
        points = _kml_points(outer) if outer is not None else []
        found.add(name, points, is_line=False, holes=holes, reason=reason)
    elif kind == "LineString":
        found.add(name, _kml_points(shape), is_line=True, holes=False, reason=reason)
    else:
        found.skip(f"{_clean(name, 64) or 'A point'}: a point is no area.")


def _parsed(text: str) -> ElementTree.Element:
    """Builds the tree from expat's events. A document type ends it at its first byte: entities are never declared."""
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate(encoding="utf-8", namespace_separator=" ")
    depth, elements = 0, 0

    def refuse(*_: object) -> int:
        raise UnreadableFile("a KML file with a document type or entities is not read")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, elements
        depth, elements = depth + 1, elements + 1
        if depth > MAX_DEPTH or elements > MAX_ELEMENTS:
            raise UnreadableFile("this KML file is too deep or has too many elements")
        builder.start(tag, {})

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.ExternalEntityRefHandler = refuse
    parser.UnparsedEntityDeclHandler = refuse
    parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(text.encode("utf-8", "replace"), True)
    except expat.ExpatError:
        raise UnreadableFile("this is no KML") from None
    return builder.close()


def _local(element: ElementTree.Element) -> str:
    return str(element.tag).rpartition(" ")[2]


def _child_text(element: ElementTree.Element, name: str) -> str:
    return next((one.text or "" for one in element if _local(one) == name), "")


def _kml_points(element: ElementTree.Element) -> list[list[str]] | None:
    """None if they are not "longitude,latitude,height": a decimal comma would make other places of them."""
    coordinates = next((one.text or "" for one in element.iter() if _local(one) == "coordinates"), "")
    triples = [triple.strip(",").split(",") for triple in coordinates.split()]
    if any(len(triple) not in (2, 3) for triple in triples):
        # People also put blanks behind the commas.
        triples = [triple.split(",") for triple in re.sub(r"\s*,\s*", ",", coordinates).split()]
    return None if any(len(triple) not in (2, 3) for triple in triples) else triples


# -- values --------------------------------------------------------------------------------------------------


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise TypeError
    number = float(value)
    if not isfinite(number):
        raise ValueError
    return number


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _text(value: Any) -> str:
    return value if isinstance(value, str) else ""


def _clean(text: str, most: int) -> str:
    """Printable, in one line, without markup."""
    plain = re.sub(r"<[^>]{0,400}>", " ", text[: 4 * most])
    return " ".join("".join(one if one.isprintable() else " " for one in plain).split())[:most].strip()
