"""Every table of the tower, for whoever needs the whole picture: migrations and the start-up check."""

from typing import Final

from server.accounts import tables as accounts
from server.audit import tables as audit
from server.control import tables as control
from server.database import Base
from server.fleet import tables as fleet
from server.missions import tables as missions
from server.recordings import tables as recordings
from server.teams import tables as teams

ALL: Final = (accounts, audit, control, fleet, missions, recordings, teams)
METADATA: Final = Base.metadata
