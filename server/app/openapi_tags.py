"""The groups of routes in the OpenAPI document, in its order."""

from typing import Final

TAGS: Final = (
    {"name": "session", "description": "Signing in and out."},
    {"name": "tokens", "description": "API tokens: how a program signs in for a user."},
    {"name": "drones", "description": "The squad, and its administration."},
    {"name": "teams", "description": "People and drones that belong together."},
    {"name": "enrolment", "description": "How the agent of a drone makes its key known."},
    {"name": "control", "description": "Who has the controls of a drone."},
    {"name": "preflight", "description": "The checklist before a flight."},
    {"name": "plans", "description": "Missions, fences and rally points on board of a drone."},
    {"name": "parameters", "description": "The parameters of a drone's autopilot."},
    {"name": "commands", "description": "What a drone is told to do."},
    {"name": "logs", "description": "Flight logs, on board and fetched."},
    {"name": "video", "description": "How it is with the video of a drone."},
    {"name": "recordings", "description": "Recorded video."},
    {"name": "flights", "description": "Flights that the tower recorded."},
    {"name": "maintenance", "description": "What a drone needs after so many hours in the air."},
    {"name": "missions", "description": "The library of missions."},
    {"name": "operations", "description": "Work at drones that is going on."},
    {"name": "zones", "description": "Where drones may not be, not above a height, or only."},
    {"name": "alerts", "description": "What needs attention at a drone."},
    {"name": "map", "description": "The tiles of the map."},
    {"name": "users", "description": "Users administration, for admins."},
    {"name": "audit", "description": "Who did what, for admins."},
    {"name": "metrics", "description": "What the tower counts, for Prometheus."},
    {"name": "system", "description": "How the tower itself is, for admins."},
    {"name": "health", "description": "Whether the tower is well."},
)
