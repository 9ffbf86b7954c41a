"""A pilot finds the last flight in the list and downloads it."""

import io
from pathlib import Path

from axe_look import Axe
from console_page import ConsolePage, Somebody, signed_in
from playwright.sync_api import expect

from server.flights.core.tlog import read_entries

COMMAND = """async (command) => {
  const answer = await fetch('/api/v1/drones/1/commands', {
    method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify({ command }),
  });
  return [answer.status, await answer.text()];
}"""
ENDED_WITHIN_S = 60.0


def do(console: ConsolePage, command: str) -> None:
    status, text = console.page.evaluate(COMMAND, command)
    assert status == 200, text


def test_a_flight_is_found_and_downloaded(somebody: Somebody, axe: Axe, tmp_path: Path) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.wait("a position", lambda: alice.word("gps") != "" and alice.number("latitude") > 40)
    alice.acquire("Kestrel")
    do(alice, "arm")
    alice.open("/#/flights")
    row = alice.part("flight-row")
    search = alice.part("flight-search")

    def searched(state: str) -> bool:
        search.click()
        alice.page.wait_for_timeout(300)
        return row.count() == 1 and row.get_attribute("data-state") == state

    alice.wait("the flight in the list", lambda: searched("recording"))
    expect(alice.part("flight-note")).to_have_text("Is being recorded")
    do(alice, "disarm")
    alice.wait("its end", lambda: searched("ready"), timeout_s=ENDED_WITHIN_S)
    expect(row).to_contain_text("Kestrel")
    expect(row).to_contain_text("alice")
    axe.look(alice, "flights")
    with alice.page.expect_download() as download:
        alice.part("flight-tlog").click()
    file = tmp_path / "flight.tlog"
    download.value.save_as(file)
    assert download.value.suggested_filename.startswith("Kestrel-20")
    assert sum(1 for _ in read_entries(io.BytesIO(file.read_bytes()))) > 100
    with alice.page.expect_download() as download:
        alice.part("flight-csv").click()
    download.value.save_as(file)
    assert len(file.read_text().splitlines()) > 10
    alice.part("flight-pilot").fill("bob")
    search.click()
    expect(row).to_have_count(0)
    expect(alice.page.get_by_text("No flight fits this search.")).to_be_visible()
    alice.part("flights-all").click()
    expect(row).to_have_count(1)
