"""Valid values of `TOWER_TILES`, and the messages for invalid ones."""

from pathlib import Path

import pytest

from server.http.security_headers import content_security_policy
from server.maps.io.tile_source import TileAddresses, TileFile, read_tiles
from server.runtime.settings import SettingsError, read_settings

GOOD = "https://tiles.example.org/{z}/{x}/{y}.png"


def header(tile_type: int, *, magic: bytes = b"PMTiles", version: int = 3) -> bytes:
    """Returns the fields of a PMTiles header that are checked."""
    raw = bytearray(127)
    raw[:7], raw[7], raw[99] = magic, version, tile_type
    return bytes(raw)


@pytest.mark.parametrize(
    "text",
    [
        GOOD,
        "http://localhost:8080/a/{z}/{x}/{y}@2x.webp?key=1%20",
        "https://[::1]:444/{x}/{y}/{z}",
    ],
)
def test_addresses_are_taken(text: str) -> None:
    source = read_tiles(text)
    assert isinstance(source, TileAddresses)
    assert source.template == text


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("ftp://tiles.example.org/{z}/{x}/{y}", "https://"),
        ("https://tiles.example.org/{z}/{x}.png", "{y}"),
        ("https://tiles.example.org/{z}/{z}/{x}/{y}", "{z}"),
        ("https:///{z}/{x}/{y}", "one host"),
        ("https://{s}.example.org/{z}/{x}/{y}", "one host"),
        ("https://*.example.org/{z}/{x}/{y}", "one host"),
        ("https://me:secret@example.org/{z}/{x}/{y}", "one host"),
        ("https://example.org:port/{z}/{x}/{y}", "one host"),
        ("https://example.org/{z}/{x}/{y}{r}.png", "other places"),
        ("https://example.org/{z}/{x}/{y}; script-src *", "semicolons"),
        ("https://example.org;/{z}/{x}/{y}", "semicolons"),
        ("https://exämple.org/{z}/{x}/{y}", "spaces"),
    ],
)
def test_addresses_that_cannot_be_used_are_turned_down(text: str, problem: str) -> None:
    with pytest.raises(ValueError, match="must") as raised:
        read_tiles(text)
    assert problem in str(raised.value)


@pytest.mark.parametrize(
    ("tile_type", "kind"), [(1, "vector"), (2, "raster"), (3, "raster"), (4, "raster"), (5, "raster")]
)
def test_a_file_is_known_by_its_header(tmp_path: Path, tile_type: int, kind: str) -> None:
    file = tmp_path / "region.pmtiles"
    file.write_bytes(header(tile_type))
    assert read_tiles(str(file)) == TileFile(file, kind)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "not PMTiles"),
        (header(2)[:100], "not PMTiles"),
        (header(2, magic=b"SQLite "), "not PMTiles"),
        (header(2, version=2), "version 2"),
        (header(0), "neither images nor MVT"),
        (header(9), "neither images nor MVT"),
    ],
)
def test_a_file_that_cannot_be_used_is_turned_down(tmp_path: Path, content: bytes, problem: str) -> None:
    file = tmp_path / "region.pmtiles"
    file.write_bytes(content)
    with pytest.raises(ValueError, match=problem):
        read_tiles(str(file))


def test_a_file_that_is_not_there_or_is_a_folder_is_turned_down(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not there"):
        read_tiles(str(tmp_path / "none.pmtiles"))
    with pytest.raises(ValueError, match="cannot be read: Is a directory"):
        read_tiles(str(tmp_path))


def test_the_setting_names_its_variable_and_hides_what_may_be_a_key() -> None:
    with pytest.raises(SettingsError, match=r"^TOWER_TILES must contain") as raised:
        read_settings({"TOWER_TILES": "https://tiles.example.org/secret/{z}"})
    assert "secret" not in str(raised.value)
    with pytest.raises(SettingsError, match="TOWER_TILES_ATTRIBUTION"):
        read_settings({"TOWER_TILES_ATTRIBUTION": "a\tb"})
    with pytest.raises(SettingsError, match="TOWER_TILES_MOST_ZOOM"):
        read_settings({"TOWER_TILES_MOST_ZOOM": "25"})


def test_the_policy_of_a_page_names_no_other_origin() -> None:
    assert "://" not in content_security_policy()
