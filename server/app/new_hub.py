"""Makes the hub with the bounds that the settings give."""

from server.airspace.core.separation.bounds import SeparationBounds
from server.kernel.clock import Clock
from server.kernel.shares import Shares
from server.link.core.flood_gate import FloodLimits
from server.link.core.socket_bounds import SocketBounds
from server.live.hub import Hub
from server.runtime.settings import Settings


def new_hub(settings: Settings, clock: Clock) -> Hub:
    return Hub(
        FloodLimits(
            user_per_s=settings.user_frames_per_s,
            user_burst=settings.user_frames_burst,
            drone_per_s=settings.drone_frames_per_s,
            drone_burst=settings.drone_frames_burst,
            agent_per_s=settings.agent_frames_per_s,
            agent_burst=settings.agent_frames_burst,
        ),
        SocketBounds(per_user=settings.user_sockets, per_address=settings.address_sockets),
        clock,
        SeparationBounds(
            horizontal_m=settings.separation_horizontal_m,
            vertical_m=settings.separation_vertical_m,
            ahead_s=settings.separation_ahead_s,
        ),
        SocketBounds(per_user=settings.user_video_sockets, per_address=settings.address_video_sockets),
        settings.height_limit_m,
        Shares(dict(settings.shares)),
    )
