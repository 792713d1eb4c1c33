"""Options and plain values of the core can be copied and pickled: as what they are made from.

Loaded with the first name of the core, whatever it is.
"""

from __future__ import annotations

import copyreg
from collections.abc import Callable
from typing import Any

from cdprcal import _core
from cdprcal.signatures import arguments_of

#: Classes that are nothing but what their constructor takes and what can be set.
PLAIN = (
    _core.AppliedEffect,
    _core.AskedAccuracy,
    _core.Box,
    _core.Cable,
    _core.CalibrateOptions,
    _core.DetectionOptions,
    _core.DiagnoseOptions,
    _core.InjectedEffect,
    _core.Mesh,
    _core.Platform,
    _core.PlatformDamping,
    _core.Pulley,
    _core.ReadingNoise,
    _core.ReadingOffsets,
    _core.RestOptions,
    _core.RobotSample,
    _core.SampleRange,
    _core.SensorChannel,
    _core.SensorOptions,
    _core.SensorSigma,
    _core.SetPoint,
    _core.SimulatorOptions,
    _core.SolveOptions,
    _core.StartUpOptions,
    _core.StartUpPlan,
    _core.StrandOptions,
    _core.Surroundings,
    _core.SyntheticLogOptions,
    _core.TensionControlOptions,
    _core.TimingOptions,
    _core.WatchdogOptions,
    _core.WinchOptions,
)


def fields_of(kind: type) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of what its constructor takes, and of what else can be set."""
    from cdprcal.sensors import SENSORS

    settable = [n for n, v in vars(kind).items() if isinstance(v, property) and v.fset is not None]
    taken = arguments_of(kind.__name__)
    # Of readings, those of more sensors are keywords that have no name in the signature.
    more = [n for n in SENSORS if hasattr(kind, n) and n not in (*taken, *settable)]
    return (*taken, *more), tuple(name for name in settable if name not in taken)


def _made(kind: type, taken: dict[str, Any], settable: dict[str, Any]) -> Any:
    made = kind(**taken)
    for name, value in settable.items():
        setattr(made, name, value)
    return made


def _reduced(value: Any) -> tuple[Callable[..., Any], tuple[Any, ...]]:
    kind = type(value)
    fields = [{name: getattr(value, name) for name in names} for names in fields_of(kind)]
    return _made, (kind, *fields)


def _by_state(value: Any) -> tuple[Callable[..., Any], tuple[type], Any]:
    """As protocol 2 does it; the older ones call a constructor of the base, which has none."""
    # typeshed does not know the function, which pickles name.
    return copyreg.__newobj__, (type(value),), value.__getstate__()  # type: ignore[attr-defined]


copyreg.pickle(_core.Pose, _by_state)
copyreg.pickle(_core.Robot, _by_state)
for _kind in PLAIN:
    copyreg.pickle(_kind, _reduced)
