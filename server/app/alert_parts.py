"""Assembles what delivers alerts outside of the console."""

from __future__ import annotations

import time

from server.alerts.core.announcer import Announcer
from server.alerts.io.mail import send_mail
from server.alerts.io.message import Message, NotSent
from server.alerts.io.push_encryption import BrowserKeys
from server.alerts.io.web_push import push
from server.alerts.io.webhook import call_webhook
from server.alerts.store.channels.deliverer import AlertDeliverer
from server.alerts.store.channels.push_key import PushKey
from server.kernel.clock import Clock
from server.live.hub import Hub
from server.runtime.settings import Settings
from server.runtime.vault import Vault
from server.storage.database import Database


def new_alert_deliverer(
    settings: Settings, hub: Hub, database: Database, vault: Vault, clock: Clock
) -> tuple[Announcer, AlertDeliverer]:
    announcer = Announcer(hub.state, unanswered_after_s=settings.alert_unanswered_s)
    hub.alerts.listeners.append(announcer.changed)
    hub.alerts.on_handed_over = announcer.forget

    push_key = PushKey(push_contact(settings))

    def send(kind: str, target: str, secret: str, message: Message) -> None:
        now_s, may_be_private = int(time.time()), settings.webhooks_may_be_private
        if kind == "webhook":
            call_webhook(target, secret, message, now_s, may_be_private=may_be_private)
        elif kind == "push":
            keys = BrowserKeys.from_text(secret)
            push(target, keys, message, push_key.vapid, now_s, may_be_private=may_be_private)
        elif settings.mail_server.host:
            send_mail(settings.mail_server, target, message)
        else:
            raise NotSent("the tower has no mail server")

    return announcer, AlertDeliverer(
        hub,
        announcer,
        database=database,
        vault=vault,
        clock=clock,
        send=send,
        push_key=push_key,
        public_url=settings.public_url,
    )


def push_contact(settings: Settings) -> str:
    """Whom a push service may ask about this tower: the contact for security, the sender of mail, or its address."""
    if settings.security_contact:
        return settings.security_contact
    if settings.mail_from:
        return f"mailto:{settings.mail_from}"
    return settings.public_url if settings.public_url.startswith("https://") else ""
