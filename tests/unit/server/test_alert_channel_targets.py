"""Addresses of alert channels, the signature of a webhook, and the setting of the mail server."""

import pytest

from server.alerts.core.severity import Severity
from server.alerts.io.mail import MailServer
from server.alerts.io.mail_source import read_mail_address, read_mail_server
from server.alerts.io.webhook import signature
from server.alerts.store.channels.channels import ChannelWish, Kind, check_target
from server.alerts.store.channels.refusals import BadAlertChannel
from server.runtime.settings import SettingsError, read_settings


def check(kind: Kind, target: str, *, may_be_private: bool = False) -> None:
    check_target(ChannelWish(kind, target, Severity.WARNING, "all"), may_be_private=may_be_private)


@pytest.mark.parametrize("target", ["anna@example.org", "a.b+c@mail.example.co"])
def test_addresses_of_mail(target: str) -> None:
    check("mail", target)


@pytest.mark.parametrize(
    "target",
    [
        "anna",
        "anna@",
        "@example.org",
        "a@b",
        "a b@example.org",
        "a@example.org\nBcc: x@y.org",
        "<a@example.org>",
        "ä@e.org",
    ],
)
def test_what_is_no_address_of_mail(target: str) -> None:
    with pytest.raises(BadAlertChannel):
        check("mail", target)


@pytest.mark.parametrize("target", ["https://example.org", "https://example.org:8443/hooks/1?key=2"])
def test_addresses_of_webhooks(target: str) -> None:
    check("webhook", target)


@pytest.mark.parametrize(
    "target",
    [
        "example.org",
        "http://example.org/",
        "ftp://example.org/",
        "https://",
        "https://user:secret@example.org/",
        "https://example.org/#part",
        "https://example.org:99999/",
        "https://example.org:0/",
        "https://exam ple.org/",
        "https://example.org/\r\nX: y",
        "https://[::1",
    ],
)
def test_what_is_no_address_of_a_webhook(target: str) -> None:
    with pytest.raises(BadAlertChannel):
        check("webhook", target)


def test_without_tls_only_where_the_admin_allows_it() -> None:
    check("webhook", "http://127.0.0.1:8080/hook", may_be_private=True)


def test_the_signature_covers_time_and_body() -> None:
    # printf '1700000000.{"a": 1}' | openssl dgst -sha256 -hmac secret
    signed = signature("secret", 1_700_000_000, b'{"a": 1}')
    assert signed.startswith("v1=")
    assert len(signed) == 67
    assert signed != signature("secret", 1_700_000_001, b'{"a": 1}')
    assert signed != signature("secret", 1_700_000_000, b'{"a": 2}')
    assert signed != signature("other", 1_700_000_000, b'{"a": 1}')


@pytest.mark.parametrize(
    ("text", "server"),
    [
        ("smtp://mail.example.org", MailServer("mail.example.org", 587, "starttls")),
        (
            "smtps://tower%40example.org@mail.example.org",
            MailServer("mail.example.org", 465, "tls", "tower@example.org"),
        ),
        ("smtp+plain://127.0.0.1:2525", MailServer("127.0.0.1", 2525, "none")),
    ],
)
def test_the_mail_server(text: str, server: MailServer) -> None:
    assert read_mail_server(text) == server


@pytest.mark.parametrize(
    "text", ["mail.example.org", "http://mail.example.org", "smtp://", "smtp://u:p@host", "smtp://h/x"]
)
def test_what_is_no_mail_server(text: str) -> None:
    with pytest.raises(ValueError, match="must"):
        read_mail_server(text)


def test_a_mail_server_needs_a_sender() -> None:
    assert read_mail_address("tower@example.org") == "tower@example.org"
    for text in ("tower", "@example.org", "a@b@c"):
        with pytest.raises(ValueError, match="must be an e-mail address"):
            read_mail_address(text)
    with pytest.raises(SettingsError, match="TOWER_MAIL_FROM is needed with TOWER_MAIL_SERVER"):
        read_settings({"TOWER_MAIL_SERVER": "smtp://mail.example.org"})
    environment = {
        "TOWER_MAIL_SERVER": "smtp://me@mail.example.org",
        "TOWER_MAIL_FROM": "tower@example.org",
        "TOWER_MAIL_PASSWORD": "very secret",
    }
    settings = read_settings(environment)
    assert settings.mail_server.password == "very secret"
    assert "very secret" not in repr(settings)
    assert "very secret" not in repr(settings.mail_server)
