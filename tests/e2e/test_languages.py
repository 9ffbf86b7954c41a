"""The console in Portuguese: chosen in the menu, kept with the user, fetched by nobody who reads English."""

import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from axe_look import Axe
from console_page import SIMULATOR, ConsolePage, Somebody, visitors
from playwright.sync_api import Browser, Request, expect
from worlds.processes import World

NEW = "seven quiet herons at noon"
WEAK = "abcdefghijkl"
CATALOGUE = re.compile(r"/portuguese-[^/]+\.js$")
PAGES = {
    "/": "Esquadrilha",
    "/#/missions": "Missões",
    "/#/squad-mission": "Missão da esquadrilha",
    "/#/flights": "Voos importados",
    "/#/statistics": "Estatísticas",
    "/#/zones": "Zonas",
    "/#/account": "Palavra-passe",
    "/#/admin": "Utilizadores",
}
"""Address and a word that its page must show."""


@pytest.fixture(scope="module")
def office(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    folder = tmp_path_factory.mktemp("office")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        world.start_tower()
        world.start_simulated("Kestrel", options=SIMULATOR)
        world.wait_until_online(world.visitor("admin"), 1)
        yield world


@pytest.fixture
def come(chromium: Browser, office: World) -> Iterator[Somebody]:
    with visitors(chromium, office.address) as somebody:
        yield somebody


def catalogues(console: ConsolePage) -> list[str]:
    """Returns a list that fills with the requests for the Portuguese catalogue."""
    fetched: list[str] = []

    def noted(request: Request) -> None:
        if CATALOGUE.search(request.url):
            fetched.append(request.url)

    console.page.on("request", noted)
    return fetched


def choose(console: ConsolePage, language: str, shown: str = "squad-row") -> None:
    console.part("user-menu").click()
    console.part(f"language-{language}").click()
    expect(console.page.locator(f"html[lang={language}]")).to_have_count(1)
    expect(console.part(shown).first).to_be_visible()


@pytest.mark.long("each text is compared by the console's unit tests")
def test_all_pages_are_in_the_language_that_a_person_chooses(come: Somebody, axe: Axe) -> None:
    admin = come()
    fetched = catalogues(admin)
    admin.sign_in("admin")
    expect(admin.part("squad-row").first).to_be_visible()
    assert fetched == []
    choose(admin, "pt")
    assert fetched
    pictures = os.environ.get("LANGUAGE_PICTURES")
    for address, word in PAGES.items():
        admin.page.goto(admin.page.url.split("/#")[0].rstrip("/") + address)
        expect(admin.page.get_by_text(word).first).to_be_visible()
        if pictures:
            for width in (1440, 1024, 390):
                admin.page.set_viewport_size({"width": width, "height": 900})
                name = address.strip("/#") or "monitor"
                admin.page.screenshot(path=f"{pictures}/{name.replace('/', '-')}-{width}.png")
    axe.look(admin, "administration in Portuguese")

    # It follows the person to another browser, and back to English.
    there = come()
    with there.page.expect_response(lambda one: one.url.endswith("/me/preferences")) as recalled:
        there.sign_in("admin")
    assert recalled.value.json()["console"]["language"] == "pt"
    expect(there.part("squad-row").first).to_be_visible()
    # Storage shows that the page has read the answer.
    there.page.wait_for_function('() => Object.values(localStorage).some((one) => one.includes(\'"language":"pt"\'))')
    there.page.reload()
    expect(there.page.locator("html[lang=pt]")).to_have_count(1)
    expect(there.part("squad-row").first).to_be_visible()
    choose(there, "en")
    expect(there.page.get_by_text("Squad").first).to_be_visible()


def test_a_wrong_field_and_a_weak_password_are_told_in_portuguese(come: Somebody) -> None:
    admin = come()
    admin.sign_in("admin")
    expect(admin.part("squad-row").first).to_be_visible()
    choose(admin, "pt")
    admin.open("/#/drone/1")
    admin.part("open-settings").click()
    admin.part("setting-lost_hold_s").fill("31")
    admin.part("setting-sticks_stale_s").fill("0.1")
    admin.part("settings-save").click()
    expect(admin.part("fault-lost_hold_s")).to_have_text("tem de ser 30 no máximo")
    expect(admin.part("fault-sticks_stale_s")).to_have_text("tem de ser 0,2 no mínimo")
    expect(admin.part("settings-problem")).to_have_text("não é válido: lost_hold_s, sticks_stale_s")

    admin.open("/#/account")
    admin.part("new-password").fill(WEAK)
    expect(admin.part("password-form")).to_contain_text("porque contém letras ou algarismos por ordem")


def test_the_bar_and_the_questions_name_the_drone_in_portuguese(come: Somebody) -> None:
    alice = come()
    alice.sign_in("alice")
    expect(alice.part("squad-row").first).to_be_visible()
    alice.open_drone("Kestrel")
    choose(alice, "pt", "control-acquire")
    alice.part("control-acquire").click()
    expect(alice.part("bar-own")).to_contain_text("Kestrel")
    expect(alice.part("bar-own")).to_contain_text("Os comandos são seus")
    alice.page.keyboard.press("h")
    expect(alice.part("bar-answer")).to_contain_text("Parar")

    # The tower and the agent write in English; the console shows it in Portuguese: how a drone holds, a refusal.
    alice.part("loss-check").locator("summary", has_text="PERIGOSO").click()
    expect(alice.page.get_by_text("Uma paragem não termina por si.").first).to_be_visible()
    there = alice.page.context.new_page()
    there.goto(alice.page.url.split("/#")[0].rstrip("/") + "/#/account")
    for field, words in (("old-password", "not this one"), ("new-password", NEW), ("new-password-again", NEW)):
        there.get_by_test_id(field).fill(words)
    there.get_by_test_id("change-password").click()
    expect(there.get_by_test_id("password-problem")).to_have_text("esta não é a sua palavra-passe")
    there.close()

    # Another language loads the page anew: who has controls is asked first.
    alice.part("user-menu").click()
    alice.part("language-en").click()
    question = alice.page.get_by_role("alertdialog").or_(alice.page.get_by_role("dialog"))
    expect(question).to_contain_text("Kestrel")
    alice.page.keyboard.press("Escape")
    expect(alice.page.locator("html[lang=pt]")).to_have_count(1)
    expect(alice.part("bar-own")).to_contain_text("Kestrel")
