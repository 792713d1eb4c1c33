"""Makes docs/catalogue.md and its pictures: every effect, and the signature that it leaves.

    python docs/tools/catalogue.py -o docs

Each effect is hidden, at its typical size, in a simulated start-up of irma4 with the noise of real
sensors; the picture shows what the model without it leaves of every reading, and the text what
``diagnose`` makes of that very log.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from cdprcal import _core, simulate_startup
from cdprcal.demo.story import start_up
from cdprcal.diagnosis.document import value_shape
from cdprcal.diagnosis.units import for_people

ROBOT = "irma4"
SEED = 4
#: Sizes of an effect's numbers in typical sizes: no two alike, so that they are told apart.
_PATTERN = (1.0, -0.8, 0.6, -1.0, 0.7, -0.6, 0.9, -0.7, 0.8, -0.9, 0.5, -0.5)
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
_MARKERS = "osD^"
_MOST_POINTS = 40
_PANELS: tuple[tuple[str, float, Callable[[_core.PoseResidual], np.ndarray]], ...] = (
    ("length [mm]", 1e3, lambda r: r.length_m),
    ("swivel [°]", 180.0 / np.pi, lambda r: r.swivel_rad),
    ("tension [N]", 1.0, lambda r: r.tension_N),
    ("attitude [°]", 180.0 / np.pi, lambda r: r.roll_pitch_yaw_rad),
)

HEAD = """\
# The catalogue of effects

What `diagnose` looks for, what each effect does to the readings, and what to do about it. *s* is
the direction of a cable's motion (+1 paying out), *t* the time in the run, *d* a difference to the
reference. Which size shows is told by `diagnose` itself, for the poses at hand.

Sizes are those of `{robot}` (13 kg, 3 m from pulley to pulley), for which they are known best. On
another robot they are larger or smaller as its weight or its size is, by the last column of each
table: no reason of physics fixes them in newtons or metres, while load cells and cables are chosen
for the weight and errors of a geometry grow with it. So an error of the mass is measured against
the mass; forces and what load cells are off by against the weight, which cables carry on any robot
(limits of tension are often those of a drive, or absent); cables are chosen to stretch by a share
of their length under the weight, and weigh more where they carry more; creep, slips and the places
of pulleys grow with the frame, what is on the platform with the arms of its anchors, an error of a
radius with the radius. Ratios, angles, times and coefficients of friction are the same everywhere.

The pictures are *signatures*: what the model without the effect leaves of every reading, pose by
pose, in a simulated start-up of `{robot}` where the effect is hidden at its typical size (16 poses
in random order, noise of real sensors; what shows in motion alone, in one that waits for no rest).
Everything on this page comes from the program: `python docs/tools/catalogue.py -o docs`.

| effect | measured = … | typical | looks like |
|---|---|---|---|
"""

FAULTS = """\
## Faults of the configuration

They are looked for first, by refitting with each of them: the cost falls by orders of magnitude
where one is real. The order of Euler angles changes them by the product of two tilts only, and is
held to the evidence that effects are held to. Signs are tried in every combination, cables in every
order (of more than six, any two exchanged), units of all sensors of a kind and of each alone. The
mounting of the AHRS, its zero and those of the load cells are fitted to where the other sensors
have the platform. A unit in which readings would vary by less than their sigma is not accused:
they would contradict nothing any more.

| name | what is wrong |
|---|---|
"""

EVENTS = """\
## Events in time

Found in the readings of single samples, before any fit or after it. At a run's first move
`diagnose` also finds a `cable_slip` of all cables, a `load_cell_shift` that ends there, and
`contact`: something bore the platform, or held it, until then (the simulated machine does none of
these).

