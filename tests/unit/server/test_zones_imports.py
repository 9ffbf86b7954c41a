"""Shapes from files: GeoJSON and KML as programs write them, what is skipped, and what is an attack."""

import json
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.airspace.core.zones.imports import (
    MAX_FILE_BYTES,
    MAX_SHAPES,
    FoundShape,
    UnreadableFile,
    shapes_in,
)

RING = [[8.0, 47.0], [8.01, 47.0], [8.01, 47.01], [8.0, 47.01], [8.0, 47.0]]
POINTS = ((47.0, 8.0), (47.0, 8.01), (47.01, 8.01), (47.01, 8.0))


def geojson(geometry: object, **properties: object) -> str:
    feature = {"type": "Feature", "properties": properties, "geometry": geometry}
    return json.dumps({"type": "FeatureCollection", "features": [feature]})


def kml(inside: str) -> str:
    return f'<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document>{inside}</Document></kml>'


def kml_polygon(more: str = "") -> str:
    ring = " ".join(f"{lon},{lat},0" for lon, lat in RING)
    boundary = f"<outerBoundaryIs><LinearRing><coordinates>{ring}</coordinates></LinearRing></outerBoundaryIs>"
    return f"<Placemark><name>Airport</name><Polygon>{boundary}{more}</Polygon></Placemark>"


def test_a_polygon_of_geojson() -> None:
    found = shapes_in(geojson({"type": "Polygon", "coordinates": [RING]}, name="Airport", description="<b>CTR</b>"))
    assert found.shapes == [FoundShape("Airport", POINTS, reason="CTR")]
    assert found.skipped == []


def test_several_and_lines_of_geojson() -> None:
    several = {"type": "MultiPolygon", "coordinates": [[RING], [RING]]}
    assert [one.name for one in shapes_in(geojson(several, name="A")).shapes] == ["A 1", "A 2"]
    [line] = shapes_in(geojson({"type": "LineString", "coordinates": RING[:3]}, name="Road")).shapes
    assert line == FoundShape("Road", POINTS[:3], is_line=True)
    alone = shapes_in(json.dumps({"type": "Polygon", "coordinates": [RING]}))
    assert alone.shapes[0].name == "Shape 1"


def test_a_polygon_and_a_line_of_kml() -> None:
    line = "<Placemark><LineString><coordinates>8.0,47.0 8.01,47.0</coordinates></LineString></Placemark>"
    found = shapes_in(kml(f"<Folder>{kml_polygon()}</Folder>{line}"))
    assert found.shapes == [FoundShape("Airport", POINTS), FoundShape("Shape 2", POINTS[:2], is_line=True)]


@pytest.mark.parametrize(
    "coordinates",
    ["8.0, 47.0, 0 8.01, 47.0, 0", "8.0,47.0,0, 8.01,47.0,0,", "8.0 ,47.0\n 8.01 ,47.0", "8,47 8.01,47"],
)
def test_coordinates_of_kml_as_people_write_them(coordinates: str) -> None:
    line = f"<Placemark><LineString><coordinates>{coordinates}</coordinates></LineString></Placemark>"
    assert [one.points for one in shapes_in(kml(line)).shapes] == [POINTS[:2]]


@pytest.mark.parametrize("coordinates", ["8,5,47,1,0 8,6,47,2,0", "8 47 9 48", "8;47 9;48", "a,b c,d"])
def test_coordinates_of_kml_that_are_none_are_no_other_places(coordinates: str) -> None:
    line = f"<Placemark><name>L</name><LineString><coordinates>{coordinates}</coordinates></LineString></Placemark>"
    found = shapes_in(kml(line))
    assert (found.shapes, found.skipped) == ([], ["L: its points are not numbers."])


def test_what_is_no_zone_is_skipped_in_words() -> None:
    hole = shapes_in(geojson({"type": "Polygon", "coordinates": [RING, RING]}, name="Ring"))
    assert hole.skipped == ["Ring: it has a hole. Draw it as several areas without one."]
    inner = shapes_in(kml(kml_polygon("<innerBoundaryIs/>")))
    assert "hole" in inner.skipped[0]
    assert shapes_in(geojson({"type": "Point", "coordinates": [8, 47]})).skipped == ["A point: a point is no area."]
    broken = shapes_in(geojson({"type": "Polygon", "coordinates": [["x", None, {}]]}, name="B"))
    assert broken.skipped == ["B: its points are not numbers."]
    far = shapes_in(geojson({"type": "Polygon", "coordinates": [[[0, 0], [40, 0], [40, 40]]]}, name="F"))
    assert "200 km across" in far.skipped[0]


@pytest.mark.parametrize(
    "head",
    [
        '<!DOCTYPE kml [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>',
        '<!DOCTYPE kml SYSTEM "http://127.0.0.1/evil.dtd">',
        '<!DOCTYPE kml [<!ENTITY x SYSTEM "file:///etc/passwd">]>',
        '<!DOCTYPE kml [<!ENTITY % p SYSTEM "http://127.0.0.1/p"> %p;]>',
    ],
)
def test_a_document_type_ends_the_reading(head: str) -> None:
    with pytest.raises(UnreadableFile, match="document type"):
        shapes_in(f"<?xml version='1.0'?>{head}<kml><name>&b;&x;</name></kml>")


def test_bounds() -> None:
    with pytest.raises(UnreadableFile, match="kB"):
        shapes_in("{" + " " * MAX_FILE_BYTES)
    with pytest.raises(UnreadableFile, match="too deep"):
        shapes_in("<a>" * 60 + "</a>" * 60)
    with pytest.raises(UnreadableFile, match="too many elements"):
        shapes_in(f"<a>{'<b/>' * 60_000}</a>")
    many = [[RING]] * (MAX_SHAPES + 1)
    with pytest.raises(UnreadableFile, match=f"at most {MAX_SHAPES}"):
        shapes_in(geojson({"type": "MultiPolygon", "coordinates": many}))
    with pytest.raises(UnreadableFile):
        shapes_in('{"type":' * 5000)
    for text in ("", "hello", "<kml>", "[]", "{}", kml("")):
        with pytest.raises(UnreadableFile):
            shapes_in(text)


@given(
    st.one_of(st.text(max_size=300), st.text(alphabet='<>/!&;"kmlPolygon ', max_size=300).map(lambda one: f"<{one}"))
)
def test_any_text_is_read_or_refused(text: str) -> None:
    with suppress(UnreadableFile):
        shapes_in(text)


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.text(max_size=9),
        lambda inner: (
            st.lists(inner, max_size=4)
            | st.fixed_dictionaries(
                {"type": st.sampled_from(["Feature", "Polygon", "MultiPolygon", "GeometryCollection", "LineString"])},
                optional={"coordinates": inner, "geometry": inner, "properties": inner, "geometries": inner},
            )
        ),
        max_leaves=12,
    )
)
def test_any_json_is_read_or_refused(document: object) -> None:
    with suppress(UnreadableFile):
        shapes_in(json.dumps(document))


def test_placemarks_in_placemarks_are_looked_at_once() -> None:
    """38 deep with 400 kB of points, each was read once for each Placemark around it: 1.5 million words, and 10 s."""
    deep, points = 34, "<Point/>" * 45_000
    found = shapes_in(kml("<Placemark>" * deep + points + "</Placemark>" * deep))
    assert len(found.skipped) == 101
    assert found.skipped[-1] == f"There are {45_000 - 100} more that cannot become a zone."
    inner = shapes_in(kml(f"<Placemark><name>Outer</name>{kml_polygon()}</Placemark>"))
    assert [one.name for one in inner.shapes] == ["Airport"]
