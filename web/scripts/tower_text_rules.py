"""What tower_texts.py takes for a text, and which sources never reach the console. Tables only."""

import re
from typing import Final

AREAS: Final = (
    (
        "safety",
        r"onboard_agent/failsafe/|server/(alerts|control|link)/core|server/live/(?!hub)|server/control/store/|"
        r"wire/zones/|server/airspace/core/zones/watch|wire/autopilots/.*_loss",
    ),
    ("flight", r"onboard_agent/|wire/|server/live/|server/(?!maps)\w+/core"),
    ("tower", r""),
)
"""The files of a language, and which sources use their texts. A text is in the first that uses it."""

TEXT_VALUES: Final = frozenset(
    [
        "actions",
        "advice",
        "after",
        "asked",
        "at",
        "away",
        "because",
        "before",
        "begin",
        "between",
        "beyond",
        "black_box_problem",
        "both",
        "by",
        "count",
        "detail",
        "direction",
        "doing",
        "does",
        "error",
        "estimator_fault",
        "event",
        "excepted",
        "far",
        "fence_breach",
        "field",
        "given_up",
        "ground",
        "height",
        "hold_reason",
        "hold_unconfirmed",
        "holds",
        "how",
        "how_many",
        "ignored",
        "in_zone",
        "known",
        "label_of",
        "last",
        "leave",
        "level",
        "limits",
        "lines",
        "lost",
        "meter",
        "modes",
        "needs_none",
        "nobody_because",
        "not_armed",
        "note",
        "on_the_ground",
        "otherwise",
        "outcome",
        "own_action",
        "parts",
        "phase",
        "plan_names",
        "problem",
        "reason",
        "refusal",
        "response",
        "rest",
        "room",
        "said",
        "seen",
        "sensor",
        "soon",
        "stage",
        "state",
        "stays_away",
        "step",
        "the",
        "then",
        "there",
        "throttle_actions",
        "told",
        "unless",
        "unheld_why",
        "up_to",
        "upper",
        "verb",
        "warning",
        "was",
        "what",
        "what_is_left",
        "when",
        "where",
        "which",
        "who",
        "why",
        "why_not",
        "work",
    ]
)
"""Variables, attributes and functions whose values are texts themselves; so is what ends with `words`."""

NOT_SHOWN: Final = re.compile(
    "|".join(
        (
            # Command lines, settings, logs and what an agent says on its own computer.
            r"server/app/",
            r"onboard_agent/(agent|check|cli|command_line|doctor|install|installation|service|settings)\.py",
            r"onboard_agent/(state_directory|systemd|work)\.py",
            r"onboard_agent/(autopilot|autopilot_port|landing|link|sockets|vision|black_box/flight_files)",
            r"onboard_agent/(payload/(payload_port|sensor_lines|servo\.)|telemetry/t|update/(release_keys|launch))",
            r"onboard_agent/autonomy/(camera_settings|setting|describing|loading|scripted|frame_sharing|target_watch|core/payload_release)",
            r"onboard_agent/video/(channel|child|trial|entry|core/units|encoders|sources)",
            r"server/runtime/(settings|listening|vault|tower_condition)",
            r"server/alerts/io/(push_encryption|sending_threads|vapid)",
            r"server/kernel/shares_table|server/towers/(core/tower_lease|io/bus_(certificate|seal))",
            r"server/alerts/io/mail_source|server/airspace/io",
            r"server/storage/(schema|database|tables|folder_id|repeated|bounded)|server/\w+/store/.*tables",
            r"server/(backup/|audit/store|towers/store/([cm]|tower_lock)|fleet/store/tower_identity|operations/store)",
            r"server/accounts/store/(hashing|sealed|passwords\.py)",
            # What crosses the wires, or is read by programs only.
            r"wire/(black_box|content|controllers|credential|drone_key|frames|parameter_metadata|parameters|plans|sealing)",
            r"wire/(sign_in|state_messages|tagged|transport_stream|urgency|video)",
            r"server/(monitoring/|link/api/websocket|audit/api|towers/api/(nats|video)|maps/api/(routes|tile_routes))",
            r"server/video/api/video_answer",
            r"server/http/(console|problem_|general_problems|security|health)|server/(?!http)\w+/(problems|part)\.",
            r"server/link/api/(agent_|connected|link_ticket|tls_)|server/video/api/agent",
            r"server/live/(hub|live_messages)|server/accounts/core/(totp|webauthn)|server/control/core/diagram",
            r"server/airspace/core/(aircraft/feed|separation)|server/alerts/core/(rules_table|finding)",
            r"server/(towers/core/.*messages|video/core/recordings/units|operations/core/person)",
            # Files to be downloaded, and pictures.
            r"server/flights/core/(exports|index|report|track)|server/flights/core/videos/display",
            r"server/flights/store/videos/drawing",
        )
    )
)

