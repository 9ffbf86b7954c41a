"""One sentence of the loss check: about what, how bad, and the words."""

from dataclasses import dataclass
from typing import Literal

About = Literal["operator", "tower", "radio"]
Severity = Literal["info", "warning", "danger"]


@dataclass(frozen=True)
class Sentence:
    """`danger`: the drone could be dropped or lost."""

    about: About
    severity: Severity
    text: str


def info(about: About, text: str) -> Sentence:
    return Sentence(about, "info", text)


def warning(about: About, text: str) -> Sentence:
    return Sentence(about, "warning", text)


def danger(about: About, text: str) -> Sentence:
    return Sentence(about, "danger", text)
