"""The tower's cache of map tiles: its bound, what is fetched how often, and what it never contacts."""

import threading
from pathlib import Path

import pytest

from server.maps.io.area_tiles import Area, area_tiles, count_tiles
from server.maps.io.tile_proxy import FAILURES_TO_REST, FRESH_S, REST_S, TileLayer, TileProxy
from server.maps.io.tile_store import TileName, TileStore
from server.maps.io.upstream import TileUnavailable, Upstream, media_type
from server.runtime.judged_connection import is_allowed

LAYER = TileLayer(Upstream("https://tiles.example.org/{z}/{x}/{y}.png"), 10)


class Clock:
    def __init__(self) -> None:
        self.now_s = 1_000_000.0

    def __call__(self) -> float:
        return self.now_s


class Server:
    def __init__(self) -> None:
        self.asked: list[tuple[int, int, int]] = []
        self.content: bytes | None = b"tile"
        self.is_away = False
        self.hold: threading.Event | None = None

    def __call__(self, upstream: Upstream, zoom: int, x: int, y: int) -> bytes | None:
        self.asked.append((zoom, x, y))
        if self.hold is not None:
            self.hold.wait(10)
        if self.is_away:
            raise TileUnavailable("away")
        return self.content


@pytest.fixture
def clock() -> Clock:
    return Clock()


def store_of(folder: Path, clock: Clock, max_bytes: int = 1_000_000) -> TileStore:
    return TileStore(folder / "tiles", folder / "kept", max_bytes, clock)


def on_disk(folder: Path) -> int:
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


@pytest.mark.parametrize(
    ("address", "allowed", "if_private"),
    [
        ("8.8.8.8", True, True),
        ("2606:4700::1111", True, True),
        *((one, False, True) for one in ("127.0.0.1", "10.1.2.3", "192.168.0.1", "172.16.9.9", "::1", "fd00::1")),
        *((one, False, False) for one in ("169.254.169.254", "fe80::1%eth0", "0.0.0.0", "224.0.0.1", "ff02::1", "::")),
        *((one, False, True) for one in ("::ffff:127.0.0.1", "::ffff:10.0.0.1", "2002:7f00:1::")),
        *((one, False, False) for one in ("::ffff:169.254.169.254", "64:ff9b::a9fe:a9fe", "::127.0.0.1", "fec0::1")),
        *((one, False, False) for one in ("64:ff9b:1::a00:1", "64:ff9b:1:fffe::7f00:1", "100.64.0.1")),
        *((one, False, False) for one in ("fd00:ec2::254", "fd20:ce::254", "100.100.100.200", "168.63.129.16")),
        ("64:ff9b::808:808", True, True),
        ("not an address", False, False),
    ],
)
def test_a_private_address_is_contacted_only_where_an_admin_says_so(
    address: str, allowed: bool, if_private: bool
) -> None:
    assert is_allowed(address, may_be_private=False) is allowed
    assert is_allowed(address, may_be_private=True) is if_private


def test_a_tile_is_what_its_bytes_say() -> None:
    assert media_type(b"\x89PNG\r\n\x1a\n....") == "image/png"
    assert media_type(b"\xff\xd8\xff\xe0") == "image/jpeg"
    assert media_type(b"RIFF\0\0\0\0WEBPVP8 ") == "image/webp"
    assert media_type(b"<html><script>") is None
    assert media_type(b"<svg xmlns=") is None


def test_the_cache_never_grows_beyond_its_bound_and_drops_what_was_not_used(tmp_path: Path, clock: Clock) -> None:
    store = store_of(tmp_path, clock, max_bytes=100_000)
    names = [TileName("layer", 8, x, 0) for x in range(60)]
    for name in names:
        clock.now_s += 1
        store.put(name, b"x" * 4_000)
        assert store.get(names[0]) is not None, "used all the time"
        assert on_disk(tmp_path) <= 100_000
    assert store.get(names[1]) is None
    assert store.get(names[-1]) is not None
    assert store.cached_bytes == on_disk(tmp_path)
    # What another run of the tower finds there counts as well.
    again = store_of(tmp_path, clock, max_bytes=50_000)
    again.put(TileName("layer", 8, 99, 0), b"x" * 4_000)
    assert on_disk(tmp_path) <= 50_000


