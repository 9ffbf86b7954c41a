"""Elevation from GeoTIFF: what the tower says of the ground afterwards."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from worlds.geotiff_files import Geotiff, projected

from server.maps.io.elevation import conversion, tiff_file
from server.maps.io.elevation.conversion import Converted, convert
from server.maps.io.elevation.projections import Geographic, Projection, Utm, WebMercator
from server.maps.io.elevation.refusals import BadElevationFile
from server.maps.io.map_files import MapFolder
from server.maps.io.terrain import Terrain

STEP_M = 1 / 256
"""Of the encoding."""
PX = 1 / 3600


def made(folder: Path, about: Geotiff, max_bytes: int = 100_000_000) -> Converted:
    source = about.write(folder / "source.tif")
    scratch = folder / ".scratch"
    try:
        return convert(
            source,
            folder / "made.pmtiles",
            scratch,
            title="Hills",
            attribution="A survey",
            max_bytes=max_bytes,
            report=lambda _: None,
        )
    finally:
        scratch.unlink(missing_ok=True)


def heights(folder: Path, places: list[tuple[float, float]]) -> list[float | None]:
    files = MapFolder(folder)
    terrain = Terrain(lambda: files.look()[0])
    try:
        return terrain.heights(places)
    finally:
        terrain.close()


def slope(rows: int = 90, columns: int = 120, dtype: str = "f4") -> np.ndarray[Any, Any]:
    """A plane, which interpolation does not change: 3 m a column, 2 m a row, lowest in the north-west at -50 m."""
    return (np.arange(rows)[:, None] * 2 + np.arange(columns)[None, :] * 3 - 50).astype(dtype)


def slope_at(lat_deg: float, lon_deg: float) -> float:
    return ((47.0 - lat_deg) / PX - 0.5) * 2 + ((lon_deg - 8.0) / PX - 0.5) * 3 - 50


INSIDE = [
    (47.0 - row * PX, 8.0 + column * PX) for row in (1.0, 33.3, 61.7, 88.9) for column in (1.2, 40.5, 77.7, 118.6)
]

LAYOUTS: dict[str, dict[str, Any]] = {
    "strips": {},
    "tiles": {"tile": 32},
    "high byte first": {"order": ">"},
    "BigTIFF": {"is_big": True, "tile": 64},
    "deflate": {"is_deflated": True},
    "differences": {"is_deflated": True, "predictor": 2, "tile": 32},
    "differences, high byte first": {"predictor": 2, "order": ">"},
}


@pytest.mark.parametrize("dtype", ["f4", "i2", "f8", "i4"])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_heights_are_those_of_the_file(tmp_path: Path, layout: str, dtype: str) -> None:
    found = made(tmp_path, Geotiff(slope(dtype=dtype), **LAYOUTS[layout]))
    # Pixels of 21 by 31 m; at this latitude zoom 13 has 13 m, and zoom 12 would have 26 m.
    assert found.zoom == 13
    assert heights(tmp_path, INSIDE) == pytest.approx([slope_at(*place) for place in INSIDE], abs=STEP_M)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("dtype", ["f4", "f8"])
def test_differences_of_floats(tmp_path: Path, dtype: str, order: str) -> None:
    made(tmp_path, Geotiff(slope(dtype=dtype), predictor=3, is_deflated=True, tile=32, order=order))
    assert heights(tmp_path, INSIDE) == pytest.approx([slope_at(*place) for place in INSIDE], abs=STEP_M)


@pytest.mark.parametrize("dtype", ["f4", "i2", "u2"])
def test_lzw_of_another_writer(tmp_path: Path, dtype: str) -> None:
    """OpenCV's writer is libtiff's: LZW with as many codes as the table has, and more."""
    cv2 = pytest.importorskip("cv2")
    noise = np.random.default_rng(7).integers(0, 900, (150, 130)).astype(dtype)
    values = np.concatenate([noise, np.full_like(noise, 77), slope(100, 130, dtype)])
    for predictor in (1, 2):
        flags = [cv2.IMWRITE_TIFF_COMPRESSION, 5, cv2.IMWRITE_TIFF_PREDICTOR, predictor]
        assert cv2.imwrite(str(tmp_path / "lzw.tif"), values, flags)
        with tiff_file.TiffFile(tmp_path / "lzw.tif") as file:
            assert file.numbers(259) == (5,)
            read = np.zeros_like(values)
            for row, column, block in file.blocks():
                assert block is not None
                read[row : row + len(block), column : column + block.shape[1]] = block
        assert (read == values).all()


@pytest.mark.parametrize(
    ("code", "projection", "x", "y"),
    [
        (32632, Utm(32, is_south=False), 466_000.0, 5_250_000.0),
        (25832, Utm(32, is_south=False), 466_000.0, 5_250_000.0),
        (32733, Utm(33, is_south=True), 300_000.0, 6_240_000.0),
        (3857, WebMercator(), 951_000.0, 6_005_000.0),
    ],
)
def test_planes_of_metres(tmp_path: Path, code: int, projection: Projection, x: float, y: float) -> None:
    made(tmp_path, Geotiff(slope(), x, y, 25.0, 25.0, projected(code), is_deflated=True))
    columns, rows = np.array([1.5, 40.0, 77.3, 118.0]), np.array([1.5, 30.0, 61.2, 88.0])
    lat_deg, lon_deg = projection.back(x + columns * 25.0, y - rows * 25.0)
    expected = (rows - 0.5) * 2 + (columns - 0.5) * 3 - 50
    places = [(float(lat), float(lon)) for lat, lon in zip(lat_deg, lon_deg, strict=True)]
    assert heights(tmp_path, places) == pytest.approx(expected.tolist(), abs=STEP_M + 0.002)


def test_utm_is_that_of_the_surveyors() -> None:
    x, y = Utm(32, is_south=False).forward(np.array([47.3977]), np.array([8.5456]))
    assert (x[0], y[0]) == pytest.approx((465_705.0, 5_249_500.0), abs=400.0)
    # The central meridian, by its definition; the meridian's arc from the equator to 45 degrees is 4,984,944.378 m.
    x, y = Utm(31, is_south=False).forward(np.array([0.0, 45.0]), np.array([3.0, 3.0]))
    assert x == pytest.approx([500_000.0, 500_000.0])
    assert y == pytest.approx([0.0, 4_984_944.378 * 0.9996], abs=0.001)


@pytest.mark.parametrize("projection", [Geographic(), WebMercator(), Utm(60, is_south=True), Utm(1, is_south=False)])
def test_back_undoes_forward(projection: Projection) -> None:
    south = -1.0 if projection == Utm(60, is_south=True) else 1.0
    lat_deg, lon_deg = south * np.array([0.5, 30.0, 60.0, 80.0]), np.array([176.0, 177.0, 178.5, 179.9]) * -south
    found_lat, found_lon = projection.back(*projection.forward(lat_deg, lon_deg))
    assert found_lat == pytest.approx(lat_deg, abs=1e-8)
    assert (found_lon - lon_deg + 180) % 360 - 180 == pytest.approx(np.zeros(4), abs=1e-8)


def test_no_value_is_no_height(tmp_path: Path) -> None:
    values = slope()
    values[30:50, 40:70] = -9999.0
    values[60:70, 0:20] = np.nan
    values[60:70, 100:] = 3.4e38  # beyond any ground
    made(tmp_path, Geotiff(values, nodata="-9999"))
    unknown = [(47.0 - 40 * PX, 8.0 + 55 * PX), (47.0 - 65 * PX, 8.0 + 10 * PX), (47.0 - 65 * PX, 8.0 + 110 * PX)]
    # Half a pixel from a value that is missing, nothing is interpolated either.
    unknown.append((47.0 - 30.0 * PX, 8.0 + 55 * PX))
    known = [(47.0 - 27 * PX, 8.0 + 55 * PX), (47.0 - 40 * PX, 8.0 + 73 * PX), (47.0 - 65 * PX, 8.0 + 60 * PX)]
    assert heights(tmp_path, unknown) == [None] * 4
    assert heights(tmp_path, known) == pytest.approx([slope_at(*place) for place in known], abs=STEP_M)
    assert heights(tmp_path, [(47.1, 8.01), (46.9, 8.01), (47.0 - 20 * PX, 7.99)]) == [None] * 3


def test_files_side_by_side_leave_no_gap(tmp_path: Path) -> None:
    made(tmp_path, Geotiff(slope()))
    (tmp_path / "made.pmtiles").rename(tmp_path / "west.pmtiles")
    made(tmp_path, Geotiff(slope() + 360, west=8.0 + 120 * PX))
    seam = [(47.0 - 40.3 * PX, 8.0 + column * PX) for column in np.arange(117.0, 123.0, 0.1)]
    # Beyond the last middles of pixels a plane is flat for 1.5 pixels of 3 m.
    assert heights(tmp_path, seam) == pytest.approx([slope_at(*place) for place in seam], abs=4.6)


def test_across_the_antimeridian(tmp_path: Path) -> None:
    made(tmp_path, Geotiff(slope(), west=180.0 - 60 * PX))
    places = [(47.0 - 40 * PX, 180.0 - 20.5 * PX), (47.0 - 40 * PX, -180.0 + 30.5 * PX)]
    expected = [slope_at(47.0 - 40 * PX, 8.0 + column * PX) for column in (39.5, 90.5)]
    assert heights(tmp_path, places) == pytest.approx(expected, abs=STEP_M)


def test_pixels_that_are_points_and_heights_in_feet(tmp_path: Path) -> None:
    keys = {1024: 2, 1025: 2, 2048: 4326, 4099: 9002}
    made(tmp_path, Geotiff(slope(), keys=keys))
    place = (47.0 - 40 * PX, 8.0 + 50 * PX)
    assert heights(tmp_path, [place]) == pytest.approx([(40 * 2 + 50 * 3 - 50) * 0.3048], abs=STEP_M)


def test_the_file_says_what_it_is(tmp_path: Path) -> None:
    found = made(tmp_path, Geotiff(slope()))
    (file,), unusable = MapFolder(tmp_path).look()
    assert not unusable
    assert (file.role, file.title, file.attribution, file.bytes) == ("terrain", "Hills", "A survey", found.bytes)


def test_many_tiles_have_leaf_directories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("server.maps.io.elevation.pmtiles_writer.DATA_AT", 200)
    monkeypatch.setattr("server.maps.io.elevation.pmtiles_writer.LEAF_ENTRIES", 4)
    found = made(tmp_path, Geotiff(slope(150, 200), step_x=PX * 2, step_y=PX * 2))
    assert found.tiles > 12
    assert heights(tmp_path, [(47.0 - 41 * PX, 8.0 + 51 * PX)]) == pytest.approx([20 * 2 + 25 * 3 - 50], abs=STEP_M)


def _changed(tag: int, what: tuple[int, tuple[Any, ...]] | None) -> Callable[[], Geotiff]:
    return lambda: Geotiff(slope(), changed_tags={tag: what})


REFUSED: dict[str, tuple[Callable[[], Geotiff], str]] = {
    "no georeference": (_changed(33550, None), "no georeference"),
    "no keys": (_changed(34735, None), "the projection its own"),
    "other projection": (lambda: Geotiff(slope(), keys=projected(2056)), "projection EPSG:2056"),
    "colours": (_changed(277, (3, (3,))), "colour picture"),
    "palette": (_changed(262, (3, (3,))), "colour picture"),
    "bytes": (lambda: Geotiff(slope(dtype="u1")), "values of 8 bits"),
    "compression": (_changed(259, (3, (50001,))), "compression 50001"),
    "predictor": (lambda: Geotiff(slope(dtype="i2"), changed_tags={317: (3, (3,))}), "predictor 3"),
    "too many pixels": (_changed(256, (4, (100_000_000,))), "too large: 100000000 by 90 pixels"),
    "too many tiles": (lambda: Geotiff(slope(), step_x=1.0, step_y=0.00001), "too large: .* tiles of zoom 17"),
    "turned": (_changed(33550, (12, (PX, -PX, 0.0))), "turned or mirrored"),
    "nowhere": (lambda: Geotiff(slope(), north=2000.0), "nowhere on Earth"),
    "blocks missing": (_changed(273, (4, (8,))), "not as many blocks"),
    "block outside": (lambda: Geotiff(slope(), strip_rows=90, changed_tags={273: (4, (10**9,))}), "not whole"),
    "not deflate": (lambda: Geotiff(slope(), changed_tags={259: (3, (8,))}), "cannot be unpacked"),
    "not LZW": (lambda: Geotiff(slope(dtype="u4") + (1 << 31), changed_tags={259: (3, (5,))}), "is broken"),
    "nothing": (lambda: Geotiff(np.full((9, 9), np.nan, "f4")), "no height anywhere"),
    "words for nodata": (lambda: Geotiff(slope(), nodata="none"), "which is no number"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_in_words(tmp_path: Path, case: str) -> None:
    about, words = REFUSED[case]
    with pytest.raises(BadElevationFile, match=words):
        made(tmp_path, about())


def test_a_file_that_is_cut_off_or_is_no_tiff_is_refused(tmp_path: Path) -> None:
    whole = Geotiff(slope(), is_deflated=True).write(tmp_path / "whole.tif").read_bytes()
    for content in (b"", b"GIF89a, and more", whole[:6], whole[:2000], whole[:-300]):
        (tmp_path / "part.tif").write_bytes(content)
        with pytest.raises(BadElevationFile), tiff_file.TiffFile(tmp_path / "part.tif") as file:
            list(file.blocks())


def test_the_tiles_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BadElevationFile, match="more than 0 MB"):
        made(tmp_path, Geotiff(slope()), max_bytes=20_000)
    (tmp_path / "made.pmtiles").unlink()
    monkeypatch.setattr(conversion, "MAX_TILES", 3)
    with pytest.raises(BadElevationFile, match="at most 3"):
        made(tmp_path, Geotiff(slope(), step_x=PX * 4, step_y=PX * 4))
