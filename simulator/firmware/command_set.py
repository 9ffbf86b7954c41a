"""What the shells of the flight controller share: a table of commands, and one line of words in, text out.

Needs neither NumPy nor a vehicle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from simulator.firmware.states import SystemState

S = TypeVar("S")

MAX_DISPLAY_LINES = 100
MAX_LINE = 200
"""Of input; a longer one is refused."""


class ShellRefused(ValueError):
    """The command is not carried out; the text says why."""


@dataclass(frozen=True, slots=True)
class ShellCommand(Generic[S]):
    run: Callable[[S, list[str]], str]
    help: str
    safe_only: bool = False
    """Would change the machine under way: active in SYS_SAFE only."""


def carry_out(shell: S, commands: Mapping[str, ShellCommand[S]], state: SystemState, line: str) -> str:
    """Returns the answer. Raises ShellRefused."""
    words = line.split()
    if len(line) > MAX_LINE:
        raise ShellRefused("too long")
    if not words:
        return ""
    command = commands.get(words[0])
    if command is None:
        raise ShellRefused(f"no command {words[0]!r}; try help")
    if command.safe_only and state is not SystemState.SAFE:
        raise ShellRefused(f"in {SystemState.SAFE} only; this is {state}")
    return command.run(shell, words[1:])


def help_of(commands: Mapping[str, ShellCommand[S]]) -> str:
    return "\n".join(f"{name:10} {command.help}" for name, command in commands.items())


def whole(word: str, low: int, high: int) -> int:
    """Raises ShellRefused."""
    if not word.isascii() or not word.isdigit() or not low <= int(word) <= high:
        raise ShellRefused(f"a number from {low} to {high}")
    return int(word)
