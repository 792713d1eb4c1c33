"""How the readings of a simulated start-up err: one function a kind of signal.

The simulator adds white noise; what is not white is done to the rows of its log here. `scale` of a
recording is one σ of the case's noise for each sensor: the share of the robot file's σ that the
study asks for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
#: Of a sensor: its name in a log, and its readings, one row a sample.
Readings = dict[str, Floats]


@dataclass(frozen=True)
class Recording:
    """A start-up as it was logged, and what the sensors do not know."""

    time_s: Floats
    readings: Readings
    position_m: Floats  #: true, a row a sample
    tension_setpoint_N: Floats
    rests_s: list[tuple[float, float]]
    scale: dict[str, float]  #: one σ of the noise, by sensor
    quantum: dict[str, float]  #: of coarse sensors on this robot
    turn: float  #: one turn of the attitude, in the unit it is read in
    size_m: float  #: of the robot's frame: 1 for irma4

    def every(self, step: int) -> Recording:
        """Each `step`-th row only."""
        rows = {
            f.name: getattr(self, f.name)[::step]
            for f in fields(self)
            if isinstance(getattr(self, f.name), np.ndarray)
        }
        return replace(self, readings={k: v[::step] for k, v in self.readings.items()}, **rows)


@dataclass(frozen=True)
class Signal:
    """One kind of errors."""

    about: str
    spoil: Callable[[Recording, np.random.Generator], None] | None = None  #: in place
    white: float | None = None  #: white noise in the simulator, of σ; None: the case's noise
    log_rate_Hz: float = 10.0
    every: int = 1  #: row that is kept of the spoilt log


#: White noise under errors of another kind: a twentieth of what eq. 18 says, as of good sensors.
_QUIET = 0.02
#: Errors by place vary over such shares of the robot's frame, in so many waves.
_REACH_OF_FRAME, _WAVES = (0.2, 0.6), 12
#: How long errors that wander about zero remember.
_MEMORY_S = (5.0, 60.0)
_DEGREES_OF_FREEDOM = 3
_SPIKED_SHARE, _SPIKE_SIGMA = 0.01, (10.0, 30.0)
_TIME_CONSTANT_S = (0.05, 0.2)
_CUT_OFF_HZ = (2.0, 20.0)
_HELD_ROWS = 5  # 50 Hz rows of 10 Hz sensors


def _rest(run: Recording, rng: np.random.Generator) -> None:
    """Constant over each rest, on its way to the next one's in between."""
    knots = np.array(run.rests_s).ravel()
    for name, scale in run.scale.items():
        for column in range(run.readings[name].shape[1]):
            errors = scale * rng.standard_normal(len(run.rests_s))
            run.readings[name][:, column] += np.interp(run.time_s, knots, np.repeat(errors, 2))


def _place(run: Recording, rng: np.random.Generator) -> None:
    """A smooth random function of the position: a sum of waves, of one σ over all places."""
    length_m = run.size_m * rng.uniform(*_REACH_OF_FRAME)
    for name, scale in run.scale.items():
        for column in range(run.readings[name].shape[1]):
            waves = rng.standard_normal((3, _WAVES)) / length_m
            phases = rng.uniform(0.0, 2.0 * np.pi, _WAVES)
            amplitudes = scale * np.sqrt(2.0 / _WAVES) * rng.standard_normal(_WAVES)
            run.readings[name][:, column] += np.cos(run.position_m @ waves + phases) @ amplitudes


def _walk(run: Recording, rng: np.random.Generator) -> None:
    """A random walk in time; its rms over the run is one σ."""
    steps_s = np.diff(run.time_s, prepend=run.time_s[0])
    rate = np.sqrt(2.0 * steps_s / (run.time_s[-1] - run.time_s[0]))
    for name, scale in run.scale.items():
        steps = rng.standard_normal(run.readings[name].shape) * rate[:, None]
        run.readings[name] += scale * np.cumsum(steps, axis=0)


def _wander(run: Recording, rng: np.random.Generator) -> None:
    """About zero in time, of one σ: smoothly, as warmth comes and goes (white noise under a
    Gaussian window), or roughly (Ornstein and Uhlenbeck's process)."""
    step_s = float(np.median(np.diff(run.time_s)))
    memory = float(rng.uniform(*_MEMORY_S)) / step_s  # rows
    smooth = rng.random() < 0.5
    ages = np.arange(int(np.ceil(6.0 * memory)))
    weights = np.exp(-0.5 * ((ages - 3.0 * memory) / memory) ** 2 if smooth else -ages / memory)
    weights /= np.linalg.norm(weights)
    for name, scale in run.scale.items():
        rows, columns = run.readings[name].shape
        for column in range(columns):
            white = rng.standard_normal(rows + len(weights) - 1)
            errors = np.convolve(white, weights, mode="valid")
            run.readings[name][:, column] += scale * errors


def _heavy_tailed(run: Recording, rng: np.random.Generator) -> None:
    """Student's t, with the variance of the white noise."""
    freedom = _DEGREES_OF_FREEDOM
    for name, scale in run.scale.items():
        draws = rng.standard_t(freedom, run.readings[name].shape)
        run.readings[name] += scale * np.sqrt((freedom - 2) / freedom) * draws


