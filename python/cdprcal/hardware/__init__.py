"""Robots that the start-up procedure can drive: one file a device, behind one small protocol."""

from cdprcal.hardware.backend import Backend, BackendError, SlowToArm

#: Names that ``cdprcal acquire --backend`` takes.
BACKENDS = ("simulated", "canopen", "ethercat")

__all__ = ["BACKENDS", "Backend", "BackendError", "SlowToArm"]