| name | what happened |
|---|---|
"""


@dataclass(frozen=True)
class Signature:
    """A run with one effect hidden in it, and what was made of it."""

    effect: str
    diagnosis: _core.Diagnosis

    def sentence(self) -> str:
        """What diagnose says of the run of the picture."""
        named = [effect.info.name for effect in self.diagnosis.effects]
        if not named:
            return (
                "In the run of the picture `diagnose` names nothing: at this size it does not show."
            )
        rivals = sorted({rival for effect in self.diagnosis.effects for rival in effect.rivals})
        does = "fits" if self.diagnosis.verdict == _core.Verdict.undetermined else "names"
        text = f"In the run of the picture `diagnose` {does} {_code(named)}"
        return text + (
            f", and says that these poses do not tell it from {_code(rivals)}." if rivals else "."
        )


def injected(info: _core.EffectInfo, cables: int) -> str:
    """An effect of typical size as ``--effect`` takes it."""
    parts = []
    for parameter in info.parameters:
        count = math.prod(value_shape(parameter.shape, cables))
        parts += [f"{_reported(info, parameter.typical) * share:.4g}" for share in _PATTERN[:count]]
    return f"{info.name}={','.join(parts)}"


def _reported(info: _core.EffectInfo, value: float) -> float:
    """As files have it: stiffnesses are the inverse of what is estimated."""
    return 1.0 / value if info.inverse else value


def signature(info: _core.EffectInfo, plan: _core.Plan, folder: Path) -> Signature:
    """Simulates a start-up with the effect in it, and diagnoses it."""
    robot = _core.load_robot(ROBOT)
    effect = injected(info, robot.cable_count)
    if info.shows == _core.Shows.in_moving_balance:
        passed = simulate_startup(
            robot,
            plan,
            effects=[effect],
            seed=SEED,
            startup=_core.StartUpOptions(wait_for_rest=False),
            log_rate_Hz=100.0,
        )
        asked = [info.name] if info.on_request else None
        options = _core.DiagnoseOptions(motion=True, effects=asked)
        return Signature(effect, _core.diagnose(robot, [passed.log], options))
    run = start_up(robot, plan, SEED, [effect], folder / f"{info.name}.csv")
    if run.acquired.reason:
        raise RuntimeError(f"{effect}: {run.acquired.reason}")
    return Signature(effect, _core.diagnose(robot, [run.log]))


def signature_plan() -> _core.Plan:
    """Eight poses, twice each, in random order."""
    return _core.make_plan(_core.load_robot(ROBOT), order=_core.VisitingOrder.random, seed=2).plan


def draw(found: Signature) -> Figure:
    """Four panels: lengths, swivels, tensions by cable; roll, pitch and yaw."""
    figure = Figure(figsize=(9.0, 2.3), layout="constrained")
    residuals = _core.model_residuals(found.diagnosis.baseline)
    residuals = residuals[:: max(1, len(residuals) // _MOST_POINTS)]  # of a run in motion
    times = [residual.run_time_s for residual in residuals]
    for i, (title, factor, read) in enumerate(_PANELS):
        axes = figure.add_subplot(1, 4, i + 1)
        values = factor * np.array([read(residual.residual) for residual in residuals])
        for k in range(values.shape[1]):
            style: dict[str, Any] = {"marker": _MARKERS[k], "color": _COLOURS[k], "markersize": 3.2}
            axes.plot(times, values[:, k], linewidth=0.7, **style)
        axes.axhline(0.0, color="#9aa5b1", linewidth=0.6, zorder=0)
        axes.set_title(title, fontsize=8)
        axes.tick_params(labelsize=6.5)
        axes.set_xlabel("time [s]", fontsize=7)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    # One legend for all: the first three cables share their looks with the three angles.
    labels = ("cable 1, roll", "cable 2, pitch", "cable 3, yaw", "cable 4")
    handles = figure.axes[0].get_lines()[:4]
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=7, frameon=False)
    return figure


def entry(info: _core.EffectInfo) -> str:
    """Markdown of one effect, without what its run says."""
    lines = [
        f"## {info.name}",
        "",
        f"{_sentence(info.sentence)} **On the robot:** {info.remedy}. **To settle it:** "
        f"{info.settle}.",
        "",
        f"`{info.equation}`",
        "",
        "| parameter | typical | believable up to | grows with |",
        "|---|---|---|---|",
    ]
    for parameter in info.parameters:
        shape = parameter.shape.name.replace("_", " ").replace("vector3", "x, y, z")
        each = "" if shape == "scalar" else f", {shape}"
        sizes = (parameter.typical, parameter.plausible)
        typical, most = (_size(info, parameter, v) for v in sizes)
        if info.inverse:
            most = f"down to {most}"
        grows = parameter.of or "–"
        lines.append(f"| `{parameter.name}`{each} | {typical} | {most} | {grows} |")
    scope = (
        "Belongs to one run."
        if info.scope == _core.EffectScope.run
        else "Stays with the robot from run to run."
    )
    shows = {
        "at_rest": "",
        "in_motion": " Shows in samples of a platform that moves.",
        "in_moving_balance": " Shows where a moving platform balances: `diagnose --motion`.",
    }[info.shows.name]
    asked = (
        f" It is not searched for; `diagnose --motion --fit {info.name}` fits it."
        if info.on_request
        else ""
    )
    confused = f" Confused with {_code(info.confused_with)}." if info.confused_with else ""
    return "\n".join([*lines, "", f"{scope}{shows}{asked}{confused}", ""])


def row(info: _core.EffectInfo) -> str:
    """The effect's line in the table."""
    sizes = [_size(info, p, p.typical) for p in info.parameters]
    rivals = ", ".join(f"`{name}`" for name in info.confused_with)
    return f"| [`{info.name}`](#{info.name}) | `{info.equation}` | {', '.join(sizes)} | {rivals} |"


