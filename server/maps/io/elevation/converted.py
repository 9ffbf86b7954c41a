"""What a conversion has made. Loads no NumPy: the tower's process has none."""

import msgspec


class Converted(msgspec.Struct, frozen=True):
    """`bytes`: of the PMTiles file. `tiles`: of all zooms."""

    zoom: int
    tiles: int
    bytes: int
