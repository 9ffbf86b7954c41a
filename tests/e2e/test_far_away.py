"""The console from the other side of the world: half a second to the tower and back, and a network that goes away."""

from console_page import signed_in, visitors
from playwright.sync_api import Browser, expect
from worlds.far_away import far_away
from worlds.processes import World

ONE_WAY_S = 0.25


def test_a_drone_is_flown_over_half_a_second_of_round_trip_and_a_broken_connection(
    chromium: Browser, world: World
) -> None:
    with far_away(world.port, one_way_s=ONE_WAY_S) as tower, visitors(chromium, tower.address) as somebody:
        alice = signed_in(somebody, "alice")
        alice.open_drone("Kestrel")
        alice.acquire("Kestrel")
        alice.take_off("Kestrel", 8)
        # So far nobody had a reason to put it on hold.
        expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")
        alice.wait("GUIDED", lambda: alice.word("mode") == "GUIDED")

        tower.cut()
        # The page knows by the silence, and says so; what it shows is not taken for the present.
        expect(alice.part("connection-state")).not_to_contain_text("Connected")
        expect(alice.part("action-land")).to_be_disabled()
        tower.mend()
        expect(alice.part("connection-state")).to_contain_text("Connected")

        # Back within the grace time she has the controls still, and can use them at once.
        expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")
        alice.part("action-land").click()
        alice.confirm("Kestrel")
        alice.wait("landing", lambda: alice.word("armed") == "false")
