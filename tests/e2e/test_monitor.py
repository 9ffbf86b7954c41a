"""The squad on the map and in the list."""

from console_page import Somebody, signed_in
from worlds.processes import World


def test_the_map_goes_to_a_squad_that_gets_its_first_position_after_sign_in(
    somebody_early: Somebody, quiet_world: World
) -> None:
    admin = signed_in(somebody_early, "admin")
    quiet_world.start_simulated("Kestrel", "Merlin", options=("--boot-s", "3", "--seed", "7"))

    def shows_the_squad() -> bool:
        lat, lon, zoom = (admin.part("map").get_attribute(f"data-{name}") or "0" for name in ("lat", "lon", "zoom"))
        return abs(float(lat) - 47.3977) < 0.01 and abs(float(lon) - 8.5456) < 0.01 and float(zoom) > 12

    admin.wait("the map at the squad", shows_the_squad)
