"""The document of ``diagnose --json``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from cdprcal import _core
from cdprcal.diagnosis.units import GAP_CHANNELS
from cdprcal.findings import Finding
from cdprcal.results import number, numbers, pose_as_dict, residual_as_dict
from cdprcal.sensors import ABSOLUTE
from cdprcal.trust import caveats_of_diagnosis

#: Verdicts after which the pose and the model can be worked with.
TRUSTED = {
    _core.Verdict.consistent.name,
    _core.Verdict.explained.name,
    _core.Verdict.described.name,
}


def _by_channel(errors: list[_core.Wandering]) -> list[dict[str, Any]]:
    return [{"channel": e.channel, "rms": number(e.rms), "sigma": number(e.sigma)} for e in errors]


def diagnosis_as_dict(
    diagnosis: _core.Diagnosis,
    robot: _core.Robot,
    caveats: Iterable[Finding] = (),
    *,
    logs: Iterable[_core.Log] = (),
) -> dict[str, Any]:
    """A diagnosis of ``robot`` as plain data: NaN and absent become None.

    ``caveats``: what is to be known of the logs; those of the diagnosis itself come after.
    ``logs``: those that were diagnosed. Of lists of rests alone nobody knows the ripple.

    Discrete faults come first among the effects: they were found first, and without statistics.
    An effect that differs from run to run has, for several logs, one entry a log in each parameter.
    """
    convention = diagnosis.corrected.euler_convention
    ripple = _ripple(diagnosis)
    runs = len(diagnosis.model.run_names)
    return {
        "verdict": diagnosis.verdict.name,
        "reason": diagnosis.reason,
        "caveats": [caveat.as_dict() for caveat in (*caveats, *caveats_of_diagnosis(diagnosis))],
        "effects": [
            *(_fault(fault) for fault in diagnosis.faults),
            *(
                _effect(effect, robot.cable_count, runs) | {"course": _course(diagnosis.model, k)}
                for k, effect in enumerate(diagnosis.effects)
            ),
        ],
        "rejected": [{"name": r.name, "reason": r.reason} for r in diagnosis.rejected],
        "unexplained": [
            {
                "channel": left.channel,
                "rms": number(left.rms),
                "sigma": number(left.sigma),
                "depends_on": left.depends_on,
                "cable": None if left.cable < 0 else left.cable + 1,
            }
            for left in diagnosis.unexplained
        ],
        "wandering": _by_channel(diagnosis.wandering),
        "own_errors": [
            {
                "column": own.column,
                "rms": number(own.rms),
                "like": number(own.like),
                "sigma": number(own.sigma),
                "at_s": number(own.at_s),
            }
            for own in diagnosis.own_errors
        ],
        "discrepancy": {
            "reach_m": number(diagnosis.discrepancy.reach_m),
            "channels": _by_channel(diagnosis.discrepancy.channels),
        },
        "gap": [
            {
                "after_effect": gap.after_effect or None,
                "channel": gap.channel,
                "train_rms": number(gap.train_rms),
                "held_out_rms": number(gap.held_out_rms),
            }
            for gap in diagnosis.gap
        ],
        "initial_pose_before": pose_as_dict(diagnosis.initial_pose_before, convention),
        "initial_pose_after": pose_as_dict(diagnosis.initial_pose_after, convention),
        "covariance_before": numbers(diagnosis.covariance_before),
        "covariance_after": numbers(diagnosis.covariance_after),
        "identifiability": [
            {
                "name": i.name,
                "visible": i.visible,
                "detectable": number(i.detectable),
                "detectable_after": number(i.detectable_after),
            }
            for i in diagnosis.identifiability
        ],
        "ranking": [
            {"name": s.name, "log_evidence": number(s.log_evidence)} for s in diagnosis.ranking
        ],
        "ripple": dict.fromkeys(ripple) if _only_lists(logs) else ripple,
        "residuals": {
            "before": _residuals(diagnosis.baseline),
            "after": _residuals(diagnosis.model),
        },
        "runs": list(diagnosis.model.run_names),
        "corrected": _core.to_yaml(diagnosis.corrected),
        "left_out": list(diagnosis.gated),
        "next": list(diagnosis.next),
    }


def _only_lists(logs: Iterable[_core.Log]) -> bool:
    """Whether there are logs, each with one reading a rest, which says nothing of its ripple."""
    lists = [_core.is_rest_list(log) for log in logs]
    return bool(lists) and all(lists)


def _ripple(diagnosis: _core.Diagnosis) -> dict[str, float | None]:
    """The readings' own noise by channel of the gap; tension from the balance's, which is in σ.

    Channels of sensors that few robots have only where they were read.
    """
    scale = {"tension_N": diagnosis.corrected.sigma.tension_N}
    levels = zip(GAP_CHANNELS, diagnosis.baseline.floor, strict=False)
    read = {gap.channel for gap in diagnosis.gap}
    few_have = {channel.rms_field for channel in ABSOLUTE.values()}
    return {
        channel: number(level * scale.get(channel, 1.0))
        for channel, level in levels
        if channel in read or channel not in few_have
    }


def _residuals(model: _core.DiagnosisModel) -> list[dict[str, Any]]:
    """Modelled minus measured, pose by pose; ``run`` counts from 0."""
    return [
        {"run": r.run, "run_time_s": number(r.run_time_s)} | residual_as_dict(r.residual)
        for r in _core.model_residuals(model)
    ]


def _fault(fault: _core.DiscreteFault) -> dict[str, Any]:
    values: Any = numbers(fault.values)
    if fault.convention is not None:
        values = fault.convention.name
    elif len(values) == 1:
        values = values[0]
    return {
        "name": fault.name,
        "parameters": {fault.parameter: values}
        | {
            name: numbers(order)
            for name in ("tension_order", "swivel_order")
            if (order := getattr(fault, name))
        },
        "standard_deviation": None,
        "log_evidence": number(fault.log_evidence),
        "p_value": None,
        "rivals": list(fault.rivals),
        "held_out": {"before": None, "after": None},
        "sentence": fault.text,
        "formula": None,
        "described": False,
        "units": {},
        "shapes": {},
        "equation": "",
        "remedy": "",
        "settle": "",
        "course": None,
    }


def _effect(effect: _core.NamedEffect, cables: int, runs: int) -> dict[str, Any]:
    by_run = effect.info.scope == _core.EffectScope.run
    return {
        "name": effect.info.name,
        "parameters": {
            **effect.where,
            **named_values(effect.info, effect.values, cables, runs if by_run else 1),
        },
        "standard_deviation": named_values(
            effect.info, effect.standard_deviation, cables, runs if by_run else 1
        ),
        "log_evidence": number(effect.log_evidence),
        "p_value": number(effect.p_value),
        "rivals": list(effect.rivals),
        "held_out": {
            "before": number(effect.held_out_before),
            "after": number(effect.held_out_after),
        },
        "sentence": effect.info.sentence,
        "formula": effect.info.formulas or None,
        "described": effect.described,
        "units": {p.name: p.unit for p in effect.info.parameters},
        "shapes": {p.name: p.shape.name for p in effect.info.parameters},
        "equation": effect.info.equation,
        "remedy": effect.info.remedy,
        "settle": effect.info.settle,
    }


def _course(model: _core.DiagnosisModel, effect: int) -> dict[str, Any] | None:
    """A formula against the first of its variables: what it adds, and what the readings say."""
    found = _core.formula_course(model, effect)
    if found is None:
        return None
    return {
        "to": found.to,
        "variable": found.variable,
        "points": [
            {
                "run": point.run,
                "cable": point.cable + 1 or None,
                "x": number(point.x),
                "added": number(point.added),
                "read": number(point.read),
            }
            for point in found.points
        ],
    }


def named_values(info: _core.EffectInfo, values: Any, cables: int, runs: int) -> dict[str, Any]:
    """Values in the order of the catalogue → parameter by name, nested as in the robot file."""
    table = np.asarray(values, dtype=float).reshape(runs, -1)
    named: dict[str, Any] = {}
    begin = 0
    for parameter in info.parameters:
        shape = value_shape(parameter.shape, cables)
        count = int(np.prod(shape, dtype=int))
        own = table[:, begin : begin + count].reshape((runs, *shape))
        begin += count
        plain = numbers(own) if own.ndim > 1 else [number(v) for v in own.tolist()]
        named[parameter.name] = plain if runs > 1 else plain[0]
    return named


def in_words(told: Mapping[str, Any]) -> str:
    """One line for people of ``verdict``, ``faults`` and ``effects``, as logs have them."""
    said = [*told["faults"]]
    for effect in told["effects"]:
        alike = f", or {', '.join(effect['rivals'])}" if effect["rivals"] else ""
        said.append(f"{effect['name']} ({effect['log_evidence']:.0f} nats{alike})")
    return f"{told['verdict']}: {'; '.join(said) or 'no effect found'}"


def value_shape(shape: _core.ParameterShape, cables: int) -> tuple[int, ...]:
    """The nesting in a robot file: () a number, (cables,), (3,) or (cables, 3)."""
    return {
        _core.ParameterShape.scalar: (),
        _core.ParameterShape.per_cable: (cables,),
        _core.ParameterShape.vector3: (3,),
        _core.ParameterShape.per_cable_vector3: (cables, 3),
    }[shape]
