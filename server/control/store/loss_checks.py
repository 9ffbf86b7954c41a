"""The check before flight: what each drone's parameters would do on a loss, and who has acknowledged it.

Mirrors the table in memory, so that the hub is updated at once when parameters, settings or the holder change. An
acknowledgement belongs to one user and one set of dangers, and lets that user arm.
"""

import hashlib
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from sqlalchemy import select
from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.store.action import AuditAction
from server.control.core.lease import Refused
from server.control.core.loss_check_mark import LossCheckMark
from server.control.core.loss_words import Sentence, findings_hash, is_dangerous, loss_sentences
from server.control.core.simulated import is_simulator
from server.control.store.service import ControlRefused
from server.control.store.settings_store import settings_in
from server.control.store.tables import LossAcknowledgementRow
from server.kernel.access import UnknownDrone
from server.kernel.clock import Clock
from server.kernel.people import Principal
from server.live.hub import Hub
from server.storage.database import Database, DatabaseSession
from wire.control_messages import LossParameters
from wire.ids import DroneId, UserId

_NOT_THE_HOLDER: Final = Refused("not-the-holder", "whoever has the controls, or assists, must acknowledge this")
_WRONG_NAME: Final = Refused(
    "wrong-name", "that is not the name of this drone: name the drone whose dangers you accept"
)


@dataclass(frozen=True)
class LossCheck:
    """The result for one drone and one asking user.

    `acknowledged`: for exactly these dangers, by the asking user if they may arm the drone now, otherwise by its
    holder.
    """

    complete: bool
    has_radio: bool | None
    sentences: tuple[Sentence, ...]
    dangerous: bool
    acknowledged: bool
    simulated: bool


async def read_acknowledged(session: AsyncSession | DatabaseSession, drone_id: DroneId) -> dict[UserId, str]:
    """The hash of the dangers that each user has acknowledged."""
    rows = await session.scalars(select(LossAcknowledgementRow).where(LossAcknowledgementRow.drone_id == drone_id))
    return {UserId(row.user_id): row.findings_hash for row in rows}


async def read_acknowledged_of(
    session: AsyncSession | DatabaseSession, drone_ids: Sequence[DroneId]
) -> dict[DroneId, dict[UserId, str]]:
    """The same for those among several drones that have any."""
    query = select(LossAcknowledgementRow).where(LossAcknowledgementRow.drone_id.in_(drone_ids))
    known: defaultdict[DroneId, dict[UserId, str]] = defaultdict(dict)
    for row in await session.scalars(query):
        known[DroneId(row.drone_id)][UserId(row.user_id)] = row.findings_hash
    return known


class LossChecks:
    """One instance per tower."""

    def __init__(self, *, hub: Hub, database: Database, clock: Clock) -> None:
        self._hub = hub
        self._database = database
        self._clock = clock
        self._acknowledged: defaultdict[DroneId, dict[UserId, str]] = defaultdict(dict)

    async def load(self) -> None:
        """Loads earlier acknowledgements at start."""
        async with self._database.reading() as session:
            for row in await session.scalars(select(LossAcknowledgementRow)):
                self._acknowledged[DroneId(row.drone_id)][UserId(row.user_id)] = row.findings_hash

    async def read_again(self, drone_id: DroneId) -> None:
        """Another process has changed the holder, who may have acknowledged there."""
        async with self._database.reading() as session:
            self.learn(drone_id, await read_acknowledged(session, drone_id))

    def learn(self, drone_id: DroneId, acknowledged: dict[UserId, str]) -> None:
        """What the database has for this drone now."""
        self._acknowledged[drone_id] = dict(acknowledged)
        self.recheck(drone_id)

    def reported(self, drone_id: DroneId, parameters: LossParameters) -> None:
        """The agent has read the parameters; the hub stores them."""
        self.recheck(drone_id)

    def recheck(self, drone_id: DroneId) -> None:
        """Parameters, settings, holder or assistant have changed: updates the hub's block on arming."""
        drone = self._hub.state.drones.get(drone_id)
        if drone is None:
            return  # it was just deleted
        check = self.check(drone_id)
        lease = drone.lease
        read_by = self._read_by(drone_id, check.sentences)
        version = repr((check, lease.holder, lease.assistant, sorted(read_by)))
        mark = LossCheckMark(
            dangerous=check.dangerous, read_by=read_by, version=hashlib.sha256(version.encode()).hexdigest()
        )
        self._hub.changes.set_loss_check(drone_id, mark)

    def check(self, drone_id: DroneId, asker: UserId | None = None) -> LossCheck:
        """Returns the present result. Raises UnknownDrone."""
        drone = self._hub.state.drones.get(drone_id)
        if drone is None:
            raise UnknownDrone
        parameters = drone.loss_parameters
        settings = settings_in(self._hub, drone_id)
        sentences = tuple(loss_sentences(parameters, settings, watched_only=drone.watched_only))
        reader = asker if asker is not None and drone.may_arm(asker) else drone.holder_id
        return LossCheck(
            complete=drone.watched_only or (parameters.complete if parameters else False),  # nothing more is read of it
            has_radio=parameters.has_radio if parameters else None,
            sentences=sentences,
            dangerous=is_dangerous(sentences),
            acknowledged=reader in self._read_by(drone_id, sentences),
            simulated=is_simulator(parameters),
        )

    def _read_by(self, drone_id: DroneId, sentences: tuple[Sentence, ...]) -> frozenset[UserId]:
        now = findings_hash(sentences)
        return frozenset(user_id for user_id, known in self._acknowledged[drone_id].items() if known == now)

    async def acknowledge(
        self, principal: Principal, drone_id: DroneId, *, named: str | None, address: str
    ) -> LossCheck:
        """Records that the user who may arm the drone now acknowledges; with dangers, the user must name the drone.
        Raises ControlRefused for any other user, and for a wrong name."""
        drone = self._hub.squads.drone(drone_id, principal.user_id, principal.role)
        if drone is None:
            raise UnknownDrone
        if not drone.may_arm(principal.user_id):
            raise ControlRefused(_NOT_THE_HOLDER)
        check = self.check(drone_id, principal.user_id)
        if named != drone.record.name and (check.dangerous or named is not None):
            raise ControlRefused(_WRONG_NAME)
        known = findings_hash(check.sentences)
        action = AuditAction(by=principal, at=self._clock(), address=address)
        async with self._database.writing() as session:
            row = LossAcknowledgementRow(
                drone_id=drone_id, user_id=principal.user_id, findings_hash=known, acknowledged_at=action.at
            )
            await session.merge(row)
            dangers = [one.text for one in check.sentences if one.severity == "danger"]
            action.record(session, "drone.loss_check_acknowledged", drone_id=drone_id, dangers=dangers)
        self._acknowledged[drone_id][principal.user_id] = known
        self.recheck(drone_id)
        return self.check(drone_id, principal.user_id)
