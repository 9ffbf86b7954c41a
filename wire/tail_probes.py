"""Small frames behind the last message of a burst, so that TCP notices its loss within a round trip.

TCP resends a lost packet as soon as later ones are acknowledged. Behind the last packet of a burst comes none: the
sender then waits for its probe time-out, twice the round trip and 200 ms, or longer (RFC 8985, section 7.2). An order
or an answer on the control channel is such a last packet. An unsolicited WebSocket pong costs some 60 bytes.
"""

from typing import Final

PROBES_AFTER_S: Final = (0.02, 0.03, 0.05)
"""Pauses before each. Three acknowledged packets behind a gap prove a loss without any further wait."""
