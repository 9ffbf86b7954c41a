"""Small frames behind the last message of a burst, so that TCP detects its loss within a round trip.

TCP retransmits a lost packet as soon as later ones are acknowledged. No packet follows the last one of a burst: the
sender then waits for its probe timeout, twice the round trip plus 200 ms, or longer (RFC 8985, section 7.2). An order
or an answer on the control channel is such a last packet. An unsolicited WebSocket pong costs some 60 bytes.
"""

from typing import Final

PROBES_AFTER_S: Final = (0.02, 0.03, 0.05)
"""Pauses before each. Three acknowledged packets behind a gap prove a loss without further delay."""
