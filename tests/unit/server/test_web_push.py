"""Web push: the encryption by the example of RFC 8291, the token, and what a message says."""

import json

import pytest
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, derive_private_key, generate_private_key
from worlds.push_browser import PushBrowser, from_unpadded, unpadded, vapid_claims

from server.alerts.core.severity import Severity
from server.alerts.io.message import Message
from server.alerts.io.push_encryption import MAX_PLAIN_BYTES, BrowserKeys, encrypt, read_base64url
from server.alerts.io.vapid import VALID_FOR_S, Vapid
from server.alerts.io.web_push import URGENCIES, note_of, topic_of
from server.alerts.store.channels.browsers import read_subscription
from server.alerts.store.channels.refusals import BadAlertChannel
from server.app.alert_parts import push_contact
from server.runtime.settings import Settings

P256DH = "BCVxsr7N_eNgVRqvHtD0zTZsEc6-VV-JvLexhqUzORcxaOzi6-AYWXvTBHm4bjyPjs7Vd8pZGH6SRpkNtoIAiw4"
AUTH = "BTBZMqHH6r4Tts7J_aSIgg"


def private(text: str):
    return derive_private_key(int.from_bytes(from_unpadded(text), "big"), SECP256R1())


def test_the_example_of_rfc_8291() -> None:
    """Section 5 and appendix A: byte by byte."""
    body = encrypt(
        b"When I grow up, I want to be a watermelon",
        BrowserKeys.read(P256DH, AUTH),
        ephemeral=private("yfWPiYE-n46HLnH0KqZOF1fJJU3MYrct3AELtAQ-oRw"),
        salt=from_unpadded("DGv6ra1nlYgDCS1FRnbzlw"),
    )
    assert unpadded(body) == (
        "DGv6ra1nlYgDCS1FRnbzlwAAEABBBP4z9KsN6nGRTbVYI_c7VJSPQTBtkgcy27ml"
        "mlMoZIIgDll6e3vCYLocInmYWAmS6TlzAC8wEqKK6PBru3jl7A_yl95bQpu6cVPT"
        "pK4Mqgkf1CXztLVBSt2Ks3oZwbuwXPXLWyouBWLVWGNWQexSgSxsj_Qulcy4a-fN"
    )
    browser = PushBrowser(private("q1dXpw3UpT5VOmu_cf_v6ih07Aems3njxI-JWgLcM94"), from_unpadded(AUTH))
    assert browser.decrypt(body) == b"When I grow up, I want to be a watermelon"


def test_the_longest_message_fits_into_what_every_push_service_takes() -> None:
    browser = PushBrowser()
    keys = BrowserKeys.read(**browser.keys)
    key = generate_private_key(SECP256R1())
    body = encrypt(b"x" * MAX_PLAIN_BYTES, keys, ephemeral=key, salt=bytes(16))
    assert len(body) == 4096
    assert browser.decrypt(body) == b"x" * MAX_PLAIN_BYTES
    with pytest.raises(ValueError, match="too long"):
        encrypt(b"x" * (MAX_PLAIN_BYTES + 1), keys, ephemeral=key, salt=bytes(16))


def test_keys_survive_being_kept_and_do_not_show() -> None:
    keys = BrowserKeys.read(P256DH, AUTH)
    assert BrowserKeys.from_text(keys.text) == keys
    assert AUTH not in repr(keys)


OFF_THE_CURVE = unpadded(b"\x04" + bytes(64))


@pytest.mark.parametrize(
    ("p256dh", "auth"),
    [
        (P256DH[:-2], AUTH),
        (P256DH, AUTH[:-2]),
        (OFF_THE_CURVE, AUTH),
        ("", AUTH),
        (P256DH, ""),
        ("€" * 87, AUTH),
        (P256DH[:40] + " +/ " + P256DH[44:], AUTH),
        (unpadded(PushBrowser().public[:33]), AUTH),
    ],
    ids=[
        "short key",
        "short secret",
        "off the curve",
        "no key",
        "no secret",
        "no base64",
        "standard base64",
        "half a key",
    ],
)
def test_what_are_no_keys_of_a_browser(p256dh: str, auth: str) -> None:
    with pytest.raises(BadAlertChannel, match="no keys"):
        read_subscription("https://push.example.org/1", p256dh, auth, "Firefox", may_be_private=False)


