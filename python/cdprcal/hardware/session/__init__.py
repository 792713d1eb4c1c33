"""The session file: which device is which cable, signs, scales, limits and rates of one robot."""

from cdprcal.hardware.session.file import (
    SCHEMA_FILE,
    example_text,
    load_session,
    load_topics,
    parse_session,
    schema_text,
)
from cdprcal.hardware.session.model import (
    Ahrs,
    CanopenBus,
    EthercatBus,
    Limits,
    LoadCell,
    Ros2,
    Safety,
    Session,
    Swivel,
    TopicMap,
    Torque,
    Winch,
)

__all__ = [
    "SCHEMA_FILE",
    "Ahrs",
    "CanopenBus",
    "EthercatBus",
    "Limits",
    "LoadCell",
    "Ros2",
    "Safety",
    "Session",
    "Swivel",
    "TopicMap",
    "Torque",
    "Winch",
    "example_text",
    "load_session",
    "load_topics",
    "parse_session",
    "schema_text",
]
