"""The console far from the tower: a round trip of half a second, and a network that fails."""

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
        # No loss has held the drone so far.
        expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")
        alice.wait("GUIDED", lambda: alice.word("mode") == "GUIDED")

        tower.cut()
        # The page detects the silence and reports it; it does not present the old data as current.
        expect(alice.part("connection-state")).not_to_contain_text("Connected")
        expect(alice.part("bar-land")).to_be_disabled()
        tower.mend()
        expect(alice.part("connection-state")).to_contain_text("Connected")

        # Back within the grace time, she still has the controls and can use them at once.
        expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")
        alice.ends_flight("land")
        alice.wait("landing", lambda: alice.word("armed") == "false")
