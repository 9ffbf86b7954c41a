"""Sends one e-mail by SMTP. Blocks."""

from __future__ import annotations

import smtplib
import ssl
from contextlib import suppress
from dataclasses import dataclass
from email.message import EmailMessage
from email.utils import formatdate
from typing import Final, Literal

from server.alerts.io.message import Message, NotSent

WITHIN_S: Final = 10.0
"""For each answer of the mail server."""


@dataclass(frozen=True, slots=True)
class MailServer:
    """`host` empty: the tower sends no mail. `security`: TLS from the beginning, after STARTTLS, or none."""

    host: str = ""
    port: int = 587
    security: Literal["starttls", "tls", "none"] = "starttls"
    user: str = ""
    password: str = ""
    sender: str = ""

    def __repr__(self) -> str:
        return f"MailServer({self.host}:{self.port})"


def send_mail(server: MailServer, address: str, message: Message) -> None:
    """Raises NotSent."""
    mail = EmailMessage()
    mail["From"], mail["To"], mail["Subject"] = server.sender, address, message.subject
    mail["Date"] = formatdate()
    mail["Message-ID"] = f"<{message.key}@{server.sender.rpartition('@')[2]}>"
    mail["Auto-Submitted"] = "auto-generated"
    mail.set_content(message.text)
    try:
        connection = _connected(server)
        try:
            if server.user:
                connection.login(server.user, server.password)
            connection.send_message(mail)
        finally:
            # The mail server has the mail by now, or has refused it. A goodbye that fails must not send it again.
            with suppress(OSError, smtplib.SMTPException):
                connection.quit()
            connection.close()
    except smtplib.SMTPAuthenticationError:
        raise NotSent("the mail server does not accept the tower's password") from None
    except smtplib.SMTPRecipientsRefused:
        raise NotSent("the mail server does not accept the address") from None
    except smtplib.SMTPResponseException as error:
        raise NotSent(f"the mail server answers {error.smtp_code}") from None
    except (OSError, smtplib.SMTPException) as error:
        raise NotSent(f"the mail server cannot be reached ({type(error).__name__})") from None


def _connected(server: MailServer) -> smtplib.SMTP:
    if server.security == "tls":
        context = ssl.create_default_context()
        return smtplib.SMTP_SSL(server.host, server.port, timeout=WITHIN_S, context=context)
    connection = smtplib.SMTP(server.host, server.port, timeout=WITHIN_S)
    try:
        if server.security == "starttls":
            connection.starttls(context=ssl.create_default_context())
    except BaseException:
        connection.close()
        raise
    return connection
