"""Which parameters an autopilot needs so that a failure of the computer on board brings the drone home. Pure.

Without a receiver the end of the agent's sticks is a radio failsafe: these make it come home out of a mode that needs
sticks, and go on in one that needs none. With a receiver the transmitter's sticks come back, whoever holds it: these
make it come home instead.
"""

from dataclasses import dataclass
from math import isfinite

from wire.autopilots import registry
from wire.autopilots.profile import AutopilotFamily
from wire.autopilots.wanted_parameter import WantedParameter
from wire.control_messages import LossParameters


@dataclass(frozen=True)
class SetupRow:
    """One parameter. `now` None: not read; `wanted` is then the minimum."""

    name: str
    now: float | None
    wanted: float
    why: str

    @property
    def ok(self) -> bool:
        return self.now == self.wanted


@dataclass(frozen=True)
class ReceiverSetup:
    """The setup of one drone. `autopilot`: the name of a family of profiles, or empty for another."""

    autopilot: str
    has_radio: bool | None
    rows: tuple[SetupRow, ...]

    @property
    def known(self) -> bool:
        """Whether each of them was read."""
        return bool(self.rows) and all(row.now is not None for row in self.rows)

    @property
    def needed(self) -> bool:
        """Whether it is known to fly with or without a receiver, and is not set up for that."""
        return self.has_radio is not None and any(not row.ok for row in self.rows)

    @property
    def to_write(self) -> dict[str, float]:
        """By name, what is not as it should be."""
        return {row.name: row.wanted for row in self.rows if not row.ok}

    @property
    def text(self) -> str:
        """For people, in a sentence or two."""
        if not self.rows:
            known = " and ".join(one.label for one in registry.FAMILIES.values() if self._wanted_of(one))
            return f"This set-up exists for {known} only. The autopilot is not known to be one of them."
        if self.has_radio is None:
            return "It is not known whether a radio receiver is on board."
        return self._text_with_receiver() if self.has_radio else self._text_without_receiver()

    def _text_with_receiver(self) -> str:
        if not self.known:
            return "There is a radio receiver, and not all relevant parameters are known yet."
        if self.needed:
            return "There is a radio receiver, and the autopilot is not set up for a failure of the computer on board."
        return "There is a radio receiver, and the autopilot is set up for a failure of the computer on board."

    def _text_without_receiver(self) -> str:
        if not self.known:
            return "There is no radio receiver, and not all relevant parameters are known yet."
        if self.needed:
            return "There is no radio receiver, and the autopilot is not set up to fly without one."
        return "There is no radio receiver, and the autopilot is set up to fly without one."

    def _wanted_of(self, family: AutopilotFamily) -> tuple[WantedParameter, ...]:
        return family.with_receiver if self.has_radio else family.without_receiver


def receiver_setup(parameters: LossParameters | None) -> ReceiverSetup:
    """`parameters`: None until the agent has reported them."""
    if parameters is None:
        return ReceiverSetup("", None, ())
    family = registry.family_named(parameters.autopilot)
    wanted = () if family is None else family.with_receiver if parameters.has_radio else family.without_receiver
    rows = tuple(_row(one, parameters.values.get(one.name)) for one in wanted)
    return ReceiverSetup(parameters.autopilot, parameters.has_radio, rows)


def _row(one: WantedParameter, now: float | None) -> SetupRow:
    known = now if now is not None and isfinite(now) else None
    return SetupRow(one.name, known, one.value(known if known is not None else 0.0), one.why)
