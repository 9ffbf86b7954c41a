"""`python -m simulator.land_map`: writes the map files of the simulated land. What is there already stays."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Final

import cv2
import typer

from simulator.geodesy import LocalFrame
from simulator.land_map import elevation, imagery, vector_map
from simulator.land_map.pmtiles import TileType, write_pmtiles
from simulator.land_map.tile_grid import Tile, TileGrid
from simulator.squad import parse_home

VERSION: Final = 1
"""Part of what a file is made from: raise it when the drawing changes, and files are drawn again."""
DRAWN_FROM: Final = "drawn_from"

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def write(
    home: Annotated[str, typer.Option(help="LAT,LON[,ALT[,HEADING]], as for tower-sim.")],
    out: Annotated[Path, typer.Option(help="Folder for the files.")],
    seed: Annotated[int, typer.Option(help="As for tower-sim.")] = 1,
    hills: Annotated[bool, typer.Option("--hills", help="As for tower-sim: the heights of the land, too.")] = False,
) -> None:
    """Write simulated-land.pmtiles (vector, with names), simulated-land-from-above.pmtiles (imagery) and, with
    hills, simulated-land-heights.pmtiles (elevation)."""
    try:
        place, _ = parse_home(home)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    cv2.setNumThreads(1)
    out.mkdir(parents=True, exist_ok=True)
    grid = TileGrid(LocalFrame(place))
    made_from = hashlib.sha256(
        repr((VERSION, place.lat_deg, place.lon_deg, place.alt_amsl_m, seed)).encode()
    ).hexdigest()[:16]

    def draw(name: str, part: Any, tiles: Callable[[int, TileGrid], dict[Tile, bytes]], kind: TileType) -> None:
        file, mark = out / f"{name}.pmtiles", out / f".{name}.{DRAWN_FROM}"
        if file.exists() and mark.exists() and mark.read_text() == made_from:
            return
        write_pmtiles(file, tiles(seed, grid), kind, part.bounds(grid), part.METADATA)
        mark.write_text(made_from)
        typer.echo(f"{file}: {file.stat().st_size / 1e6:.1f} MB")

    draw("simulated-land", vector_map, vector_map.vector_tiles, vector_map.KIND)
    if hills:
        draw("simulated-land-heights", elevation, elevation.height_tiles, elevation.KIND)
    draw("simulated-land-from-above", imagery, imagery.image_tiles, imagery.KIND)


if __name__ == "__main__":
    app()
