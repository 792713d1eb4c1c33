"""Three logs of a robot that was changed before the last, or never: which effect, and in which log?

    python tests/studies/changed_robots.py --count 2

Each effect of the robot in the catalogue, of 0.7 to 2 typical sizes, in all of three simulated
start-ups or in the last of them alone, and clean ones. All three are diagnosed together.
"""

from __future__ import annotations

import argparse
from collections import Counter
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from cdprcal import _core
from cdprcal.testing.blind_bench.cases import Case, Setting, draw_effect
from cdprcal.testing.blind_bench.machines import Machine
from cdprcal.testing.blind_bench.simulate import SimulationError, simulate

LOGS = 3
#: Which of the logs have the effect.
WHERE = {"none": (), "all": (0, 1, 2), "the last": (2,)}
SIGNALS = ("white", "rest")


def effects() -> list[_core.EffectInfo]:
    """Those of a robot that rests show."""
    return [
        info
        for info in _core.effect_catalogue()
        if info.scope == _core.EffectScope.robot
        and info.shows == _core.Shows.at_rest
        and not info.all_or_nothing
    ]


def try_one(job: tuple[str, str, int, int]) -> tuple[str, str, str, str]:
    """Signal, where it is hidden, what was hidden, and what the diagnosis says."""
    where, name, seed, poses = job
    index, info = next((i, e) for i, e in enumerate(effects()) if e.name == name)
    rng = np.random.default_rng([seed, index])
    signal = SIGNALS[seed % len(SIGNALS)]
    machine = Machine()
    hidden = draw_effect(info, rng, machine.cables, machine.scale)
    setting = Setting(poses=poses, noise=0.2, family=signal)
    logs = []
    for number in range(LOGS):
        has = number in WHERE[where]
        of_its_own = int(rng.integers(2**62))
        inside = [hidden] if has else []
        case = Case(number, of_its_own, "one", False, 1.0, inside, signal=signal)
        try:
            made = simulate(case, setting)
        except SimulationError:
            return signal, where, name, "not simulated"
        logs.append(made.log)
    found = _core.diagnose(made.robot, logs)
    names = [e.info.name for e in found.effects if not e.described]
    if found.verdict.name != "explained" or len(names) != 1:
        return signal, where, name, f"{found.verdict.name} {' '.join(names)}".strip()
    effect = found.effects[0]
    of_each = effect.info.scope == _core.EffectScope.run
    known = effect.rivals
    what = "right" if names[0] == name else "a rival" if name in known else f"wrong: {names[0]}"
    return signal, where, name, f"{what}, {'of each log' if of_each else 'of the robot'}"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", type=int, default=2, help="of each effect, in each way")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--poses", type=int, default=8)
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.count)
    jobs = [
        (where, info.name, seed, options.poses)
        for where in WHERE
        for info in effects()
        for seed in seeds
    ]
    answers: dict[str, Counter[str]] = {where: Counter() for where in WHERE}
    with ProcessPoolExecutor(options.workers) as pool:
        for signal, where, name, answer in pool.map(try_one, jobs):
            print(f"{signal:6} {where:9} {name:20} {answer}", flush=True)
            answers[where][answer] += 1
    for where, counts in answers.items():
        print(f"\nin {where}:")
        for answer, count in counts.most_common():
            print(f"  {count:4} {answer}")


if __name__ == "__main__":
    main()
