"""Teams in the browser: a user makes a team and invites another, who joins, sees the drone at once, and is removed."""

import os
from pathlib import Path

from axe_look import Axe
from console_page import ConsolePage, Somebody, signed_in
from playwright.sync_api import expect


def fits_a_telephone(console: ConsolePage, state: str) -> None:
    """Nothing is wider than the screen."""
    console.page.set_viewport_size({"width": 390, "height": 844})
    assert console.page.evaluate("document.documentElement.scrollWidth") <= 390
    folder = os.environ.get("CONSOLE_PICTURES")
    if folder:
        console.page.screenshot(path=Path(folder) / f"{state}-390.png", full_page=True)
    console.page.set_viewport_size({"width": 1440, "height": 900})


def test_a_team_from_its_making_to_a_member_who_is_removed(somebody_early: Somebody, axe: Axe) -> None:
    alice, bob = signed_in(somebody_early, "alice"), signed_in(somebody_early, "bob")
    assert bob.squad() == ["2"]
    alice.part("user-menu").click()
    alice.part("open-teams").click()
    alice.part("new-team").click()
    alice.part("team-name").fill("Mountain rescue")
    alice.part("team-save").click()
    team = alice.part("team").filter(has_text="Mountain rescue")
    expect(team.get_by_test_id("my-role")).to_have_text("Team admin")
    team.get_by_test_id("drone-choose").select_option(label="Kestrel")
    team.get_by_test_id("drone-add").click()
    expect(team.get_by_test_id("team-drone")).to_contain_text("Kestrel")

    # The page does not reveal whether the name exists.
    for name in ("Bob", "nobody at all"):
        team.get_by_test_id("team-invite").click()
        alice.part("invite-name").fill(name)
        alice.part("invite-role").select_option("operator")
        alice.part("invite-send").click()
        invited = team.get_by_test_id("invited").filter(has_text=name)
        expect(invited).to_contain_text("invited as operator, until")
    axe.look(alice, "teams-of-an-admin")
    fits_a_telephone(alice, "teams-of-an-admin")

    bob.open("/#/account/teams")
    expect(bob.part("received")).to_contain_text("alice invites you to Mountain rescue as operator.")
    axe.look(bob, "teams-invited")
    fits_a_telephone(bob, "teams-invited")
    bob.part("accept").click()
    expect(bob.part("team")).to_contain_text("Kestrel")
    expect(bob.part("team-invite")).to_have_count(0)
    bob.open("/#/")
    expect(bob.part("squad-row")).to_have_count(2)

    # Removing a member asks for confirmation and takes the drone from them at once.
    alice.page.reload()
    member = alice.part("member").filter(has_text="bob")
    expect(member.get_by_test_id("member-role")).to_have_value("operator")
    member.get_by_test_id("member-remove").click()
    alice.confirm("bob")
    expect(alice.part("member").filter(has_text="bob")).to_have_count(0)
    expect(bob.part("squad-row")).to_have_count(1)