def tables_of_faults() -> str:
    """Faults and events, from what the simulator can inject."""
    catalogue = {info.name for info in _core.effect_catalogue()}
    rows = {FAULTS: "", EVENTS: ""}
    for effect in _core.injectable_effects():
        if effect["generator_only"] or effect["name"] in catalogue:
            continue
        timed = effect["parameters"][0][0] == "time_s"
        rows[EVENTS if timed else FAULTS] += f"| `{effect['name']}` | {effect['description']} |\n"
    return "\n".join(head + lines for head, lines in rows.items())


def page(sentences: dict[str, str]) -> str:
    """The whole page; ``sentences`` by effect: what diagnose made of its run."""
    catalogue = _core.effect_catalogue()
    text = HEAD.format(robot=ROBOT) + "".join(f"{row(info)}\n" for info in catalogue)
    for info in catalogue:
        picture = f"![What {info.name} leaves of every reading](catalogue/{info.name}.svg)"
        text += f"\n{entry(info)}\n{picture}\n\n{sentences[info.name]}\n"
    return text + "\n" + tables_of_faults()


def _size(info: _core.EffectInfo, parameter: _core.EffectParameter, value: float) -> str:
    value = _reported(info, value)
    unit, factor = for_people(parameter.unit, value)
    return f"{float(f'{value * factor:.3g}'):g}{'' if unit.startswith('°') else ' '}{unit}"


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _code(names: list[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def main() -> None:
    """Writes the page and the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"), metavar="DIR")
    folder = parser.parse_args().output
    (folder / "catalogue").mkdir(parents=True, exist_ok=True)
    # The same file from the same numbers, and text as text: a tenth of the size.
    mpl.rcParams |= {"svg.hashsalt": "cdprcal", "svg.fonttype": "none", "path.simplify": True}
    plan = signature_plan()
    sentences = {}
    with tempfile.TemporaryDirectory() as logs:
        for info in _core.effect_catalogue():
            found = signature(info, plan, Path(logs))
            sentences[info.name] = found.sentence()
            path = folder / "catalogue" / f"{info.name}.svg"
            draw(found).savefig(path, metadata={"Date": None})
            print(f"{info.name}: {found.sentence()}", flush=True)
    (folder / "catalogue.md").write_text(page(sentences), encoding="utf-8")


if __name__ == "__main__":
    main()