def test_what_is_kept_is_not_dropped_and_a_removed_layer_leaves_nothing(tmp_path: Path, clock: Clock) -> None:
    store = store_of(tmp_path, clock, max_bytes=10_000)
    kept, other = TileName("layer", 3, 0, 0), TileName("other", 3, 0, 0)
    store.keep(kept, b"k" * 4_000)
    store.put(other, b"o")
    for x in range(20):
        store.put(TileName("layer", 4, x, 0), b"x" * 4_000)
    assert store.get(kept) is not None
    assert store.mean_bytes("layer") == 4_000
    store.forget("layer")
    assert store.get(kept) is None
    assert store.mean_bytes("layer") is None
    assert store.cached_bytes <= 1_000


def test_a_tile_is_fetched_once_however_many_ask(tmp_path: Path, clock: Clock) -> None:
    server = Server()
    server.hold = threading.Event()
    proxy = TileProxy(store_of(tmp_path, clock), server, clock)
    futures = [proxy.begin(LAYER, 3, 1, 2) for _ in range(20)]
    server.hold.set()
    assert {future.result(5) for future in futures} == {b"tile"}
    assert proxy.tile(LAYER, 3, 1, 2) == b"tile"
    assert server.asked == [(3, 1, 2)]
    proxy.close()


def test_with_the_network_cut_old_tiles_are_served_and_the_server_is_left_alone(tmp_path: Path, clock: Clock) -> None:
    server = Server()
    proxy = TileProxy(store_of(tmp_path, clock), server, clock)
    assert proxy.tile(LAYER, 3, 1, 2) == b"tile"
    clock.now_s += FRESH_S + 1
    server.is_away = True
    assert proxy.tile(LAYER, 3, 1, 2) == b"tile"
    for x in range(10):
        with pytest.raises(TileUnavailable):
            proxy.tile(LAYER, 4, x, 0)
    assert len(server.asked) == 1 + FAILURES_TO_REST
    clock.now_s += REST_S + 1
    server.is_away = False
    assert proxy.tile(LAYER, 4, 0, 0) == b"tile"
    proxy.close()


def test_that_there_is_no_tile_is_remembered_for_a_day(tmp_path: Path, clock: Clock) -> None:
    server = Server()
    server.content = None
    proxy = TileProxy(store_of(tmp_path, clock), server, clock)
    assert [proxy.tile(LAYER, 3, 1, 2) for _ in range(3)] == [None] * 3
    assert len(server.asked) == 1
    clock.now_s += 90_000
    assert proxy.tile(LAYER, 3, 1, 2) is None
    assert len(server.asked) == 2
    proxy.close()


def test_the_numbers_of_a_tile_are_those_of_its_zoom() -> None:
    assert LAYER.has(10, 1023, 0)
    assert not LAYER.has(11, 0, 0)
    assert not LAYER.has(2, 4, 0)
    assert not LAYER.has(2, 0, -1)


def test_an_area_is_covered_from_coarse_to_fine_and_across_the_antimeridian() -> None:
    area = Area(47.39, 8.53, 47.41, 8.56)
    tiles = list(area_tiles(area, 14))
    assert tiles[0] == (0, 0, 0)
    assert len(tiles) == count_tiles(area, 14) == len(set(tiles))
    assert (14, 8580, 5736) in tiles
    pacific = list(area_tiles(Area(-18.0, 179.0, -17.0, -179.0), 6))
    assert {x for zoom, x, _ in pacific if zoom == 6} == {63, 0}
    assert count_tiles(Area(-90, -180, 90, 180), 3) == 1 + 4 + 16 + 64