NO_TEXTS: Final = re.compile(
    "|".join(
        (
            # Headers, queries, names of sources and of things, mails.
            r"^(private|public), |attachment|charset|^Bearer |^MAV_|^Control Tower$|©|^Esri|^USGS|^U\.S\.|^Powered by",
            r"^Sentinel|^(SELECT|PRAGMA|SET|BEGIN|REPEATABLE) |^\w+ IN \(|xmlns|wants alerts of drones to be sent",
            r"^(A code for alerts of drones|A test of your alerts|Nobody has answered:|This is a test for .*)$",
            r"^(A GeoJSON or KML file.*|A table with a line of names|Begun: with.*|tower-agent|enrol|ControlTower/.*)$",
            # Labels of state machines, tasks and counters, and words of enumerations.
            r"^(count|otherwise|outcome|holder|warning|failed|database-unavailable|refused|unknown|begun|arming|done)$",
            r"^(taken|battery|return-height|failsafes|open|closed|opened|disabled|waiting|making|seen|link|plan)$",
            r"^(logged text|flight gaps|handing over|mode shown|deadline passed|called off|due, .*|too long)$",
            r"^(sticks while disarmed.*|sticks not centred after.*|sticks too late|command too late|param[{]})$",
            r"^((session|browser) [{]}|finishing recordings|web push of the tower|enrolling agent|[{]}-.*)$",
            r"^(alert channel of user.*|(A|The|Seen|Since|Over at) ?[{]}.*UTC|changed meanwhile|removed meanwhile)$",
            r"^settings\.|^(unknown name|(no|wrong) user handle|of another user)$",
            # What MORE has in other words, because a rule takes their parts wrongly.
            r"^([{]} is lent to you|Nothing was sent to [{]}: its way|[{]}[{]}\. Nothing was changed\.)$",
            r"^(No p|P)osition fix[{]}\.$|^[{]} (on a loss|in the check).*|^A (mission|fence) of [{]}.*",
        )
    )
)

MACHINE_CALLS: Final = re.compile(
    r"(^|\.)_?log(ger)?\.|^print$|(^|\.)(compile|execute|text|startswith|endswith|getLogger|Thread|create_task|open|get"
    r"|add_argument|spawn|strftime|split|pack|unpack|Field|Query|Path|Body|Header|Doc|encode|RuntimeError|AssertionError"
    r"|ValueError|TypeError|MalformedMessage|Dropped|fromisoformat|Seal|APIRouter|getattr|Depends|(router|routes)\.\w+"
    r"|Meta|StringConstraints|AfterValidator|seal|unseal|background|remove_prefix|removeprefix|environ)$"
)
"""Calls whose arguments are read by programs, logs or programmers."""

MACHINE_KEYWORDS: Final = frozenset({"when", "name", "key", "summary", "description", "media_type", "headers", "slug"})

MORE: Final[dict[str, tuple[str, ...]]] = {
    "onboard_agent/autonomy/challenge_settings.py": ("Camera",),
    "onboard_agent/failsafe/lost_action_table.py": ("return", "land", "stay"),
    "onboard_agent/transactions/command_handler.py": ("armed", "disarmed", "on the ground"),
    "server/alerts/core/flight_conditions.py": (
        "low",
        "critical",
        ": {percent:number} %",
        "{name} is in {words:text}.",
        "{name} is outside of {words:text}.",
        "{name} is above the {ceiling_m:number} m of the zone {zone}.",
        "{name} is within {near_m:number} m of the edge of {words:text}.",
        "{name} leaves {words:text} in about {s:number} s{far:text}.",
        "{name} reaches {words:text} in about {s:number} s{far:text}.",
        "{name} goes above the {ceiling_m:number} m of the zone {zone} in about {s:number} s{far:text}.",
    ),
    "server/alerts/core/link_conditions.py": ("returns", "lands", "was flown by hand", ": {why:text}"),
    "server/alerts/core/pair_alerts.py": (
        "north",
        "north-east",
        "east",
        "south-east",
        "south",
        "south-west",
        "west",
        "north-west",
        "are",
    ),
    "server/alerts/core/rules.py": ("Failsafe", "Emergency", "Vibration", "Unattended"),
    "server/readiness/core/checks.py": (
        "{number:number} danger",
        "{number:number} dangers",
        "{number:number} warning",
        "{number:number} warnings",
        "{number:number} item",
        "{number:number} items",
        "{number:number} point",
        "{number:number} points",
        "acknowledged",
        "GPS",
        "{count:text} on a loss, {told:text}: read the check before flight.",
        "{count:text} in the check before flight.",
        "A fence of {count:text} is on board.",
        "A mission of {count:text} is on board. Check that it is the one you mean.",
        "No position fix{count:text}.",
        "Position fix{count:text}.",
    ),
    "server/control/core/frame_refusals.py": (
        "{name} is lent to you {words:text}",
        "Nothing was sent to {name}: its way {words:text}",
    ),
    "server/control/core/open_hold.py": ("continue", "none", "altitude", "not known"),
    "server/maps/io/map_files.py": (
        "names a file whose metadata is too large",
        "names a file whose metadata cannot be read",
    ),
    "server/alerts/io/message.py": ("the tower has no mail server",),
    "server/maps/io/tile_source.py": (
        "must be an https:// address, or the path of a .pmtiles file",
        "must not contain spaces, quotes, commas or semicolons",
        "must contain {places} once, like https://tiles.example.org/{z}/{x}/{y}.png",
        "must name one host, without a password and without {s} or * in it",
        "must not contain other places than {z}, {x} and {y}",
        "names a file that is not there",
        "names a file that cannot be read: {strerror}",
        "names a file that is not PMTiles",
        "names a PMTiles file of version {given:number}: only version {known:number} is known",
        "names a PMTiles file whose tiles are neither images nor MVT",
    ),
    "server/control/store/rehearsal.py": ("tower", "person", "operator"),
    "wire/autopilots/ardupilot_loss.py": ("lands", "brakes"),
    "wire/autopilots/px4_loss.py": ("a mission", "a hold"),
    "wire/zones/zone.py": (
        "the no-fly zone {name}",
        "the corridor {name}",
        "the zone with at most {ceiling_m:number} m, {name}",
    ),
}
"""Texts that no rule finds, by their source."""
