"""Passkeys in Chromium with its virtual authenticator: added, used to sign in and beside a password, removed."""

import re
from collections.abc import Iterator

import pytest
from axe_look import Axe
from console_page import ConsolePage, Somebody, visitors
from playwright.sync_api import Browser, CDPSession, expect
from worlds.processes import World

DEVICE = {
    "protocol": "ctap2",
    "transport": "internal",
    "hasResidentKey": True,
    "hasUserVerification": True,
    "isUserVerified": True,
    "automaticPresenceSimulation": True,
}


class Device:
    """The authenticator of one browser."""

    def __init__(self, console: ConsolePage) -> None:
        self._debugger: CDPSession = console.page.context.new_cdp_session(console.page)
        self._debugger.send("WebAuthn.enable")
        made = self._debugger.send("WebAuthn.addVirtualAuthenticator", {"options": DEVICE})
        self._id: str = made["authenticatorId"]

    def passkeys(self) -> list[dict[str, object]]:
        reported = self._debugger.send("WebAuthn.getCredentials", {"authenticatorId": self._id})
        credentials: list[dict[str, object]] = reported["credentials"]
        return credentials

    def is_touched(self, does: bool) -> None:
        """Sets whether the user touches it, or picks a passkey, whenever it asks."""
        self._debugger.send("WebAuthn.setAutomaticPresenceSimulation", {"authenticatorId": self._id, "enabled": does})

    def verifies(self, does: bool) -> None:
        """Sets whether user verification succeeds from now on."""
        self._debugger.send("WebAuthn.setUserVerified", {"authenticatorId": self._id, "isUserVerified": does})


@pytest.fixture
def somebody_here(chromium: Browser, quiet_world: World) -> Iterator[Somebody]:
    """Uses localhost, because passkeys require a host name."""
    with visitors(chromium, quiet_world.address.replace("127.0.0.1", "localhost")) as come:
        yield come


def before_sign_in(come: Somebody) -> ConsolePage:
    """Prevents the page from listing passkeys: a device that is touched whenever it asks would pick one at once."""
    console = come()
    console.page.add_init_script("PublicKeyCredential.isConditionalMediationAvailable = async () => false")
    console.page.reload()
    return console


def is_open(console: ConsolePage) -> None:
    expect(console.part("connection-state")).to_have_attribute("data-value", "open")


def sign_out(console: ConsolePage) -> None:
    console.part("user-menu").click()
    console.part("sign-out").click()
    expect(console.part("sign-in-name")).to_be_visible()


def test_a_passkey_from_its_first_day_to_its_last(somebody_here: Somebody, axe: Axe) -> None:
    console = before_sign_in(somebody_here)
    device = Device(console)
    axe.look(console, "sign-in-with-passkeys")
    console.sign_in("alice")
    is_open(console)

    console.open("/#/account/passkeys")
    expect(console.part("passkeys")).to_contain_text("You have no passkey")
    axe.look(console, "account-no-passkeys")
    console.part("new-passkey").click()
    axe.look(console, "account-new-passkey")
    console.part("passkey-name").fill("Test telephone")
    console.page.keyboard.press("Enter")
    expect(console.part("passkey-row")).to_contain_text("Test telephone")
    assert len(device.passkeys()) == 1
    assert device.passkeys()[0]["isResidentCredential"] is True
    codes = console.part("recovery-code-list").inner_text().split()
    assert len(codes) == 10
    axe.look(console, "account-passkeys")

    # The same device makes no second passkey for the same account.
    console.part("new-passkey").click()
    console.part("passkey-save").click()
    expect(console.part("passkey-problem")).to_contain_text("has a passkey for this account already")
    console.page.keyboard.press("Escape")
    console.part("rename-passkey").click()
    console.part("passkey-name").fill("Red telephone")
    console.part("passkey-save").click()
    expect(console.part("passkey-row")).to_contain_text("Red telephone")

    # Without a name and password.
    sign_out(console)
    console.part("sign-in-passkey").focus()
    console.page.keyboard.press("Enter")
    is_open(console)
    expect(console.part("user-menu")).to_contain_text("alice")

    # User verification fails.
    sign_out(console)
    device.verifies(False)
    console.part("sign-in-passkey").click()
    expect(console.part("sign-in-problem")).to_contain_text("No passkey was used")
    device.verifies(True)

    # Beside the password it is the second factor, and a recovery code replaces it.
    console.sign_in("alice")
    expect(console.part("sign-in-passkey-second")).to_be_focused()
    axe.look(console, "sign-in-passkey-second")
    console.page.keyboard.press("Enter")
    is_open(console)
    sign_out(console)
    console.sign_in("alice")
    console.part("sign-in-code").fill(codes[0])
    console.part("sign-in-button").click()
    is_open(console)

    # A second device. From then on the first browser has to prove its user again, with its passkey.
    there = before_sign_in(somebody_here)
    Device(there)
    there.sign_in("alice")
    there.part("sign-in-code").fill(codes[1])
    there.part("sign-in-button").click()
    is_open(there)
    there.open("/#/account/passkeys")
    there.part("new-passkey").click()
    there.part("passkey-name").fill("Laptop")
    there.part("passkey-save").click()
    expect(there.part("passkey-row")).to_have_count(2)
    console.open("/#/account/passkeys")
    console.page.reload()  # it was there already and lists what it has read
    expect(console.part("passkey-row")).to_have_count(2)
    console.part("remove-passkey").first.click()
    console.part("confirm-button").click()
    expect(console.part("proof-dialog")).to_be_visible()
    axe.look(console, "proof-by-passkey")
    console.part("proof-passkey").click()
    expect(console.part("passkey-row")).to_have_count(1)
    expect(console.part("passkey-row")).to_contain_text("Laptop")

    there.page.reload()
    there.part("remove-passkey").click()
    expect(there.page.get_by_role("dialog")).to_contain_text("your only passkey")
    there.part("confirm-button").click()
    expect(there.part("passkeys")).to_contain_text("You have no passkey")
    sign_out(console)
    console.part("sign-in-passkey").click()
    expect(console.part("sign-in-problem")).to_have_text(re.compile("was not accepted"))
    console.sign_in("alice")
    is_open(console)


def test_a_passkey_is_picked_where_the_name_is_typed(somebody_here: Somebody) -> None:
    console = somebody_here()
    device = Device(console)
    console.sign_in("bob")
    is_open(console)
    console.open("/#/account/passkeys")
    console.part("new-passkey").click()
    console.part("passkey-save").click()
    expect(console.part("passkey-row")).to_have_count(1)
    device.is_touched(False)
    sign_out(console)
    expect(console.part("sign-in-name")).to_have_attribute("autocomplete", "username webauthn")
    device.is_touched(True)
    console.page.reload()  # the page lists the passkeys, and the device's owner picks one
    is_open(console)
    expect(console.part("user-menu")).to_contain_text("bob")


def test_where_the_address_is_no_name_no_passkey_is_offered(somebody_early: Somebody) -> None:
    console = somebody_early()
    expect(console.part("sign-in-button")).to_be_visible()
    expect(console.part("sign-in-passkey")).to_have_count(0)
    console.sign_in("alice")
    is_open(console)
    console.open("/#/account/passkeys")
    expect(console.part("no-passkeys-here")).to_be_visible()
    expect(console.part("new-passkey")).to_be_disabled()