def _quantised(run: Recording, _rng: np.random.Generator) -> None:
    for name, quantum in run.quantum.items():
        run.readings[name][:] = quantum * np.round(run.readings[name] / quantum)


def _held(run: Recording, rng: np.random.Generator) -> None:
    """Each sensor is read anew every few rows, at a phase of its own."""
    for readings in run.readings.values():
        rows = np.arange(len(readings))
        phase = int(rng.integers(_HELD_ROWS))
        readings[:] = readings[np.maximum((rows - phase) // _HELD_ROWS * _HELD_ROWS + phase, 0)]


def _filtered(run: Recording, rng: np.random.Generator) -> None:
    """A low-pass of first order, the same of all sensors: another one would be a delay of its own,
    which has a name."""
    step_s = float(np.median(np.diff(run.time_s)))
    gain = -float(np.expm1(-step_s / rng.uniform(*_TIME_CONSTANT_S)))
    _behind(run, tuple(run.readings), [gain], [gain - 1.0])


def _low_passes(run: Recording, rng: np.random.Generator) -> None:
    """A Butterworth filter of second or fourth order, or a moving mean; behind it all sensors, or
    the load cells alone."""
    rate_Hz = 1.0 / float(np.median(np.diff(run.time_s)))
    cut_off_Hz = float(np.exp(rng.uniform(*np.log(_CUT_OFF_HZ))))
    sensors = tuple(run.readings)
    if "tension_N" in sensors and rng.random() < 0.5:
        sensors = ("tension_N",)
    sections = int(rng.integers(3))
    if sections == 0:
        width = max(2, round(0.44 * rate_Hz / cut_off_Hz))
        _behind(run, sensors, [1.0 / width] * width, [])
    warped = np.tan(np.pi * cut_off_Hz / rate_Hz)
    for k in range(sections):
        damped = 2.0 * np.sin(np.pi * (k + 0.5) / (2.0 * sections)) * warped
        whole = 1.0 + damped + warped**2
        gain = warped**2 / whole
        back = [2.0 * (warped**2 - 1.0) / whole, (1.0 - damped + warped**2) / whole]
        _behind(run, sensors, [gain, 2.0 * gain, gain], back)


def _behind(run: Recording, sensors: Sequence[str], on: list[float], back: list[float]) -> None:
    """Sensors behind a filter, yₖ = Σ onᵢ xₖ₋ᵢ - Σ backᵢ yₖ₋ᵢ₋₁, that was at rest at the start."""
    attitude = run.readings["roll_pitch_yaw_rad"]
    attitude[:] = np.unwrap(attitude, axis=0, period=run.turn)
    for sensor in sensors:
        readings = run.readings[sensor]
        # As long as its memory, the first reading went on before.
        read = np.vstack([np.repeat(readings[:1], len(on) - 1, axis=0), readings])
        driven = np.zeros_like(readings)
        for i, share in enumerate(on):
            driven += share * read[len(on) - 1 - i : len(read) - i]
        before = np.repeat(readings[:1], len(back), axis=0)
        for row, now in enumerate(driven):
            readings[row] = now - np.array(back) @ before
            before = np.vstack([readings[row : row + 1], before[:-1]]) if back else before
    attitude -= run.turn * np.round(attitude / run.turn)


def _spiked(run: Recording, rng: np.random.Generator) -> None:
    for name, scale in run.scale.items():
        shape = run.readings[name].shape
        spikes = scale * rng.uniform(*_SPIKE_SIGMA, shape) * rng.choice([-1.0, 1.0], shape)
        run.readings[name] += np.where(rng.random(shape) < _SPIKED_SHARE, spikes, 0.0)


SIGNALS: dict[str, Signal] = {
    "white": Signal("each reading for itself"),
    "rest": Signal("constant while the platform rests", _rest, white=_QUIET),
    "place": Signal("a smooth function of the place: revisits share them", _place, white=_QUIET),
    "walk": Signal("a random walk in time", _walk, white=_QUIET),
    "wander": Signal("about zero in time, correlated over 5 to 60 s", _wander, white=_QUIET),
    "heavy_tailed": Signal("Student's t with 3 degrees of freedom", _heavy_tailed, white=_QUIET),
    "quantised": Signal("0.5 mm, 0.1°, 1 N under less noise", _quantised, white=_QUIET),
    "held": Signal("rows at 50 Hz of 10 Hz sensors", _held, log_rate_Hz=50.0),
    "filtered": Signal("a low-pass of 50 to 200 ms", _filtered, log_rate_Hz=100.0, every=10),
    "low_passes": Signal(
        "filters of 2 to 20 Hz: second order, fourth order, moving means; behind them all sensors, "
        "or load cells alone",
        _low_passes,
        log_rate_Hz=100.0,
        every=10,
    ),
    "spiked": Signal("1 % of the samples off by 10 to 30 σ", _spiked),
}
