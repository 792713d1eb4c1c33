"""Libraries that few need: which extra has them, said before any work is done."""

from __future__ import annotations

from importlib.util import find_spec

from cdprcal._core import InputError

#: Module → extra of the package, and what it is for.
EXTRAS = {
    "matplotlib": ("plots", "pictures"),
    "jinja2": ("report", "reports"),
    "plotly": ("report", "reports"),
    "rosbags": ("ros2", "ROS 2 bags"),
    "can": ("canopen", "drives on CANopen"),
    "canopen": ("canopen", "drives on CANopen"),
    "msgpack": ("canopen", "drives on CANopen"),
    "serial": ("xsens", "serial ports"),
}


def need(*modules: str) -> None:
    """Raises InputError, naming the extra, for the first of these that is not installed."""
    for module in modules:
        if find_spec(module) is None:
            raise InputError(missing(module))


def missing(module: str) -> str:
    """What to do about a module of EXTRAS that is not installed."""
    extra, purpose = EXTRAS[module]
    return f"{purpose} need {module}: pip install 'cdprcal[{extra}]'"
