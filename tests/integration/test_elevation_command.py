"""`tower elevation`, as the tower's operator uses it. The command runs in this process, its converter in its own."""

import sqlite3
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner
from worlds.geotiff_files import Geotiff, projected

from server.app.cli import app
from server.app.commands.session import CommandError
from server.maps.io.map_files import MapFolder
from server.maps.io.terrain import Terrain

Tower = Callable[..., str]


@pytest.fixture
def tower(tmp_path: Path) -> Tower:
    def run(*words: str) -> str:
        """Returns standard output. Raises the error that `main` would print to standard error."""
        done = CliRunner().invoke(app, words, env={"TOWER_VAR": str(tmp_path / "var")})
        if done.exception is not None:
            raise done.exception
        return done.output

    run("migrate")
    return run


def test_a_geotiff_becomes_elevation(tower: Tower, tmp_path: Path) -> None:
    source = Geotiff(np.full((40, 50), 321.5, "f4"), is_deflated=True, predictor=3, tile=16)
    source.write(tmp_path / "My Hills (1).tif")
    said = tower("elevation", str(tmp_path / "My Hills (1).tif"), "--attribution", "A survey")
    assert said.startswith("my-hills-1: ")
    assert "up to zoom 13" in said
    files = MapFolder(tmp_path / "var" / "maps")
    (file,), unusable = files.look()
    assert (file.name, file.role, file.title, file.attribution) == (
        "my-hills-1",
        "terrain",
        "My Hills (1)",
        "A survey",
    )
    assert not unusable
    terrain = Terrain(lambda: files.look()[0])
    assert terrain.heights([(46.995, 8.005), (46.0, 8.0)]) == [321.5, None]
    terrain.close()
    with sqlite3.connect(tmp_path / "var" / "tower.sqlite3") as database:
        actions = [row[0] for row in database.execute("SELECT action FROM audit_events")]
    assert "map.file_added" in actions


def test_what_cannot_be_read_is_one_line_and_leaves_nothing(tower: Tower, tmp_path: Path) -> None:
    Geotiff(np.zeros((9, 9), "f4"), keys=projected(2056)).write(tmp_path / "swiss.tif")
    with pytest.raises(CommandError, match=r"^swiss\.tif has the projection EPSG:2056: only EPSG:4326"):
        tower("elevation", str(tmp_path / "swiss.tif"))
    (tmp_path / "picture.tif").write_bytes(b"GIF89a, and more")
    with pytest.raises(CommandError, match=r"^picture\.tif is no TIFF file$"):
        tower("elevation", str(tmp_path / "picture.tif"))
    with pytest.raises(CommandError, match="give it a --name"):
        tower("elevation", str(tmp_path / "picture.tif"), "--name", "../up")
    assert list((tmp_path / "var" / "maps").iterdir()) == []