@pytest.mark.parametrize("endpoint", ["http://push.example.org/", "ftp://x/", "https://u:p@push.example.org/", "push"])
def test_what_is_no_address_of_a_push_service(endpoint: str) -> None:
    with pytest.raises(BadAlertChannel):
        read_subscription(endpoint, P256DH, AUTH, "Firefox", may_be_private=False)


def test_base64url_with_padding_and_without() -> None:
    assert read_base64url("_-8=") == read_base64url("_-8") == b"\xff\xef"


def test_the_token_names_the_origin_and_ends_within_a_day() -> None:
    vapid = Vapid(generate_private_key(SECP256R1()), "mailto:tower@example.org")
    header = vapid.authorization("https://push.example.org:8443/send/secret?x=1", 1_700_000_000)
    claims = vapid_claims(header, vapid.public_key)
    expected = {"aud": "https://push.example.org:8443", "sub": "mailto:tower@example.org"}
    assert claims == expected | {"exp": 1_700_000_000 + VALID_FOR_S}
    assert 0 < VALID_FOR_S <= 86_400
    other = Vapid(generate_private_key(SECP256R1()), "")
    assert "sub" not in vapid_claims(other.authorization("https://push.example.org/", 0), other.public_key)
    with pytest.raises(AssertionError):
        vapid_claims(header.replace(vapid.public_key, other.public_key), other.public_key)


@pytest.mark.parametrize(
    ("settings", "contact"),
    [
        ({"security_contact": "mailto:s@example.org", "mail_from": "t@example.org"}, "mailto:s@example.org"),
        ({"mail_from": "t@example.org", "public_url": "https://tower.example.org"}, "mailto:t@example.org"),
        ({"public_url": "https://tower.example.org"}, "https://tower.example.org"),
        ({"public_url": "http://127.0.0.1:8000"}, ""),
    ],
)
def test_whom_a_push_service_may_ask(settings: dict[str, str], contact: str) -> None:
    assert push_contact(Settings(**settings)) == contact


def message(happening: str = "opened", number: str = "77", words: str = "hawk is lost in the air.") -> Message:
    drone = {"id": 5, "name": "hawk"}
    about = {"id": number, "severity": "critical", "words": words, "happening": happening, "drone": drone}
    return Message(f"{number}-{happening}-1", "hawk: Lost in the air", "", {"type": "alert", **about})


def test_what_a_message_says() -> None:
    assert note_of(message()) == {
        "title": "hawk: Lost in the air",
        "body": "Critical: hawk is lost in the air.",
        "severity": "critical",
        "happening": "opened",
        "tag": "alert-77",
        "path": "#/drone/5",
    }
    test = Message("test-1-1", "A test of your alerts", "", {"type": "test", "words": "This is a test."})
    assert (note_of(test)["happening"], note_of(test)["body"]) == ("test", "This is a test.")


def test_words_of_any_length_fit() -> None:
    worst = Message("k", "\0" * 500, "", dict(message(words="\0" * 9_000).content))
    assert len(json.dumps(note_of(worst), ensure_ascii=False).encode()) <= MAX_PLAIN_BYTES


def test_the_newest_message_about_an_alert_replaces_the_others() -> None:
    topic = topic_of(message())
    assert topic == topic_of(message("closed")) != topic_of(message(number="78"))
    assert len(topic) == 32, "RFC 8030 allows no more"
    assert len(from_unpadded(topic)) == 24


def test_every_severity_has_an_urgency() -> None:
    assert set(URGENCIES) == {severity.value for severity in Severity}
