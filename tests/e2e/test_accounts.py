"""A user's own account in the browser: sign-in, the first password, a second factor, tokens, sessions."""

import json
import re
import time

import pyotp
from console_page import ConsolePage, Somebody, signed_in
from playwright.sync_api import Route, expect
from worlds.processes import PASSWORD, World

NEW_PASSWORD = "four words are longer"


def choose_password(console: ConsolePage, old: str, new: str) -> None:
    console.part("old-password").fill(old)
    console.part("new-password").fill(new)
    console.part("new-password-again").fill(new)
    console.part("change-password").click()


def test_a_wrong_password_does_not_say_which_part_was_wrong(somebody_early: Somebody) -> None:
    console = somebody_early()
    problem = console.part("sign-in-problem")
    console.sign_in("alice", "not the password")
    expect(problem).to_contain_text("wrong")
    known_name = problem.inner_text()
    console.page.reload()
    expect(problem).to_have_text("")
    console.sign_in("nobody of that name")
    expect(problem).to_have_text(known_name)


def test_who_tries_too_often_is_told_how_long_to_wait(somebody_early: Somebody) -> None:
    console = somebody_early()
    button = console.part("sign-in-button")

    def is_throttled() -> bool:
        if button.is_enabled():
            console.sign_in("bob", "not the password")
            expect(button).not_to_have_text("Signing in…")
        return button.is_disabled()

    console.wait("the throttle", is_throttled)
    expect(button).to_have_text(re.compile(r"Try again in \d+ (s|min)"))


def test_a_first_password_has_to_be_changed_before_anything_else(somebody_early: Somebody, quiet_world: World) -> None:
    admin = quiet_world.visitor("admin")
    made = admin.ask("POST", "/users", {"name": "carol", "password": "a first password", "role": "operator"})
    assert made.status == 201, made.body
    console = somebody_early()
    console.sign_in("carol", "a first password")
    expect(console.part("first-password")).to_contain_text("carol")

    console.open("/#/admin/users")
    console.page.reload()
    expect(console.part("first-password")).to_be_visible()

    console.part("new-password").fill("short")
    expect(console.part("password-form")).to_contain_text("Too short: 7 more.")
    expect(console.part("change-password")).to_be_disabled()
    console.part("new-password").fill("password1234")
    expect(console.part("password-form")).to_contain_text("easy to guess")
    expect(console.part("change-password")).to_be_disabled()
    choose_password(console, "not the first one", NEW_PASSWORD)
    expect(console.part("password-problem")).to_be_visible()
    choose_password(console, "a first password", NEW_PASSWORD)

    expect(console.part("connection-state")).to_have_attribute("data-value", "open")
    expect(console.part("first-password")).to_have_count(0)
    again = somebody_early()
    again.sign_in("carol", NEW_PASSWORD)
    expect(again.part("connection-state")).to_have_attribute("data-value", "open")


def test_a_second_factor_is_set_up_and_asked_for(somebody_early: Somebody) -> None:
    console = signed_in(somebody_early, "alice")
    console.open("/#/account/second-factor")
    expect(console.part("second-factor-state")).to_have_attribute("data-value", "off")
    console.part("begin-factor").click()
    secret = console.part("factor-secret").inner_text()
    picture = console.page.get_by_alt_text("QR code of the secret below")
    assert picture.evaluate("image => image.complete && image.naturalWidth > 0"), "the QR code is not drawn"
    code = pyotp.TOTP(secret).now()
    console.part("factor-code").fill("000000" if code != "000000" else "111111")
    console.part("factor-submit").click()
    expect(console.part("factor-problem")).to_be_visible()
    console.part("factor-code").fill(pyotp.TOTP(secret).now())
    console.part("factor-submit").click()
    expect(console.part("second-factor-state")).to_have_attribute("data-value", "on")
    recovery_codes = console.part("recovery-code-list").inner_text().split()
    assert len(recovery_codes) == 10

    by_code = somebody_early()
    by_code.sign_in("alice")
    # The current code was used to confirm; the tower already accepts the next one.
    next_code = pyotp.TOTP(secret).at(int(time.time()) + 30)
    by_code.part("sign-in-code").fill(next_code)
    by_code.part("sign-in-button").click()
    expect(by_code.part("connection-state")).to_have_attribute("data-value", "open")

    by_recovery = somebody_early()
    by_recovery.sign_in("alice")
    by_recovery.part("sign-in-code").fill("nonsense")
    by_recovery.part("sign-in-button").click()
    expect(by_recovery.part("sign-in-problem")).to_contain_text("wrong")
    by_recovery.part("sign-in-code").fill(recovery_codes[0])
    by_recovery.part("sign-in-button").click()
    expect(by_recovery.part("connection-state")).to_have_attribute("data-value", "open")


def test_an_old_proof_is_asked_for_again_and_the_request_goes_on(somebody_early: Somebody) -> None:
    """The response for an expired proof is a fake; the page's next requests are real."""
    console = signed_in(somebody_early, "bob")
    console.open("/#/account/tokens")
    console.part("new-token").click()
    console.part("token-name").fill("with a proof")
    problem = {"type": "/problems/proof-needed", "title": "Confirm that it is you", "status": 403}
    pattern = "**/api/v1/tokens"

    def make_it_old() -> None:
        def too_old(route: Route) -> None:
            if route.request.method == "POST":
                route.fulfill(status=403, content_type="application/problem+json", body=json.dumps(problem))
            else:
                route.continue_()

        console.page.unroute(pattern)
        console.page.route(pattern, too_old)

    make_it_old()
    console.part("token-make").click()
    console.part("proof-close").click()
    expect(console.part("token-problem")).to_be_visible()

    console.part("token-make").click()
    expect(console.part("proof-submit")).to_be_disabled()
    console.part("proof-password").fill("not the password")
    console.part("proof-submit").click()
    expect(console.part("proof-problem")).to_contain_text("not your password")
    console.page.unroute(pattern)
    console.part("proof-password").fill(PASSWORD)
    console.part("proof-submit").click()
    expect(console.part("proof-dialog")).to_have_count(0)
    expect(console.part("token-secret")).to_contain_text("twt_")
    console.part("token-close").click()
    expect(console.part("token-row")).to_have_count(1)


def test_a_session_ended_elsewhere_is_over_at_once(somebody_early: Somebody) -> None:
    here, there = signed_in(somebody_early, "alice"), signed_in(somebody_early, "alice")
    here.open("/#/account/sessions")
    expect(here.part("session-row")).to_have_count(2)
    here.part("end-session").click()
    here.part("confirm-button").click()
    expect(there.part("sign-in-name")).to_be_visible()
    expect(here.part("session-row")).to_have_count(1)


def test_a_token_is_shown_once_and_works(somebody_early: Somebody, quiet_world: World) -> None:
    console = signed_in(somebody_early, "alice")
    console.open("/#/account/tokens")
    console.part("new-token").click()
    expect(console.part("scope-admin")).to_have_count(0)
    console.part("token-name").fill("QGroundControl")
    console.part("scope-fly").check()
    console.part("token-make").click()
    secret = console.part("token-secret").inner_text()
    console.part("token-close").click()
    expect(console.part("token-row")).to_contain_text("QGroundControl")
    assert secret not in console.page.content()

    def asked() -> int:
        answer = console.page.context.request.get(
            quiet_world.address + "/api/v1/drones", headers={"Authorization": f"Bearer {secret}"}
        )
        return answer.status

    assert asked() == 200
    console.part("revoke-token").click()
    console.part("confirm-button").click()
    expect(console.part("token-row")).to_have_count(0)
    assert asked() == 401
