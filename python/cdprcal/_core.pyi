"""
C++ core of cdprcal. SI units; the unit is the name's suffix. Poses and rotations map the platform frame P into the world frame O.

Wrong use raises InputError; a numerical failure is a status in the result.
"""

from __future__ import annotations
import builtins
import collections.abc
import enum
import numpy
import numpy.typing
import os
import typing

__all__: list[str] = [
    "AlphaShape",
    "AppliedEffect",
    "ApproachCoverage",
    "AskedAccuracy",
    "Box",
    "Cable",
    "CableDerivatives",
    "CableState",
    "CableStatus",
    "CalibrateOptions",
    "Calibration",
    "CalibrationProblem",
    "CalibrationResult",
    "CalibrationStatus",
    "CandidateScore",
    "ChannelNoise",
    "ChannelRow",
    "ComparedNumber",
    "Comparison",
    "Course",
    "CoursePoint",
    "DetectionOptions",
    "DiagnoseOptions",
    "Diagnosis",
    "DiagnosisModel",
    "Discrepancy",
    "DiscreteFault",
    "EffectInfo",
    "EffectParameter",
    "EffectScope",
    "Equilibrium",
    "EquilibriumMean",
    "EquilibriumResult",
    "EquilibriumStatus",
    "Estimate",
    "EulerConvention",
    "ForeseenEffect",
    "Foresight",
    "Formulation",
    "FrameResult",
    "FrameStatus",
    "Gap",
    "GatedReading",
    "Grid",
    "GridComparison",
    "Identifiability",
    "InMotion",
    "InjectedEffect",
    "InputError",
    "InverseResult",
    "KnownEffects",
    "LeftOutPose",
    "Log",
    "Measurement",
    "Mesh",
    "MeshEncoding",
    "Method",
    "MinimiserKind",
    "ModelResidual",
    "NamedEffect",
    "NextStop",
    "NextStopChooser",
    "NoiseModel",
    "NoiseSource",
    "OnlineCalibration",
    "OwnErrors",
    "ParameterShape",
    "Path",
    "PathPoint",
    "PathState",
    "PathStatus",
    "Plan",
    "PlanResult",
    "PlanStatus",
    "PlannedPose",
    "PlantEnergy",
    "PlantTruth",
    "Platform",
    "PlatformDamping",
    "PlatformState",
    "PointStatus",
    "Pose",
    "PoseKind",
    "PoseResidual",
    "Pulley",
    "Push",
    "RandomNormal",
    "ReadingNoise",
    "ReadingOffsets",
    "RejectedEffect",
    "ResidualRms",
    "RestOptions",
    "RestResult",
    "Robot",
    "RobotSample",
    "SampleRange",
    "Sensor",
    "SensorChannel",
    "SensorOptions",
    "SensorSigma",
    "SetPoint",
    "SetPointOptions",
    "Shows",
    "Signal",
    "Simulator",
    "SimulatorOptions",
    "SolveOptions",
    "Stability",
    "StabilityNotion",
    "StartUp",
    "StartUpChange",
    "StartUpCommand",
    "StartUpOptions",
    "StartUpPlan",
    "StartUpRest",
    "StartUpRun",
    "StartUpState",
    "StaticsModel",
    "StopSeparation",
    "StrandOptions",
    "Surroundings",
    "Swing",
    "SyntheticLog",
    "SyntheticLogOptions",
    "TensionControlOptions",
    "TensionDistribution",
    "TensionModel",
    "TimingOptions",
    "Track",
    "TrackedSample",
    "Tracker",
    "Unexplained",
    "Verdict",
    "VisitingOrder",
    "Wandering",
    "WatchdogOptions",
    "WinchMode",
    "WinchOptions",
    "Workspace",
    "WorkspaceProgress",
    "WrenchRow",
    "all_equilibria_at",
    "all_equilibria_from_lengths",
    "all_equilibria_from_tensions",
    "alpha_shape",
    "box_is_inside",
    "builtin_robot_names",
    "builtin_robot_yaml",
    "cable_derivatives",
    "cable_state",
    "calibrate",
    "calibrate_in_motion",
    "channel_noise",
    "channels",
    "characteristic_length_m",
    "compare",
    "compute_workspace",
    "constant_tension_modes",
    "default_setpoints",
    "default_stops",
    "describe_invalid",
    "detect_equilibria",
    "diagnose",
    "direct_from_lengths",
    "direct_from_tensions",
    "effect_catalogue",
    "effects_of",
    "equilibrium_mean",
    "euler_from_rotation",
    "euler_rate_matrix",
    "even_step_m",
    "exp_so3",
    "expanded_effect",
    "explain_empty",
    "fifth_degree",
    "find_discrete_faults",
    "find_frame",
    "follow_path",
    "foresee",
    "format_log",
    "format_plan",
    "formula_course",
    "formula_words",
    "free_motion_basis",
    "free_motion_modes",
    "free_motion_stiffness",
    "fresh_rows",
    "gravity_stiffness",
    "gravity_wrench",
    "held_orientation",
    "holds_orientation",
    "in_solid_cell",
    "injectable_effects",
    "inverse",
    "inverse_along",
    "is_rest_list",
    "lambda_of",
    "largest_inscribed_box",
    "left_inverse_rows",
    "length_jacobian",
    "library_versions",
    "linearise",
    "load_robot",
    "log_groups",
    "log_so3",
    "make_plan",
    "measurement_at",
    "measurement_mean",
    "minus",
    "model_residuals",
    "motion_basis",
    "number_table",
    "obstruction",
    "parked_start",
    "parse_euler_convention",
    "parse_formulation",
    "parse_injected_effect",
    "parse_log",
    "parse_method",
    "parse_noise_source",
    "parse_plan",
    "parse_robot",
    "parse_tension_distribution",
    "parse_visiting_order",
    "path_state",
    "perfect_sensors",
    "plain_json_messages",
    "platform_state",
    "plus",
    "potential_energy",
    "predicted_covariance",
    "prepare",
    "probe",
    "published_measurement_box",
    "random_offsets",
    "random_start",
    "read_log",
    "read_plan",
    "reading_noise",
    "robot_size_m",
    "rotation_angle_difference_rad",
    "rotation_distance_rad",
    "rotation_from_euler",
    "scan",
    "segments",
    "separation_by_stops",
    "set_point_at",
    "settling_deviation",
    "signals",
    "simulate_startup",
    "solve",
    "specified_noise",
    "stability",
    "steps_of",
    "stiffness",
    "structure_matrix",
    "swivel_jacobian",
    "synthetic_log",
    "synthetic_measurement",
    "tension_margin_N",
    "tension_stiffness",
    "tensions_least_squares",
    "tensions_left_inverse",
    "text_lines",
    "to_yaml",
    "track",
    "verify_plan",
    "with_effect_definitions",
    "with_known_effects",
    "workspace_box",
    "workspace_shape",
    "wrench_residual",
    "write_log",
    "write_mesh",
    "write_plan",
]

class InputError(ValueError):
    """
    Wrong use or unusable input. The message names the file, line or field and what to do.
    """

class EulerConvention(enum.StrEnum):
    """
    Intrinsic order of the Tait–Bryan angles: XYZ means R = Rx(roll) Ry(pitch) Rz(yaw).
    """

    XYZ = "XYZ"
    XZY = "XZY"
    YXZ = "YXZ"
    YZX = "YZX"
    ZXY = "ZXY"
    ZYX = "ZYX"

class Pose:
    """
    Pose of the platform frame P in the world frame O: x_world = position_m + rotation @ x_platform. Immutable.
    """

    @staticmethod
    def from_euler(
        position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        roll_pitch_yaw_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        convention: EulerConvention = ...,
    ) -> Pose:
        """
        The pose at position_m [3] with (roll, pitch, yaw) [rad] in the given convention.
        """

    def __init__(
        self,
        position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] = ...,
        rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] = ...,
    ) -> None:
        """
        position_m [3] in world axes; rotation [3, 3] R_world_platform. Raises InputError when rotation is not a rotation within 1e-6 or position_m is not finite.
        """

    def __repr__(self) -> str: ...
    def euler_rad(
        self, convention: EulerConvention = ...
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        (roll, pitch, yaw) [rad] in the given convention.
        """

    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Position of P in world axes [3]; a copy.
        """

    @property
    def rotation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        R_world_platform [3, 3]; a copy.
        """

class Pulley:
    """
    Swivel pulley: the groove is tangent to the swivel axis at D (Fig. 1). Immutable.
    """

    def __init__(
        self,
        *,
        position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        x_axis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        swivel_axis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        radius_m: typing.SupportsFloat | typing.SupportsIndex = 0.0,
        position_sigma_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]
        | None = None,
    ) -> None:
        """
        position_m [3]: D in the world. x_axis [3]: direction of zero swivel angle; swivel_axis [3]: perpendicular to it; both in world axes, any length. radius_m: 0 is a plain eyelet. position_sigma_m [3]: how well position_m is known; None: as well as usual. Raises InputError naming the field.
        """

    @property
    def axes_world(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        Columns i (x_axis), j, k (swivel_axis) [3, 3]; j = k × i; a copy.
        """

    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        D in the world [3] [m]; a copy.
        """

    @property
    def position_sigma_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        How well position_m is known, along each world axis [3] [m]; NaN: as well as usual.
        """

    @property
    def radius_m(self) -> float: ...
    @property
    def swivel_axis(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        k [3].
        """

    @property
    def x_axis(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        i [3].
        """

    @property
    def y_axis(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        j = k × i [3].
        """

class Cable:
    """
    A pulley and where the cable holds the platform. Immutable.
    """

    def __init__(
        self,
        *,
        pulley: Pulley,
        platform_anchor_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    ) -> None:
        """
        platform_anchor_m [3]: a′ in the platform frame.
        """

    @property
    def platform_anchor_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        a′ in the platform frame [3] [m]; a copy.
        """

    @property
    def pulley(self) -> Pulley: ...

class Box:
    """
    Axis-aligned box [m], world axes. Immutable.
    """

    def __init__(
        self,
        lower_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        upper_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    ) -> None:
        """
        Corners [3] [m].
        """

    def __repr__(self) -> str: ...
    def contains(
        self,
        position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        tolerance_m: typing.SupportsFloat | typing.SupportsIndex = 0.0,
    ) -> bool: ...
    @property
    def lower_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [3]; a copy.
        """

    @property
    def upper_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [3]; a copy.
        """

    @property
    def volume_m3(self) -> float: ...

class Platform:
    """
    Mass, its centre and inertia. Immutable.
    """

    def __init__(
        self,
        *,
        mass_kg: typing.SupportsFloat | typing.SupportsIndex,
        centre_of_mass_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        inertia_kg_m2: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"],
        motion: str = "3R3T",
        motion_plane_normal: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]
        | None = None,
        outline_m: collections.abc.Sequence[
            typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]
        ] = [],
        inertial_unit_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]
        | None = None,
    ) -> None:
        """
        centre_of_mass_m [3]: s′ in the platform frame; inertia_kg_m2 [3, 3]: about the centre of mass, platform axes. motion: 3R3T, 3T, 1R2T or 2T (turns R, shifts T); motion_plane_normal [3]: across the plane of the last two, in the world. outline_m: list of [3], corners of its body in the platform frame. inertial_unit_m [3]: where its inertial unit sits, in the platform frame. Checked when a Robot is made of it.
        """

    @property
    def centre_of_mass_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        s′ in the platform frame [3] [m]; a copy.
        """

    @property
    def inertia_kg_m2(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        About the centre of mass, platform axes [3, 3]; a copy.
        """

    @property
    def inertial_unit_m(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"] | None:
        """
        Where its inertial unit sits, in the platform frame [3] [m]; None: not known, or none.
        """

    @property
    def mass_kg(self) -> float: ...
    @property
    def motion(self) -> str:
        """
        What the platform can do: 3R3T, 3T, 1R2T or 2T (turns R, shifts T).
        """

    @property
    def motion_plane_normal(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"] | None:
        """
        Across the plane of a planar motion, in the world [3]; None for the others.
        """

    @property
    def outline_m(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]]:
        """
        Corners of its body in the platform frame, list of [3] [m]; a copy.
        """

class Surroundings:
    """
    What a platform must keep from, besides what its cables can carry. Immutable.
    """

    def __init__(
        self,
        *,
        floor_m: typing.SupportsFloat | typing.SupportsIndex = ...,
        keep_out: collections.abc.Sequence[Box] = [],
        length_limits_m: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(2)"
        ] = ...,
    ) -> None:
        """
        floor_m: z that no part of the platform goes below; keep_out: list of Box that neither platform nor cables enter; length_limits_m: (minimum, maximum) of every cable. Checked when a Robot is made of it.
        """

    @property
    def floor_m(self) -> float: ...
    @property
    def keep_out(self) -> list[Box]:
        """
        List of Box; a copy.
        """

    @property
    def length_limits_m(self) -> typing.Annotated[list[float], "FixedSize(2)"]:
        """
        [minimum, maximum] [m].
        """

class SensorSigma:
    """
    One-sigma errors of the readings (eq. 18 by default) and of the statics model. Immutable.
    """

    def __init__(
        self,
        *,
        length_m: typing.SupportsFloat | typing.SupportsIndex = 0.01,
        swivel_rad: typing.SupportsFloat | typing.SupportsIndex = 0.017453292519943295,
        attitude_rad: typing.SupportsFloat | typing.SupportsIndex = 0.03490658503988659,
        tension_N: typing.SupportsFloat | typing.SupportsIndex = 10.0,
        wrench_force_N: typing.SupportsFloat | typing.SupportsIndex = 0.0,
        wrench_moment_Nm: typing.SupportsFloat | typing.SupportsIndex = 0.0,
        **kwargs: typing.Any,
    ) -> None:
        """
        wrench_force_N, wrench_moment_Nm: what the wrench balance may be wrong by beyond the load cells; 0 means what a geometry known to 1 mm leaves. More keywords: those of absolute sensors, by the names of the attributes. Checked when used.
        """

    @property
    def absolute_yaw_rad(self) -> float:
        """
        [1] [rad]: yaw without an offset (compass, camera).
        """

    @property
    def angular_velocity_rad_s(self) -> float:
        """
        [3] [rad_s]: gyroscope, platform axes.
        """

    @property
    def attitude_rad(self) -> float: ...
    @property
    def direct_length_m(self) -> float:
        """
        [n] [m]: whole cable lengths, arc included (laser, tape).
        """

    @property
    def length_m(self) -> float: ...
    @property
    def position_m(self) -> float:
        """
        [3] [m]: of P in the world (tracker).
        """

    @property
    def specific_force_m_s2(self) -> float:
        """
        [3] [m_s2]: accelerometer, platform axes: at rest 9.81 m/s2 upward.
        """

    @property
    def swivel_rad(self) -> float: ...
    @property
    def tension_N(self) -> float: ...
    @property
    def wrench_force_N(self) -> float: ...
    @property
    def wrench_moment_Nm(self) -> float: ...

class AppliedEffect:
    """
    A known effect, or a known fault of the readings, as the robot file lists it. Immutable.
    """

    def __init__(
        self,
        *,
        name: str,
        parameters: collections.abc.Mapping[
            str, collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]
        ],
        run: str = "",
    ) -> None:
        """
        parameters: name → numbers, nested lists one after the other. run: file name of the one log it belongs to; empty: every log. Checked when a Robot is made of it.
        """

    @property
    def name(self) -> str: ...
    @property
    def parameters(self) -> dict[str, list[float]]:
        """
        Name → numbers, in the robot file's units; a copy.
        """

    @property
    def run(self) -> str: ...

class Robot:
    """
    Platform, cables on swivel pulleys, limits and sensors. Immutable; pickles as its robot file.
    """

    def __init__(
        self,
        *,
        name: str,
        platform: Platform,
        cables: collections.abc.Sequence[Cable],
        tension_limits_N: typing.Annotated[
            collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(2)"
        ],
        gravity_m_s2: typing.SupportsFloat | typing.SupportsIndex = 9.81,
        euler_convention: EulerConvention = ...,
        sigma: SensorSigma | None = None,
        effects: collections.abc.Sequence[AppliedEffect] = [],
        surroundings: Surroundings = ...,
        effect_definitions: str = "",
    ) -> None:
        """
        cables: 1 to 8 Cable; tension_limits_N: (minimum, maximum); sigma: None is eq. 18; effects: known effects and faults of the readings, as the robot file lists them; surroundings: floor, keep-out boxes, limits of length; effect_definitions: effects beside the catalogue, as text (YAML with the key effect_definitions). Checks every field and fills defaults; raises InputError naming the field.
        """

    def __repr__(self) -> str: ...
    @property
    def cable_count(self) -> int: ...
    @property
    def cables(self) -> list[Cable]:
        """
        List of n Cable; a copy.
        """

    @property
    def effect_definitions(self) -> str:
        """
        Its effects beside the catalogue as text (YAML); empty: none.
        """

    @property
    def effects(self) -> list[AppliedEffect]:
        """
        List of AppliedEffect; a copy.
        """

    @property
    def euler_convention(self) -> EulerConvention: ...
    @property
    def gravity_force_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Weight as a force in world axes [3] [N]; z points up.
        """

    @property
    def gravity_m_s2(self) -> float: ...
    @property
    def name(self) -> str: ...
    @property
    def platform(self) -> Platform: ...
    @property
    def sigma(self) -> SensorSigma: ...
    @property
    def surroundings(self) -> Surroundings: ...
    @property
    def tension_limits_N(self) -> typing.Annotated[list[float], "FixedSize(2)"]:
        """
        [minimum, maximum] [N].
        """

    @property
    def tension_max_N(self) -> float: ...
    @property
    def tension_min_N(self) -> float: ...
    @property
    def weight_N(self) -> float: ...

class CableStatus(enum.StrEnum):
    """
    Whether a cable's kinematics exist at a point.
    """

    ok = "ok"
    anchor_inside_pulley = "anchor_inside_pulley"
    anchor_on_swivel_axis = "anchor_on_swivel_axis"

class CableState:
    """
    One cable's kinematics (eqs 2–5). Vectors are unit vectors in world axes. Meaningless unless status is ok.
    """

    @property
    def contact(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        n [3]: from C to B, where the cable leaves.
        """

    @property
    def direction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        t [3]: along the cable, from B to the platform.
        """

    @property
    def free_length_m(self) -> float:
        """
        ‖rho‖ [m].
        """

    @property
    def groove_normal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        w = k × u [3].
        """

    @property
    def length_m(self) -> float:
        """
        l, eq. 5: free part plus the arc on the pulley [m].
        """

    @property
    def radial(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        u [3]: from D to the pulley centre C.
        """

    @property
    def radial_distance_m(self) -> float:
        """
        u·q [m].
        """

    @property
    def status(self) -> CableStatus: ...
    @property
    def swivel_rad(self) -> float:
        """
        sigma, eq. 2 [rad].
        """

    @property
    def tangency_rad(self) -> float:
        """
        psi, eq. 4 [rad].
        """

class CableDerivatives:
    """
    First derivatives of one cable by q [m] and pulley radius [m].
    """

    @property
    def direction_by_q(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        T of eq. A5 [3, 3].
        """

    @property
    def direction_by_radius(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [3] [1/m].
        """

    @property
    def length_by_q(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        t [3].
        """

    @property
    def length_by_radius(self) -> float: ...
    @property
    def swivel_by_q(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        w/(u·q) [3] [rad/m].
        """

    @property
    def tangency_by_q(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        n/‖rho‖ [3] [rad/m].
        """

    @property
    def tangency_by_radius(self) -> float:
        """
        [rad/m].
        """

class PlatformState:
    """
    Inverse kinematics of all cables at one pose (eqs 2–5).
    """

    @property
    def anchor_arm_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        R a′ [n, 3] [m]: from P to each platform anchor, world axes.
        """

    @property
    def cable(self) -> list[CableState]:
        """
        List of n CableState; copies.
        """

    @property
    def cable_count(self) -> int: ...
    @property
    def centre_of_mass_arm_m(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        R s′ [3] [m]: from P to the centre of mass, world axes.
        """

    @property
    def length_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Cable lengths [n] [m], eq. 5.
        """

    @property
    def rotation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
        """
        R_world_platform [3, 3].
        """

    @property
    def swivel_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Swivel angles [n] [rad], eq. 2.
        """

    @property
    def valid(self) -> bool:
        """
        Every cable's status is ok.
        """

class WrenchRow(enum.StrEnum):
    """
    Rows of the wrench in Euler-rate coordinates.
    """

    force_x = "force_x"
    force_y = "force_y"
    force_z = "force_z"
    moment_roll = "moment_roll"
    moment_pitch = "moment_pitch"
    moment_yaw = "moment_yaw"

class TensionModel:
    """
    Modelled tensions at a pose.
    """

    @property
    def by_twist(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 6]"]:
        """
        dtau/ddelta [n, 6].
        """

    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        tau [n] [N].
        """

    @property
    def valid(self) -> bool:
        """
        False: the chosen rows are singular at this pose.
        """

class EquilibriumStatus(enum.StrEnum):
    """
    found: balanced and stable, every cable pulls. obstructed: so, but for what the robot file says is in the way. unstable, infeasible (a tension beyond the robot's limits) and slack are balanced too. not_found, invalid_geometry: no pose.
    """

    found = "found"
    obstructed = "obstructed"
    unstable = "unstable"
    infeasible = "infeasible"
    slack = "slack"
    not_found = "not_found"
    invalid_geometry = "invalid_geometry"

class TensionDistribution(enum.StrEnum):
    """
    Which of the tensions that carry the weight a robot is given. barycentre: centroid of the feasible polytope; minimum_norm; mid_range: closest to the middle of the limits; given_lambda: eq. A2 with lambda as given.
    """

    barycentre = "barycentre"
    minimum_norm = "minimum_norm"
    mid_range = "mid_range"
    given_lambda = "given_lambda"

class StabilityNotion(enum.StrEnum):
    """
    locked_lengths: winches hold the cable lengths (K_f of eq. A4, the paper's criterion); constant_tensions: force control (the whole K + Q), which demands more.
    """

    locked_lengths = "locked-lengths"
    constant_tensions = "constant-tensions"

class Stability:
    """
    Smallest eigenvalues of the two stiffnesses [N/m], rotations measured as arcs at the characteristic length; positive: stable. Immutable.
    """

    @property
    def constant_tensions_N_m(self) -> float:
        """
        Of K + Q.
        """

    @property
    def locked_lengths_N_m(self) -> float:
        """
        Of K_f (eq. A4); inf when the cables leave no freedom.
        """

class EquilibriumResult:
    """
    One equilibrium, or the reason why there is none. Immutable.
    """

    def __repr__(self) -> str: ...
    @property
    def balanced(self) -> bool:
        """
        Whether the pose is an equilibrium, whatever else is wrong with it.
        """

    @property
    def evaluations(self) -> int: ...
    @property
    def length_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n], arc on the pulley included.
        """

    @property
    def pose(self) -> Pose | None:
        """
        The balanced pose; None when none was reached.
        """

    @property
    def reason(self) -> str:
        """
        One sentence; empty when found.
        """

    @property
    def residual_N(self) -> float:
        """
        ‖Ξᵀτ − f‖, moments divided by the characteristic length.
        """

    @property
    def stability(self) -> Stability: ...
    @property
    def stable(self) -> bool:
        """
        By the notion that fits the problem.
        """

    @property
    def status(self) -> EquilibriumStatus: ...
    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n]; NaN or empty when no pose was reached.
        """

class InverseResult(EquilibriumResult):
    """
    An equilibrium at a position that was asked for. Immutable.
    """

    @property
    def lambda_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n - 3], from six cables on [n - 6]: what reproduces these tensions with given_lambda.
        """

    @property
    def margin_N(self) -> float:
        """
        Of the closest tension to its limit; negative when infeasible.
        """

class Grid:
    """
    Points at equal steps in all directions. Immutable.
    """

    @property
    def box(self) -> Box: ...
    @property
    def count(self) -> typing.Annotated[list[int], "FixedSize(3)"]:
        """
        [3] along x, y, z.
        """

    @property
    def origin_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Point of index (0, 0, 0) [3].
        """

    @property
    def size(self) -> int: ...
    @property
    def step_m(self) -> float: ...

class Mesh:
    """
    Closed surface of triangles, counter-clockwise seen from outside. Immutable.
    """

    def __init__(
        self,
        vertices_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"],
        faces: typing.Annotated[numpy.typing.ArrayLike, numpy.int32, "[m, 3]"],
    ) -> None:
        """
        vertices_m [v, 3], faces [f, 3].
        """

    def contains(
        self, position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]
    ) -> bool:
        """
        Inclusion by the winding number.
        """

    def cross_section(
        self, height_m: typing.SupportsFloat | typing.SupportsIndex
    ) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]]:
        """
        Closed polygons [k, 2] at z = height_m: outer ones counter-clockwise, holes clockwise.
        """

    @property
    def area_m2(self) -> float: ...
    @property
    def faces(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 3]"]:
        """
        Vertex indices [f, 3]; a copy.
        """

    @property
    def vertices_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        [v, 3]; a copy.
        """

    @property
    def volume_m3(self) -> float: ...
    @property
    def watertight(self) -> bool:
        """
        Every edge belongs to exactly two faces that run along it in opposite directions.
        """

class MeshEncoding(enum.StrEnum):
    """
    Of a mesh file.
    """

    binary = "binary"
    ascii = "ascii"

class AlphaShape:
    """
    Boundary of a set of points. Immutable.
    """

    @property
    def alpha_m2(self) -> float:
        """
        Used; squared radius.
        """

    @property
    def components(self) -> int:
        """
        Pieces of the solid.
        """

    @property
    def mesh(self) -> Mesh: ...
    @property
    def points_outside(self) -> int: ...
    @property
    def volume_m3(self) -> float: ...
    @property
    def watertight(self) -> bool: ...

class PointStatus(enum.IntEnum):
    """
    What is known about a grid point. untested: the flood never reached its neighbourhood.
    """

    untested = 0
    inside = 1
    infeasible = 2
    unstable = 3
    no_equilibrium = 4
    obstructed = 5

class WorkspaceProgress:
    """
    How far the flood has come.
    """

    @property
    def inside(self) -> int: ...
    @property
    def tested(self) -> int: ...
    @property
    def total(self) -> int:
        """
        Points of the grid: an upper bound.
        """

class Workspace:
    """
    Static workspace on a grid. Immutable.
    """

    def __repr__(self) -> str: ...
    @property
    def boundary_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        Points inside, close to the boundary [b, 3]; a copy.
        """

    @property
    def complete(self) -> bool:
        """
        False: it was stopped, and is partial.
        """

    @property
    def grid(self) -> Grid: ...
    @property
    def inside_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        Grid points inside [m, 3]; a copy.
        """

    @property
    def points_inside(self) -> int: ...
    @property
    def points_tested(self) -> int: ...
    @property
    def quaternion_wxyz(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Equilibrium orientation at each point inside [m, 4]; a copy.
        """

    @property
    def robot(self) -> Robot:
        """
        With the effects it listed applied.
        """

    @property
    def status(self) -> numpy.typing.NDArray[numpy.uint8]:
        """
        PointStatus values [n_z, n_y, n_x]; a copy.
        """

    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Tensions at each point inside [m, n]; a copy.
        """

class SetPoint:
    """
    An equilibrium. Up to five cables of constant tensions: command them and the platform settles at the pose; from six on lengths lead it there. Immutable.
    """

    def __init__(
        self,
        pose: Pose,
        tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> None: ...
    @property
    def pose(self) -> Pose: ...
    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n].
        """

class SetPointOptions:
    """
    Which tensions hold the platform.
    """

    def __init__(
        self,
        *,
        distribution: TensionDistribution = ...,
        lambda_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...,
        tension_margin_N: typing.SupportsFloat | typing.SupportsIndex | None = None,
        rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None = None,
    ) -> None:
        """
        lambda_N [n - 3], from six cables on [n - 6]: with given_lambda. tension_margin_N: least distance from the limits; default one sigma of the load cells. rotation [3, 3]: commanded, from six cables on; default held_orientation.
        """

    @property
    def distribution(self) -> TensionDistribution: ...
    @property
    def lambda_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def tension_margin_N(self) -> float | None: ...

class PathStatus(enum.StrEnum):
    """
    Whether a transition keeps the platform stable and inside.
    """

    clear = "clear"
    unstable = "unstable"
    other_equilibrium = "other_equilibrium"
    beyond_tension_limits = "beyond_tension_limits"
    outside_workspace = "outside_workspace"

class PathPoint:
    """
    One equilibrium on the way. Immutable.
    """

    @property
    def fraction(self) -> float:
        """
        Of the tension change: 0 … 1.
        """

    @property
    def pose(self) -> Pose: ...
    @property
    def stiffness_N_m(self) -> float: ...
    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n].
        """

class Path:
    """
    What happens between two set-points. Immutable.
    """

    @property
    def points(self) -> list[PathPoint]:
        """
        Up to the failure when not clear.
        """

    @property
    def reason(self) -> str:
        """
        One sentence; empty when clear.
        """

    @property
    def status(self) -> PathStatus: ...

class KnownEffects:
    """
    The effects that a robot file lists for every run, as planning sees them. Immutable.
    """

    def __init__(self, robot: Robot) -> None: ...
    def as_planned(self, stop: SetPoint) -> SetPoint | None:
        """
        The set-point of true tensions, without forces but the weight, behind a stop of a finished plan; None when those tensions do not hold the platform.
        """

    def reading_N(
        self,
        pose: Pose,
        tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        What the load cells read under tensions [n].
        """

    def settled(
        self,
        reading_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        near: Pose,
    ) -> Pose | None:
        """
        Where the platform rests when the load cells are held at these readings [n], close to a pose: with all effects, an external force too. None when it does not settle.
        """

    def tension_N(
        self,
        pose: Pose,
        reading_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Tensions [n] behind readings of the load cells.
        """

    @property
    def robot(self) -> Robot:
        """
        The robot with their geometry and inertia, its list of effects empty.
        """

class PlannedPose:
    """
    One stop of a plan. Immutable.
    """

    @property
    def constant_tension_frequencies_hz(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Under force control [6], rising.
        """

    @property
    def dwell_s(self) -> float: ...
    @property
    def measured(self) -> bool:
        """
        False: passed through only.
        """

    @property
    def natural_frequencies_hz(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Free motions with locked cables [6 - n], rising.
        """

    @property
    def pose(self) -> Pose: ...
    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Set-point [n], as the load cells read it.
        """

    @property
    def transition_s(self) -> float:
        """
        Of the fifth-degree transition from the stop before.
        """

class Plan:
    """
    What `acquire` runs. Immutable.
    """

    def __repr__(self) -> str: ...
    def _repr_html_(self) -> str: ...
    def plot(self, ax: typing.Any = None) -> typing.Any:
        """
        Draws into a matplotlib Axes (None: a new one), which is returned.
        """

    def to_pandas(self) -> typing.Any:
        """
        A pandas.DataFrame: a row a stop, in visiting order.
        """

    @property
    def duration_s(self) -> float: ...
    @property
    def measured_count(self) -> int: ...
    @property
    def poses(self) -> list[PlannedPose]:
        """
        PlannedPose in visiting order.
        """

    @property
    def predicted_standard_deviation(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Of the initial pose [6]: position [m], world-frame rotation vector [rad]; NaN when it would not be observable.
        """

    @property
    def robot_name(self) -> str: ...
    @property
    def start_dwell_s(self) -> float: ...
    @property
    def start_pose(self) -> Pose: ...
    @property
    def start_tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        tau_0 [n], as the load cells read it.
        """

class VisitingOrder(enum.StrEnum):
    """
    least_time: each pose once; random: each several times, shuffled so that drifts and creep look like no pose.
    """

    least_time = "least-time"
    random = "random"

class TimingOptions:
    """
    What transition and dwell times are derived from. Immutable.
    """

    def __init__(
        self,
        *,
        max_platform_speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.5,
        max_cable_speed_m_s: typing.SupportsFloat | typing.SupportsIndex = 0.5,
        damping_ratio: typing.SupportsFloat | typing.SupportsIndex = 0.1,
        rest_tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.05,
        measuring_s: typing.SupportsFloat | typing.SupportsIndex = 2.0,
    ) -> None:
        """
        Peak speeds; damping ratio of every mode; ringing that counts as rest, in sigma of each sensor; rest left for measuring.
        """

    @property
    def damping_ratio(self) -> float: ...
    @property
    def max_cable_speed_m_s(self) -> float: ...
    @property
    def max_platform_speed_m_s(self) -> float: ...
    @property
    def measuring_s(self) -> float: ...
    @property
    def rest_tolerance(self) -> float: ...

class PlanStatus(enum.StrEnum):
    """
    infeasible: a pose is no set-point or cannot be reached; stopped: by the progress callback. The plan is empty unless planned.
    """

    planned = "planned"
    infeasible = "infeasible"
    stopped = "stopped"

class GridComparison:
    """
    How many poses chosen by observability the grid is worth. Immutable.
    """

    @property
    def grid_poses(self) -> int: ...
    @property
    def grid_standard_deviation(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        [6] [m, rad].
        """

    @property
    def optimal_standard_deviation(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Row k - 1: of k poses [6] [m, rad].
        """

    @property
    def poses_needed(self) -> int | None:
        """
        The fewest that are no worse in position and in rotation; None: not within those that were chosen.
        """

class ApproachCoverage:
    """
    How well an order tells the two directions apart. Immutable.
    """

    @property
    def both(self) -> int:
        """
        Pairs (pose, cable) approached paying out and reeling in.
        """

    @property
    def possible(self) -> int: ...

class PlanResult:
    """
    A plan, or why there is none. Immutable.
    """

    def __repr__(self) -> str: ...
    @property
    def approach(self) -> ApproachCoverage | None:
        """
        Of a random order.
        """

    @property
    def box(self) -> Box:
        """
        Of the grid.
        """

    @property
    def box_origin(self) -> str:
        """
        Where the box comes from.
        """

    @property
    def candidates(self) -> int:
        """
        That `optimal` chose from.
        """

    @property
    def comparison(self) -> GridComparison | None:
        """
        With `optimal`.
        """

    @property
    def order_is_optimal(self) -> bool:
        """
        Least time, proved.
        """

    @property
    def plan(self) -> Plan: ...
    @property
    def reason(self) -> str:
        """
        One sentence; empty when planned.
        """

    @property
    def status(self) -> PlanStatus: ...

class Log:
    """
    What a robot's own sensors read, one row a sample. Immutable: the arrays are read-only views of the log, which they keep alive. NaN, or no columns: that sensor is absent. Lengths, swivels and yaw carry unknown constant offsets.
    """

    @staticmethod
    def from_dataframe(frame: typing.Any, source: str = "data frame") -> Log:
        """
        From a pandas.DataFrame with the columns of a canonical log; the index is the time [s] when there is no column time_s. Raises InputError.
        """

    def __init__(
        self,
        *,
        time_s: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        length_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None,
        swivel_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None,
        tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"] | None = None,
        roll_pitch_yaw_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]
        | None = None,
        tension_setpoint_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"]
        | None = None,
        source: str = "log",
        **kwargs: typing.Any,
    ) -> None:
        """
        time_s [N] strictly increasing; per-cable arrays [N, n], roll_pitch_yaw_rad [N, 3]; more keywords: those of absolute sensors, by the names of the attributes. None: absent. `source` is what messages call it. Copies its input; what is masked is NaN. Raises InputError when shapes or times do not fit.
        """

    def __len__(self) -> int: ...
    def __repr__(self) -> str: ...
    def _repr_html_(self) -> str: ...
    def plot(self, ax: typing.Any = None) -> typing.Any:
        """
        Draws into a matplotlib Axes (None: a new one), which is returned.
        """

    def to_pandas(self) -> typing.Any:
        """
        A pandas.DataFrame: a row a sample, the columns of the canonical log.
        """

    @property
    def absolute_yaw_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, 1] or [N, 0] [rad]: yaw without an offset (compass, camera).
        """

    @property
    def angular_velocity_rad_s(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, 3] or [N, 0] [rad_s]: gyroscope, platform axes.
        """

    @property
    def cable_count(self) -> int:
        """
        Width of the widest per-cable group.
        """

    @property
    def direct_length_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, n] or [N, 0] [m]: whole cable lengths, arc included (laser, tape).
        """

    @property
    def length_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, n] or [N, 0] [m]: relative.
        """

    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, 3] or [N, 0] [m]: of P in the world (tracker).
        """

    @property
    def roll_pitch_yaw_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, 3] or [N, 0] [rad]: in the sensor's Euler convention; yaw is relative.
        """

    @property
    def sample_count(self) -> int: ...
    @property
    def source(self) -> str: ...
    @property
    def specific_force_m_s2(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, 3] or [N, 0] [m_s2]: accelerometer, platform axes: at rest 9.81 m/s2 upward.
        """

    @property
    def swivel_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, n] or [N, 0] [rad]: relative.
        """

    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, n] or [N, 0] [N]: load cells.
        """

    @property
    def tension_setpoint_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, n] or [N, 0] [N]: what the tensions were told to be.
        """

    @property
    def time_s(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [N] [s], strictly increasing.
        """

class SampleRange:
    """
    Half-open range of sample numbers. Immutable.
    """

    def __init__(
        self,
        begin: typing.SupportsInt | typing.SupportsIndex,
        end: typing.SupportsInt | typing.SupportsIndex,
    ) -> None: ...
    def __len__(self) -> int: ...
    def __repr__(self) -> str: ...
    @property
    def begin(self) -> int: ...
    @property
    def end(self) -> int: ...

class DetectionOptions:
    """
    How equilibria are detected: rest is judged window by window.
    """

    def __init__(
        self,
        *,
        window_s: typing.SupportsFloat | typing.SupportsIndex = 1.0,
        confidence: typing.SupportsFloat | typing.SupportsIndex = 0.999,
        tolerance: typing.SupportsFloat | typing.SupportsIndex = 0.05,
    ) -> None: ...
    @property
    def confidence(self) -> float:
        """
        Of the tests that 'nothing moves' is judged by.
        """

    @confidence.setter
    def confidence(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def tolerance(self) -> float:
        """
        Motion that does not matter, in units of the sensor's sigma.
        """

    @tolerance.setter
    def tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def window_s(self) -> float:
        """
        The platform must look at rest at least this long [s].
        """

    @window_s.setter
    def window_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class Equilibrium:
    """
    One interval at rest.
    """

    def __repr__(self) -> str: ...
    @property
    def begin_s(self) -> float: ...
    @property
    def end_s(self) -> float: ...
    @property
    def samples(self) -> SampleRange: ...

class EquilibriumMean:
    """
    Readings of a rest as one. Channels: lengths, swivels, tensions, roll, pitch, yaw, then those of absolute sensors, as far as the log has them; NaN: absent.
    """

    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [c, c] of the mean.
        """

    @property
    def effective_samples(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [c] how many independent readings they are worth.
        """

    @property
    def mean(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [c] m, rad, N.
        """

class Sensor:
    """
    One row of the table of sensors: a matrix of a log.
    """

    def column(self, index: typing.SupportsInt | typing.SupportsIndex) -> str:
        """
        As in a log: 'position_x_m'. Raises InputError beyond the last one.
        """

    def columns_of(self, cable_count: typing.SupportsInt | typing.SupportsIndex) -> int:
        """
        How many columns.
        """

    @property
    def about(self) -> str:
        """
        What it reads, for descriptions.
        """

    @property
    def field(self) -> str:
        """
        The attribute of a Log: 'position_m'.
        """

    @property
    def in_words(self) -> str: ...
    @property
    def is_absolute(self) -> bool:
        """
        One of those, without an offset, that few robots have.
        """

    @property
    def is_angle(self) -> bool: ...
    @property
    def is_inertial(self) -> bool:
        """
        Of an inertial unit: it reads how the platform moves.
        """

    @property
    def is_per_cable(self) -> bool:
        """
        One reading a cable; otherwise one or three of the platform.
        """

    @property
    def name(self) -> str:
        """
        'position'.
        """

    @property
    def sigma_field(self) -> str | None:
        """
        The attribute of a SensorSigma; None: it is told, not read.
        """

    @property
    def unit(self) -> str:
        """
        m, rad, N, m_s2 or rad_s.
        """

class ChannelRow:
    """
    One row of the table of channels: readings that share one noise.
    """

    @property
    def count(self) -> int:
        """
        Columns; all, if they are one a cable.
        """

    @property
    def first(self) -> int:
        """
        Of the sensor's columns.
        """

    @property
    def has_offset(self) -> bool:
        """
        Its readings count from an unknown start.
        """

    @property
    def label(self) -> str:
        """
        In tables.
        """

    @property
    def name(self) -> str:
        """
        'roll_pitch'.
        """

    @property
    def plural(self) -> str:
        """
        In sentences.
        """

    @property
    def rms_field(self) -> str:
        """
        The attribute of a ResidualRms: 'roll_pitch_rad'.
        """

    @property
    def sensor(self) -> Sensor: ...

class Signal:
    """
    How the samples of one channel come at rest.
    """

    def effective(self, samples: typing.SupportsFloat | typing.SupportsIndex) -> float:
        """
        How many independent readings so many rows hold.
        """

    @property
    def correlation_s(self) -> float:
        """
        Time constant of the filter that the noise went through; 0: none.
        """

    @property
    def hold_rows(self) -> float:
        """
        Rows a fresh reading.
        """

    @property
    def loudest(self) -> float:
        """
        What the noisiest column scatters by beside the middle one.
        """

    @property
    def resolution(self) -> float:
        """
        Step of the readings where it shows beside their noise; else 0.
        """

    @property
    def rounding(self) -> float:
        """
        The part of sigma that a mean keeps.
        """

    @property
    def rows(self) -> float:
        """
        Rows of the log worth one independent reading.
        """

    @property
    def sigma(self) -> float:
        """
        Of one reading.
        """

class ChannelNoise:
    """
    Noise of one channel, two components.
    """

    def __init__(
        self,
        pose: typing.SupportsFloat | typing.SupportsIndex,
        sample: typing.SupportsFloat | typing.SupportsIndex = 0.0,
    ) -> None: ...
    def sigma(self, samples: typing.SupportsInt | typing.SupportsIndex) -> float:
        """
        Of the mean of so many samples.
        """

    @property
    def pose(self) -> float:
        """
        sigma shared by all samples of a pose: does not average out.
        """

    @property
    def sample(self) -> float:
        """
        sigma from sample to sample, which averages out as `signal` says.
        """

    @property
    def signal(self) -> Signal:
        """
        How the samples come.
        """

class NoiseModel:
    """
    Noise by channel: length [m], swivel [rad], roll_pitch [rad], yaw [rad], balance [N], absolute_yaw [rad], direct_length [m], position [m], specific_force [m_s2], angular_velocity [rad_s]; the balance's is of a tension.
    """

    def __init__(
        self,
        channels: collections.abc.Mapping[str, ChannelNoise],
        wrench_force_N: typing.SupportsFloat | typing.SupportsIndex,
        wrench_moment_Nm: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None:
        """
        A ChannelNoise for each channel; those of absolute sensors may be left out. Raises InputError otherwise.
        """

    @property
    def channels(self) -> dict[str, ChannelNoise]:
        """
        By name; a copy.
        """

    @property
    def wrench_force_N(self) -> float:
        """
        What the balance itself is wrong by along each axis, beyond the load cells.
        """

    @property
    def wrench_moment_Nm(self) -> float:
        """
        The same, moments.
        """

class GatedReading:
    """
    A reading that was left out of the fit.
    """

    @property
    def channel(self) -> str: ...
    @property
    def component(self) -> int:
        """
        Cable or angle, from 0; 0 for a whole balance.
        """

    @property
    def reason(self) -> str:
        """
        'outlier' or 'slack'.
        """

    @property
    def size(self) -> float:
        """
        Outlier: residual over its standard deviation; slack: the tension [N].
        """

    @property
    def time_s(self) -> float: ...

class PoseKind(enum.StrEnum):
    """
    static_pose: at rest, statics hold; kinematic_pose: geometry only.
    """

    static_pose = "static"
    kinematic_pose = "kinematic"

class StaticsModel(enum.StrEnum):
    """
    none: j = lσε; left_inverse: eqs 10–12; wrench: eq. 6, all six equations.
    """

    none = "none"
    left_inverse = "left_inverse"
    wrench = "wrench"

class CalibrationStatus(enum.StrEnum):
    """
    Whether the initial pose can be trusted.
    """

    converged = "converged"
    not_converged = "not_converged"
    unobservable = "unobservable"

class Method(enum.StrEnum):
    """
    unified; statics: τlσε on equilibria ('static'); kinematic: lσε.
    """

    unified = "unified"
    statics = "static"
    kinematic = "kinematic"

class Formulation(enum.StrEnum):
    """
    full: wrench statics and all that pose 0 knows; paper: eqs 13–17.
    """

    full = "full"
    paper = "paper"

class NoiseSource(enum.StrEnum):
    """
    from_data: estimated from the readings, outliers and slack cables left out; specified: the robot file's sigma.
    """

    from_data = "data"
    specified = "specified"

class Measurement:
    """
    Readings at one pose; NaN where absent. Lengths, swivels and yaw have unknown offsets common to a problem's measurements. Immutable.
    """

    def __init__(
        self,
        *,
        time_s: typing.SupportsFloat | typing.SupportsIndex,
        kind: PoseKind,
        length_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        swivel_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        roll_pitch_yaw_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        **kwargs: typing.Any,
    ) -> None:
        """
        length_m, swivel_rad, tension_N [n]; roll_pitch_yaw_rad [3]; more keywords: those of absolute sensors, by the names of the attributes. Raises InputError when their sizes differ.
        """

    @property
    def absolute_yaw_rad(self) -> float:
        """
        [1] [rad]: yaw without an offset (compass, camera).
        """

    @property
    def angular_velocity_rad_s(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [3] [rad_s]: gyroscope, platform axes.
        """

    @property
    def balance_counts(self) -> bool:
        """
        False: its balance of forces is left out (a slack cable, an outlier).
        """

    @property
    def direct_length_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n] [m]: whole cable lengths, arc included (laser, tape).
        """

    @property
    def kind(self) -> PoseKind: ...
    @property
    def length_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n] [m].
        """

    @property
    def moves(self) -> bool:
        """
        Whether it balances in motion.
        """

    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [3] [m]: of P in the world (tracker).
        """

    @property
    def rests(self) -> bool:
        """
        Whether it is a pose at rest: one that balances without acceleration.
        """

    @property
    def roll_pitch_yaw_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [3] [rad] in the robot's Euler convention.
        """

    @property
    def samples(self) -> int:
        """
        Readings behind the mean.
        """

    @property
    def specific_force_m_s2(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [3] [m_s2]: accelerometer, platform axes: at rest 9.81 m/s2 upward.
        """

    @property
    def swivel_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n] [rad].
        """

    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n] [N].
        """

    @property
    def time_s(self) -> float: ...

class CalibrationProblem:
    """
    What is modelled and what is free (§3.1 of the paper). measurements[0] is the reference: its pose is ζ0.
    """

    def __init__(
        self,
        *,
        robot: Robot,
        measurements: collections.abc.Sequence[Measurement],
        statics: StaticsModel = ...,
        left_inverse_rows: collections.abc.Sequence[WrenchRow] = [],
        reference_attitude: bool = True,
        reference_statics: bool = True,
        reference_noise: bool = True,
        noise: NoiseModel | None = None,
    ) -> None:
        """
        noise: None is specified_noise(robot.sigma). reference_attitude, reference_statics, reference_noise: what pose 0 knows by itself and the paper leaves out. left_inverse_rows: empty means left_inverse_rows(n).
        """

    @property
    def left_inverse_rows(self) -> list[WrenchRow]: ...
    @property
    def measurements(self) -> list[Measurement]:
        """
        List of Measurement; a copy.
        """

    @property
    def noise(self) -> NoiseModel:
        """
        NoiseModel of the readings; a copy.
        """

    @property
    def reference_attitude(self) -> bool: ...
    @property
    def reference_noise(self) -> bool: ...
    @property
    def reference_statics(self) -> bool: ...
    @property
    def robot(self) -> Robot: ...
    @property
    def statics(self) -> StaticsModel: ...

class MinimiserKind(enum.StrEnum):
    """
    Who minimises: `arrowhead`, our own Levenberg-Marquardt on the problem's structure; `ceres`, Ceres on the same rows, to check.
    """

    arrowhead = "arrowhead"
    ceres = "ceres"

class SolveOptions:
    """
    How to solve.
    """

    minimiser: MinimiserKind

    def __init__(
        self,
        *,
        graduation: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [
            100.0,
            10.0,
            1.0,
        ],
        max_iterations: typing.SupportsInt | typing.SupportsIndex = 1000,
        function_tolerance: typing.SupportsFloat | typing.SupportsIndex = 1e-12,
        parameter_tolerance: typing.SupportsFloat | typing.SupportsIndex = 1e-12,
        gradient_tolerance: typing.SupportsFloat | typing.SupportsIndex = 1e-12,
        minimiser: MinimiserKind = ...,
        explain: bool = True,
    ) -> None: ...
    @property
    def explain(self) -> bool:
        """
        Whether to say which direction is least certain, and what sees it.
        """

    @explain.setter
    def explain(self, arg0: bool) -> None: ...
    @property
    def function_tolerance(self) -> float: ...
    @function_tolerance.setter
    def function_tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def gradient_tolerance(self) -> float: ...
    @gradient_tolerance.setter
    def gradient_tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def graduation(self) -> list[float]:
        """
        Factors on the standard deviations of tensions and wrenches, in turn; the last is 1. Assign a whole list: the one read is a copy.
        """

    @graduation.setter
    def graduation(
        self, arg0: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]
    ) -> None: ...
    @property
    def max_iterations(self) -> int:
        """
        Of each stage.
        """

    @max_iterations.setter
    def max_iterations(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def parameter_tolerance(self) -> float: ...
    @parameter_tolerance.setter
    def parameter_tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def settled(self) -> float:
        """
        Weights of the balance are renewed until the initial pose moves less [m, rad].
        """

    @settled.setter
    def settled(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class ResidualRms:
    """
    Root mean square of the unweighted residuals, a channel; NaN where nothing measured it.
    """

    @property
    def absolute_yaw_rad(self) -> float:
        """
        [1] [rad]: yaw without an offset (compass, camera).
        """

    @property
    def angular_velocity_rad_s(self) -> float:
        """
        [3] [rad_s]: gyroscope, platform axes.
        """

    @property
    def direct_length_m(self) -> float:
        """
        [n] [m]: whole cable lengths, arc included (laser, tape).
        """

    @property
    def length_m(self) -> float: ...
    @property
    def position_m(self) -> float:
        """
        [3] [m]: of P in the world (tracker).
        """

    @property
    def roll_pitch_rad(self) -> float: ...
    @property
    def specific_force_m_s2(self) -> float:
        """
        [3] [m_s2]: accelerometer, platform axes: at rest 9.81 m/s2 upward.
        """

    @property
    def swivel_rad(self) -> float: ...
    @property
    def tension_N(self) -> float: ...
    @property
    def wrench_force_N(self) -> float: ...
    @property
    def wrench_moment_Nm(self) -> float: ...
    @property
    def yaw_rad(self) -> float: ...

class PoseResidual:
    """
    Residuals at one pose, modelled − measured (eq. 13); NaN where absent.
    """

    @property
    def absolute_yaw_rad(self) -> float:
        """
        [1] [rad]: yaw without an offset (compass, camera).
        """

    @property
    def angular_velocity_rad_s(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [3] [rad_s]: gyroscope, platform axes.
        """

    @property
    def direct_length_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n] [m]: whole cable lengths, arc included (laser, tape).
        """

    @property
    def length_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n].
        """

    @property
    def position_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [3] [m]: of P in the world (tracker).
        """

    @property
    def roll_pitch_yaw_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [3].
        """

    @property
    def specific_force_m_s2(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        [3] [m_s2]: accelerometer, platform axes: at rest 9.81 m/s2 upward.
        """

    @property
    def swivel_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n].
        """

    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n].
        """

    @property
    def wrench(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        Ξᵀτ* − f [6] [N, Nm], world axes, about P.
        """

class CalibrationResult:
    """
    What came out. Look at status first.
    """

    @property
    def chi_square_p_value(self) -> float: ...
    @property
    def cost(self) -> float:
        """
        ½ Σ (F/σ)², eq. 14.
        """

    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"] | None:
        """
        Of ζ0 [6, 6]: position [m], world-frame rotation vector [rad]; None when ζ0 is not observable.
        """

    @property
    def covariance_holds(self) -> bool:
        """
        False: the model misfits, and the covariance leaves that out.
        """

    @property
    def initial_length_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        l(ζ0) [n].
        """

    @property
    def initial_pose(self) -> Pose | None:
        """
        poses[0] without the list of all; None when there is no pose.
        """

    @property
    def initial_swivel_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        σ(ζ0) [n].
        """

    @property
    def iterations(self) -> int: ...
    @property
    def lacks_something(self) -> bool:
        """
        The model does: an effect of the catalogue is more probable than none, or poses misfit by more than twice what the robot file says of the sensors.
        """

    @property
    def least_observed(self) -> str:
        """
        The weakest direction of the initial pose, in words, and which readings see it; empty when nothing was found.
        """

    @property
    def parameter_count(self) -> int: ...
    @property
    def poses(self) -> list[Pose]:
        """
        ζ0, ζ1 … in the order of the measurements.
        """

    @property
    def reason(self) -> str:
        """
        One sentence for people, always filled.
        """

    @property
    def reference_errors(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Estimated errors of the reference's lengths, swivels and yaw [2 n + 1] (m, rad).
        """

    @property
    def residual_count(self) -> int: ...
    @property
    def residual_rms(self) -> ResidualRms: ...
    @property
    def residuals(self) -> list[PoseResidual]:
        """
        One PoseResidual a pose.
        """

    @property
    def solve_time_s(self) -> float: ...
    @property
    def standard_deviation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        [6] [m, rad]; NaN when ζ0 is not observable.
        """

    @property
    def status(self) -> CalibrationStatus: ...

class CalibrateOptions:
    """
    How to calibrate from a log.
    """

    allow_for_effects: bool
    detection: DetectionOptions
    formulation: Formulation
    method: Method
    noise: NoiseSource | None
    solve: SolveOptions

    def __init__(
        self,
        *,
        method: Method = ...,
        formulation: Formulation = ...,
        noise: NoiseSource | None = None,
        allow_for_effects: bool = True,
        at_s: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [],
        segment: typing.SupportsInt | typing.SupportsIndex = -1,
        kinematic_spacing_s: typing.SupportsFloat | typing.SupportsIndex = 1.0,
        guess: collections.abc.Sequence[Pose] = [],
        detection: DetectionOptions | None = None,
        solve: SolveOptions | None = None,
        most_starts: typing.SupportsInt | typing.SupportsIndex = 8,
    ) -> None:
        """
        noise: where the weights come from; None: from_data for the full formulation, specified for the paper's. allow_for_effects: count in σ what effects that nobody named may do to the initial pose. at_s: times of the poses [s], the first is the reference; empty: automatic. segment: which is the run, from 0; -1 the last. kinematic_spacing_s: between samples that count as poses of their own. guess: one Pose a pose, or only ζ0; empty: automatic. most_starts: guesses of ζ0 to try while no minimum agrees with the readings; without load cells the rests alone and guesses all over the workspace follow (1: neither).
        """

    @property
    def at_s(self) -> list[float]:
        """
        A copy; assign a whole list.
        """

    @at_s.setter
    def at_s(
        self, arg0: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex]
    ) -> None: ...
    @property
    def guess(self) -> list[Pose]:
        """
        A copy; assign a whole list.
        """

    @guess.setter
    def guess(self, arg1: collections.abc.Sequence[Pose]) -> None: ...
    @property
    def kinematic_spacing_s(self) -> float: ...
    @kinematic_spacing_s.setter
    def kinematic_spacing_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def most_starts(self) -> int: ...
    @most_starts.setter
    def most_starts(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def segment(self) -> int: ...
    @segment.setter
    def segment(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...

class Calibration:
    """
    A calibration and what it was made from.
    """

    def __repr__(self) -> str: ...
    def _repr_html_(self) -> str: ...
    def plot(self, ax: typing.Any = None) -> typing.Any:
        """
        Draws into a matplotlib Axes (None: a new one), which is returned.
        """

    def to_pandas(self) -> typing.Any:
        """
        A pandas.DataFrame: a row a pose, with its time, position, angles and kind.
        """

    @property
    def equilibria(self) -> list[Equilibrium]:
        """
        Found in the run; empty with at_s.
        """

    @property
    def gated(self) -> list[GatedReading]:
        """
        Readings left out: list of GatedReading.
        """

    @property
    def kinematic_poses(self) -> int: ...
    @property
    def problem(self) -> CalibrationProblem:
        """
        What was solved; it can be solved again.
        """

    @property
    def reference_time_s(self) -> float: ...
    @property
    def result(self) -> CalibrationResult: ...
    @property
    def static_poses(self) -> int:
        """
        The reference included, when it is one.
        """
    caveats: tuple[typing.Any, ...]

class ParameterShape(enum.StrEnum):
    """
    How many numbers a parameter has: 1, n, 3 or n × 3.
    """

    scalar = "scalar"
    per_cable = "per_cable"
    vector3 = "vector3"
    per_cable_vector3 = "per_cable_vector3"

class EffectScope(enum.StrEnum):
    """
    robot: the same in every run; run: differs from run to run.
    """

    robot = "robot"
    run = "run"

class Shows(enum.StrEnum):
    """
    What it takes for readings to show an effect: at_rest: any readings; in_motion: those of a platform that moves; in_moving_balance: the balance of forces and inertia there (diagnose with motion).
    """

    at_rest = "at_rest"
    in_motion = "in_motion"
    in_moving_balance = "in_moving_balance"

class EffectParameter:
    """
    One parameter of an effect.
    """

    def times_reference(self, robot: Robot) -> float:
        """
        How many times as large both are on this robot.
        """

    @property
    def name(self) -> str:
        """
        Key in the robot file, with the unit as suffix.
        """

    @property
    def of(self) -> str:
        """
        What a size, as files have it, grows with from robot to robot; empty: it is the same on every robot.
        """

    @property
    def plausible(self) -> float:
        """
        Largest size that is believable there; internal value as `typical`.
        """

    @property
    def shape(self) -> ParameterShape: ...
    @property
    def typical(self) -> float:
        """
        Size to expect on the reference robot, irma4: one sigma of the prior. Of the internal value: for a stiffness, of its inverse.
        """

    @property
    def unit(self) -> str: ...

class EffectInfo:
    """
    One effect: of the catalogue, or a robot's own.
    """

    def __repr__(self) -> str: ...
    @property
    def all_or_nothing(self) -> bool:
        """
        There or not (a slip of whoever wrote the robot file, a hose), not a deviation that every robot has a little of.
        """

    @property
    def confused_with(self) -> list[str]:
        """
        Names of effects that look alike.
        """

    @property
    def equation(self) -> str:
        """
        measured = …
        """

    @property
    def formulas(self) -> dict[str, str]:
        """
        What it adds, by what it adds to, of an effect written as text; else empty.
        """

    @property
    def inverse(self) -> bool:
        """
        The robot file has the inverse of the internal values: a stiffness.
        """

    @property
    def name(self) -> str: ...
    @property
    def on_request(self) -> bool:
        """
        Fitted where DiagnoseOptions.effects name it, never searched for: other things look alike.
        """

    @property
    def one_sided(self) -> bool:
        """
        Nature has it in one sign only.
        """

    @property
    def parameters(self) -> list[EffectParameter]: ...
    @property
    def remedy(self) -> str:
        """
        For people: what to do about it on the robot.
        """

    @property
    def scope(self) -> EffectScope: ...
    @property
    def sentence(self) -> str:
        """
        For people: what it is.
        """

    @property
    def settle(self) -> str:
        """
        What measurement would tell it from its rivals.
        """

    @property
    def shows(self) -> Shows: ...

class Verdict(enum.StrEnum):
    """
    consistent: nothing is missing; explained: the named effects explain it; described: a formula does, no name; unexplained: something is left that no effect explains; undetermined: too little was measured to say, or progress stopped it.
    """

    consistent = "consistent"
    explained = "explained"
    unexplained = "unexplained"
    undetermined = "undetermined"
    described = "described"

class DiscreteFault:
    """
    A sign, an order, a unit or a convention that was wrong.
    """

    @property
    def convention(self) -> EulerConvention | None:
        """
        Of an euler_convention: the right one; else None.
        """

    @property
    def log_evidence(self) -> float:
        """
        Nats, of one found beside effects; NaN of one found before any.
        """

    @property
    def name(self) -> str: ...
    @property
    def parameter(self) -> str: ...
    @property
    def rivals(self) -> list[str]:
        """
        Other faults with which the readings agree as well, and the initial pose is another.
        """

    @property
    def swivel_order(self) -> list[float]:
        """
        Of a cable_order: the same for the swivel encoders; empty where it is `values`.
        """

    @property
    def tension_order(self) -> list[float]:
        """
        Of a cable_order: the load cells' where it differs from the encoders'; else empty.
        """

    @property
    def text(self) -> str:
        """
        One phrase for people.
        """

    @property
    def values(self) -> list[float]: ...

class NamedEffect:
    """
    An effect that was accepted.
    """

    @property
    def described(self) -> bool:
        """
        A formula that the search wrote, not a name.
        """

    @property
    def held_out_after(self) -> float:
        """
        The same with it.
        """

    @property
    def held_out_before(self) -> float:
        """
        ½ Σ (residual/σ)² a held-out pose without the effect.
        """

    @property
    def info(self) -> EffectInfo: ...
    @property
    def log_evidence(self) -> float:
        """
        Against its absence [nat].
        """

    @property
    def p_value(self) -> float:
        """
        Family-wise.
        """

    @property
    def rivals(self) -> list[str]:
        """
        What these poses cannot tell it from.
        """

    @property
    def standard_deviation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Of each value.
        """

    @property
    def values(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        In reported units, parameter after parameter; of an effect of the run, for each log in turn.
        """

    @property
    def where(self) -> dict[str, float]:
        """
        Of a step (cable_slip, load_cell_shift, swivel_shift …): time_s since the run's first sample, and of a cable's the cable from 1.
        """

class RejectedEffect:
    """
    An effect that was not accepted, and why.
    """

    @property
    def name(self) -> str: ...
    @property
    def reason(self) -> str: ...

class Unexplained:
    """
    What no effect of the catalogue explains.
    """

    @property
    def cable(self) -> int:
        """
        The only one that depends so, from 0; -1: several, or of no cable.
        """

    @property
    def channel(self) -> str: ...
    @property
    def depends_on(self) -> str: ...
    @property
    def rms(self) -> float:
        """
        Of what is left, in the channel's unit.
        """

    @property
    def sigma(self) -> float:
        """
        Of the readings' own ripple.
        """

class Wandering:
    """
    Errors of a channel that wander with time: counted as noise.
    """

    @property
    def channel(self) -> str: ...
    @property
    def rms(self) -> float:
        """
        Over the rests; m, rad or N.
        """

    @property
    def sigma(self) -> float:
        """
        The robot file's, in the same unit.
        """

class OwnErrors:
    """
    Errors of one sensor, anew at every rest, beyond those of its like: counted as noise.
    """

    @property
    def at_s(self) -> float:
        """
        Since the run's first sample: the one rest at which it is off. NaN: several.
        """

    @property
    def column(self) -> str:
        """
        As a log calls it: ``length_3_m``.
        """

    @property
    def like(self) -> float:
        """
        The noise of its like, in the same unit.
        """

    @property
    def rms(self) -> float:
        """
        Over the rests, in the column's unit.
        """

    @property
    def sigma(self) -> float:
        """
        The robot file's, in the same unit.
        """

class Discrepancy:
    """
    What the model lacks and nobody could name or describe, as a smooth function of the place (Kennedy and O'Hagan, 2001) that takes part in the covariance of the pose and in the effects' standard deviations.
    """

    @property
    def channels(self) -> list[Wandering]:
        """
        Wandering, by channel: what stands out of the noise.
        """

    @property
    def reach_m(self) -> float:
        """
        As far apart as two places are whose errors differ; NaN where it is empty.
        """

class Gap:
    """
    Residuals of one channel after one step.
    """

    @property
    def after_effect(self) -> str:
        """
        Empty before any.
        """

    @property
    def channel(self) -> str: ...
    @property
    def held_out_rms(self) -> float:
        """
        On the poses left out of the fit.
        """

    @property
    def train_rms(self) -> float:
        """
        On the poses that the model was fitted on.
        """

class Identifiability:
    """
    What a log could see of an effect.
    """

    @property
    def detectable(self) -> float:
        """
        Smallest size that would show, in typical sizes.
        """

    @property
    def detectable_after(self) -> float:
        """
        The same with the accepted effects in the model.
        """

    @property
    def name(self) -> str: ...
    @property
    def visible(self) -> bool: ...

class PathState:
    """
    From which side each cable and swivel came to where it is, row by row.
    """

    @property
    def attitude_rate_rad_s(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, 3] of roll, pitch, yaw.
        """

    @property
    def length_direction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, n] s in [-1, 1]: +1 after paying out.
        """

    @property
    def length_rate_m_s(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, n] slopes over 0.6 s.
        """

    @property
    def swivel_direction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, n] the same for the swivels; +1 after a positive turn.
        """

    @property
    def swivel_rate_rad_s(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        [N, n] the same.
        """

class DiagnosisModel:
    """
    A fitted model of a robot's runs.
    """

    @property
    def floor(self) -> typing.Annotated[list[float], "FixedSize(20)"]:
        """
        The readings' own ripple, as `noise`.
        """

    @property
    def noise(self) -> typing.Annotated[list[float], "FixedSize(20)"]:
        """
        Estimated noise of length [m], swivel, roll and pitch, yaw [rad], and of the balance [in sigma of the load cells].
        """

    @property
    def pose_count(self) -> int: ...
    @property
    def run_names(self) -> list[str]: ...

class ModelResidual:
    """
    What a model leaves at one pose.
    """

    @property
    def residual(self) -> PoseResidual:
        """
        tension_N: the smallest change of tensions that would balance the platform.
        """

    @property
    def run(self) -> int:
        """
        From 0.
        """

    @property
    def run_time_s(self) -> float:
        """
        Since the run's first sample.
        """

class CoursePoint:
    """
    A formula at one pose, and what was read there.
    """

    @property
    def added(self) -> float:
        """
        By the formula.
        """

    @property
    def cable(self) -> int:
        """
        From 0; -1: of all cables.
        """

    @property
    def read(self) -> float:
        """
        Reading - model without the formula.
        """

    @property
    def run(self) -> int:
        """
        From 0.
        """

    @property
    def x(self) -> float:
        """
        The variable.
        """

class Course:
    """
    A formula against the first of its variables.
    """

    @property
    def points(self) -> list[CoursePoint]: ...
    @property
    def to(self) -> str:
        """
        What it adds to.
        """

    @property
    def variable(self) -> str: ...

class CandidateScore:
    """
    How well one effect would explain a gap.
    """

    @property
    def detectable(self) -> float:
        """
        In typical sizes.
        """

    @property
    def log_evidence(self) -> float:
        """
        Against its absence [nat].
        """

    @property
    def name(self) -> str: ...
    @property
    def p_value(self) -> float:
        """
        Family-wise.
        """

    @property
    def visible(self) -> bool: ...

class DiagnoseOptions:
    """
    When an effect is accepted.
    """

    def __init__(
        self,
        *,
        family_wise_p: typing.SupportsFloat | typing.SupportsIndex = 0.01,
        least_evidence: typing.SupportsFloat | typing.SupportsIndex = 3.0,
        rival_nats: typing.SupportsFloat | typing.SupportsIndex = 3.0,
        rival_share: typing.SupportsFloat | typing.SupportsIndex = 0.8,
        most_effects: typing.SupportsInt | typing.SupportsIndex = 12,
        refits: typing.SupportsInt | typing.SupportsIndex = 5,
        draws: typing.SupportsInt | typing.SupportsIndex = 999,
        seed: typing.SupportsInt | typing.SupportsIndex = 1,
        effects: collections.abc.Sequence[str] | None = None,
        faults: collections.abc.Sequence[DiscreteFault] | None = None,
        motion: bool = False,
    ) -> None:
        """
        family_wise_p: chance that a clean log is accused of anything. least_evidence, rival_nats [nat]. rival_share: of a signature that a rival imitates. refits: candidates refitted a round. draws, seed: of the chance residuals behind p-values. effects: names to fit in this order with no search, None to search; the verdict is then no better than undetermined. faults: those of an earlier diagnosis of these logs, set right with no search; None to look for them. motion: moments at which the platform moves count as rests do, all along a log that never rests.
        """

    @property
    def draws(self) -> int: ...
    @draws.setter
    def draws(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def effects(self) -> list[str] | None:
        """
        Names to fit with no search; None: search.
        """

    @effects.setter
    def effects(self, arg0: collections.abc.Sequence[str] | None) -> None: ...
    @property
    def family_wise_p(self) -> float: ...
    @family_wise_p.setter
    def family_wise_p(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def faults(self) -> list[DiscreteFault] | None:
        """
        Set right with no search; None: looked for.
        """

    @faults.setter
    def faults(self, arg0: collections.abc.Sequence[DiscreteFault] | None) -> None: ...
    @property
    def least_evidence(self) -> float: ...
    @least_evidence.setter
    def least_evidence(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def most_effects(self) -> int: ...
    @most_effects.setter
    def most_effects(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def motion(self) -> bool:
        """
        Whether moments of motion count as rests do.
        """

    @motion.setter
    def motion(self, arg0: bool) -> None: ...
    @property
    def refits(self) -> int: ...
    @refits.setter
    def refits(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def rival_nats(self) -> float: ...
    @rival_nats.setter
    def rival_nats(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def rival_share(self) -> float: ...
    @rival_share.setter
    def rival_share(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def seed(self) -> int: ...
    @seed.setter
    def seed(self, arg1: typing.SupportsInt | typing.SupportsIndex) -> None: ...

class Diagnosis:
    """
    What the model lacks. Look at verdict first.
    """

    def __repr__(self) -> str: ...
    def _repr_html_(self) -> str: ...
    def plot(self, ax: typing.Any = None) -> typing.Any:
        """
        Draws into a matplotlib Axes (None: a new one), which is returned.
        """

    def to_pandas(self) -> typing.Any:
        """
        A pandas.DataFrame: a row a number that was found, with its deviation and unit.
        """

    @property
    def baseline(self) -> DiagnosisModel:
        """
        Fitted before any effect.
        """

    @property
    def corrected(self) -> Robot:
        """
        The robot with what was found; to_yaml writes it as a robot file.
        """

    @property
    def covariance_after(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        As covariance_before.
        """

    @property
    def covariance_before(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        [6, 6] position [m], world-frame rotation vector [rad].
        """

    @property
    def discrepancy(self) -> Discrepancy:
        """
        Its channels are empty where nothing is left, or nothing that changes with the place.
        """

    @property
    def effects(self) -> list[NamedEffect]:
        """
        NamedEffect, in the order accepted.
        """

    @property
    def faults(self) -> list[DiscreteFault]:
        """
        DiscreteFault, in the order found.
        """

    @property
    def gap(self) -> list[Gap]:
        """
        Before any effect and after each.
        """

    @property
    def gated(self) -> list[str]:
        """
        Readings left out, for people.
        """

    @property
    def identifiability(self) -> list[Identifiability]: ...
    @property
    def initial_pose_after(self) -> Pose:
        """
        Of the first log; calibrate's where one log is consistent.
        """

    @property
    def initial_pose_before(self) -> Pose:
        """
        Of the first log; calibrate's where one log is consistent.
        """

    @property
    def misfit(self) -> str:
        """
        By what the readings misfit although nothing was found, where that may well be an effect; else empty.
        """

    @property
    def model(self) -> DiagnosisModel:
        """
        Fitted with the effects.
        """

    @property
    def next(self) -> list[str]:
        """
        What would settle a tie, for people.
        """

    @property
    def own_errors(self) -> list[OwnErrors]:
        """
        OwnErrors of single sensors. Empty: all of a channel are alike.
        """

    @property
    def ranking(self) -> list[CandidateScore]:
        """
        CandidateScore of all effects on the baseline, best first; their p_value is not drawn.
        """

    @property
    def reason(self) -> str:
        """
        One sentence for people.
        """

    @property
    def rejected(self) -> list[RejectedEffect]: ...
    @property
    def unexplained(self) -> list[Unexplained]: ...
    @property
    def verdict(self) -> Verdict: ...
    @property
    def wandering(self) -> list[Wandering]:
        """
        Wandering, by channel. Empty: errors come anew at every rest.
        """

class ComparedNumber:
    """
    One number of an effect, log by log.
    """

    @property
    def chi_square(self) -> float:
        """
        Against their weighted mean.
        """

    @property
    def entry(self) -> int:
        """
        Of the parameter's numbers, from 0.
        """

    @property
    def from_log(self) -> int:
        """
        Where one step explains most: the first log after it, from 1.
        """

    @property
    def info(self) -> EffectInfo: ...
    @property
    def moved(self) -> bool: ...
    @property
    def p_value(self) -> float:
        """
        Family-wise.
        """

    @property
    def parameter(self) -> int:
        """
        Of info.parameters, from 0.
        """

    @property
    def standard_deviation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [logs].
        """

    @property
    def step(self) -> float:
        """
        From the logs before to those after.
        """

    @property
    def step_deviation(self) -> float: ...
    @property
    def values(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [logs], in reported units; NaN: no fit.
        """

class Comparison:
    """
    One robot over time, log by log.
    """

    def __repr__(self) -> str: ...
    @property
    def complete(self) -> bool:
        """
        False: progress stopped it.
        """

    @property
    def covariance(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]]:
        """
        [6, 6] of it, one a log.
        """

    @property
    def faults(self) -> list[DiscreteFault]:
        """
        DiscreteFault of any log, set right in all.
        """

    @property
    def initial_pose(self) -> list[Pose]:
        """
        One a log.
        """

    @property
    def logs(self) -> list[str]:
        """
        Their names.
        """

    @property
    def not_settled(self) -> list[str]:
        """
        Logs that not all effects could be fitted to.
        """

    @property
    def numbers(self) -> list[ComparedNumber]:
        """
        ComparedNumber, effect after effect.
        """

class StopSeparation:
    """
    Expected evidence between an effect and its rival [nat].
    """

    @property
    def apart_with_all(self) -> bool:
        """
        Whether a diagnosis with all of them would not call it a rival any more.
        """

    @property
    def nats(self) -> float:
        """
        By the log so far.
        """

    @property
    def nats_with(self) -> list[float]:
        """
        With each of the stops.
        """

    @property
    def nats_with_all(self) -> float: ...

class ForeseenEffect:
    """
    What a planned run would say of an effect.
    """

    @property
    def detectable(self) -> float:
        """
        Smallest size that would show, in typical sizes; NaN: none.
        """

    @property
    def imitated(self) -> list[float]:
        """
        Share of its signature that each of Foresight.names would imitate.
        """

    @property
    def info(self) -> EffectInfo: ...

class Foresight:
    """
    Which effects a planned run would see and tell apart.
    """

    @property
    def effects(self) -> list[ForeseenEffect]:
        """
        Those asked for.
        """

    @property
    def names(self) -> list[str]:
        """
        Of all effects that rest can show.
        """

    @property
    def poses(self) -> int:
        """
        Rests that count.
        """

class RandomNormal:
    """
    Normal random numbers that are the same on every platform.
    """

    def __call__(self) -> float:
        """
        Standard normal.
        """

    def __init__(self, seed: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def uniform(self) -> float:
        """
        In (0, 1).
        """

class ReadingNoise:
    """
    White noise of the readings, one sigma; 0: exact readings. Absolute sensors with NaN are not there. Immutable.
    """

    def __init__(
        self,
        *,
        length_m: typing.SupportsFloat | typing.SupportsIndex = 0.0,
        swivel_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0,
        roll_pitch_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0,
        yaw_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0,
        tension_N: typing.SupportsFloat | typing.SupportsIndex = 0.0,
        **kwargs: typing.Any,
    ) -> None:
        """
        More keywords: those of absolute sensors, by the names of the attributes.
        """

    @property
    def absolute_yaw_rad(self) -> float:
        """
        [1] [rad]: yaw without an offset (compass, camera).
        """

    @property
    def angular_velocity_rad_s(self) -> float:
        """
        [3] [rad_s]: gyroscope, platform axes.
        """

    @property
    def direct_length_m(self) -> float:
        """
        [n] [m]: whole cable lengths, arc included (laser, tape).
        """

    @property
    def length_m(self) -> float: ...
    @property
    def position_m(self) -> float:
        """
        [3] [m]: of P in the world (tracker).
        """

    @property
    def roll_pitch_rad(self) -> float: ...
    @property
    def specific_force_m_s2(self) -> float:
        """
        [3] [m_s2]: accelerometer, platform axes: at rest 9.81 m/s2 upward.
        """

    @property
    def swivel_rad(self) -> float: ...
    @property
    def tension_N(self) -> float: ...
    @property
    def yaw_rad(self) -> float: ...

class ReadingOffsets:
    """
    Constant offsets of the relative readings. Immutable.
    """

    def __init__(
        self,
        *,
        length_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        swivel_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        yaw_rad: typing.SupportsFloat | typing.SupportsIndex = 0.0,
    ) -> None:
        """
        length_m, swivel_rad [n].
        """

    @property
    def length_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n] [m].
        """

    @property
    def swivel_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n] [rad].
        """

    @property
    def yaw_rad(self) -> float: ...

class SyntheticLogOptions:
    """
    How a run is made.
    """

    noise: ReadingNoise

    def __init__(
        self,
        *,
        dwell_s: typing.SupportsFloat | typing.SupportsIndex = 5.0,
        move_s: typing.SupportsFloat | typing.SupportsIndex = 5.0,
        rate_Hz: typing.SupportsFloat | typing.SupportsIndex = 10.0,
        noise: ReadingNoise | None = None,
        wrench_force_N: typing.SupportsFloat | typing.SupportsIndex = 0.0,
        wrench_moment_Nm: typing.SupportsFloat | typing.SupportsIndex = 0.0,
        seed: typing.SupportsInt | typing.SupportsIndex = 1,
    ) -> None:
        """
        noise None: none. wrench_force_N, wrench_moment_Nm: what the balance is wrong by along each axis, drawn anew for every set-point.
        """

    @property
    def dwell_s(self) -> float:
        """
        At every set-point, the first included.
        """

    @dwell_s.setter
    def dwell_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def move_s(self) -> float:
        """
        Fifth-degree transition between two set-points.
        """

    @move_s.setter
    def move_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def rate_Hz(self) -> float: ...
    @rate_Hz.setter
    def rate_Hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def seed(self) -> int: ...
    @seed.setter
    def seed(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def wrench_force_N(self) -> float: ...
    @wrench_force_N.setter
    def wrench_force_N(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def wrench_moment_Nm(self) -> float: ...
    @wrench_moment_Nm.setter
    def wrench_moment_Nm(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class SyntheticLog:
    """
    A log and its truth.
    """

    @property
    def log(self) -> Log: ...
    @property
    def poses(self) -> list[Pose]:
        """
        Truth, one Pose a sample; the first is the initial pose.
        """

class InjectedEffect:
    """
    An imperfection of the simulated robot: name and values, its parameters one after the other. Immutable.
    """

    def __init__(
        self,
        name: str,
        values: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
    ) -> None: ...
    def __repr__(self) -> str: ...
    def __str__(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def values(self) -> list[float]: ...

class WinchMode(enum.StrEnum):
    """
    velocity: the drive follows a commanded speed. tension: it has its own tension loop. torque: the motor pulls with a commanded tension.
    """

    velocity = "velocity"
    tension = "tension"
    torque = "torque"

class StrandOptions:
    """
    Cables of the simulated robot.
    """

    def __init__(self, **kwargs: typing.Any) -> None: ...
    @property
    def axial_stiffness_N(self) -> float:
        """
        EA; 0: 10 MN on irma4, and in proportion to the weight.
        """

    @axial_stiffness_N.setter
    def axial_stiffness_N(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def damping_ratio(self) -> float: ...
    @damping_ratio.setter
    def damping_ratio(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class PlatformDamping:
    """
    E-folding times of a free oscillation [s]; inf: no damping.
    """

    def __init__(self, **kwargs: typing.Any) -> None: ...
    @property
    def rotation_decay_s(self) -> float: ...
    @rotation_decay_s.setter
    def rotation_decay_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def translation_decay_s(self) -> float: ...
    @translation_decay_s.setter
    def translation_decay_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class WinchOptions:
    """
    Drives of the simulated robot.
    """

    mode: WinchMode

    def __init__(self, **kwargs: typing.Any) -> None: ...
    @property
    def drum_damping_Nms(self) -> float: ...
    @drum_damping_Nms.setter
    def drum_damping_Nms(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def drum_inertia_kg_m2(self) -> float: ...
    @drum_inertia_kg_m2.setter
    def drum_inertia_kg_m2(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def drum_radius_m(self) -> float: ...
    @drum_radius_m.setter
    def drum_radius_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def max_velocity_m_s(self) -> float: ...
    @max_velocity_m_s.setter
    def max_velocity_m_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def tension_gain_m_s_N(self) -> float: ...
    @tension_gain_m_s_N.setter
    def tension_gain_m_s_N(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def tension_noise_N(self) -> float:
        """
        NaN: 0.2 N on irma4, and in proportion to the weight.
        """

    @tension_noise_N.setter
    def tension_noise_N(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def time_constant_s(self) -> float: ...
    @time_constant_s.setter
    def time_constant_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class SensorChannel:
    """
    One kind of sensor; noise (one sigma), resolution and bias in the unit of the reading.
    """

    def __init__(self, **kwargs: typing.Any) -> None: ...
    @property
    def bias(self) -> float: ...
    @bias.setter
    def bias(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def delay_s(self) -> float: ...
    @delay_s.setter
    def delay_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def noise(self) -> float: ...
    @noise.setter
    def noise(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def rate_Hz(self) -> float: ...
    @rate_Hz.setter
    def rate_Hz(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def resolution(self) -> float: ...
    @resolution.setter
    def resolution(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class SensorOptions:
    """
    Sensors of the simulated robot.
    """

    length_m: SensorChannel
    random_offsets: bool
    roll_pitch_rad: SensorChannel
    swivel_rad: SensorChannel
    tension_N: SensorChannel
    yaw_rad: SensorChannel

    def __init__(self, **kwargs: typing.Any) -> None: ...
    @property
    def angular_velocity_bias_rad_s(self) -> float: ...
    @angular_velocity_bias_rad_s.setter
    def angular_velocity_bias_rad_s(
        self, arg0: typing.SupportsFloat | typing.SupportsIndex
    ) -> None: ...
    @property
    def angular_velocity_noise_rad_s(self) -> float: ...
    @angular_velocity_noise_rad_s.setter
    def angular_velocity_noise_rad_s(
        self, arg0: typing.SupportsFloat | typing.SupportsIndex
    ) -> None: ...
    @property
    def specific_force_bias_m_s2(self) -> float: ...
    @specific_force_bias_m_s2.setter
    def specific_force_bias_m_s2(
        self, arg0: typing.SupportsFloat | typing.SupportsIndex
    ) -> None: ...
    @property
    def specific_force_noise_m_s2(self) -> float: ...
    @specific_force_noise_m_s2.setter
    def specific_force_noise_m_s2(
        self, arg0: typing.SupportsFloat | typing.SupportsIndex
    ) -> None: ...

class SimulatorOptions:
    """
    What the simulated robot is made of.
    """

    damping: PlatformDamping
    sensors: SensorOptions
    strand: StrandOptions
    winch: WinchOptions

    def __init__(self, **kwargs: typing.Any) -> None: ...
    @property
    def effects(self) -> list[InjectedEffect]: ...
    @effects.setter
    def effects(self, arg0: collections.abc.Sequence[InjectedEffect]) -> None: ...
    @property
    def seed(self) -> int: ...
    @seed.setter
    def seed(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def step_s(self) -> float: ...
    @step_s.setter
    def step_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class RobotSample:
    """
    Readings of a robot's drives and AHRS as they arrive; NaN: absent.
    """

    def __init__(self, **kwargs: typing.Any) -> None: ...
    @property
    def angular_velocity_rad_s(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @angular_velocity_rad_s.setter
    def angular_velocity_rad_s(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]
    ) -> None: ...
    @property
    def attitude_time_s(self) -> float: ...
    @attitude_time_s.setter
    def attitude_time_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def drive_error(self) -> str:
        """
        Not empty: a drive is not operational, and why.
        """

    @drive_error.setter
    def drive_error(self, arg0: str) -> None: ...
    @property
    def drives_time_s(self) -> float:
        """
        When lengths, swivels and tensions last arrived; NaN: now.
        """

    @drives_time_s.setter
    def drives_time_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def host_error(self) -> str:
        """
        Not empty: this computer cannot go on (disk full), and why.
        """

    @host_error.setter
    def host_error(self, arg0: str) -> None: ...
    @property
    def length_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n], growing as cable is paid out.
        """

    @length_m.setter
    def length_m(
        self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> None: ...
    @property
    def roll_pitch_yaw_rad(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @roll_pitch_yaw_rad.setter
    def roll_pitch_yaw_rad(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]
    ) -> None: ...
    @property
    def specific_force_m_s2(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
        """
        Of an inertial unit, platform axes [3].
        """

    @specific_force_m_s2.setter
    def specific_force_m_s2(
        self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]
    ) -> None: ...
    @property
    def stop_requested(self) -> bool:
        """
        The operator wants to stop.
        """

    @stop_requested.setter
    def stop_requested(self, arg0: bool) -> None: ...
    @property
    def swivel_rad(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n], or empty.
        """

    @swivel_rad.setter
    def swivel_rad(
        self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> None: ...
    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n]
        """

    @tension_N.setter
    def tension_N(
        self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> None: ...
    @property
    def time_s(self) -> float:
        """
        The backend's clock, now.
        """

    @time_s.setter
    def time_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class PlantEnergy:
    """
    Energy of the simulated plant by kind [J]: conserved without damping, friction and winches.
    """

    @property
    def drums_J(self) -> float: ...
    @property
    def elastic_J(self) -> float: ...
    @property
    def gravity_J(self) -> float: ...
    @property
    def kinetic_J(self) -> float: ...
    @property
    def pulled_J(self) -> float: ...
    @property
    def total_J(self) -> float: ...
    @property
    def wound_J(self) -> float: ...

class PlantTruth:
    """
    What the sensors of the simulated robot do not say.
    """

    @property
    def direction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n] direction of cable motion in [-1, 1]; +1 after paying out.
        """

    @property
    def energy(self) -> PlantEnergy: ...
    @property
    def load_cell_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def pose(self) -> Pose: ...
    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def time_s(self) -> float: ...
    @property
    def twist(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        [6] of P: m/s, rad/s, world axes.
        """

class RestResult:
    """
    Whether the robot could be put somewhere at rest.
    """

    @property
    def found(self) -> bool: ...
    @property
    def pose(self) -> Pose: ...
    @property
    def reason(self) -> str: ...
    @property
    def tension_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...

class Simulator:
    """
    A simulated robot on a virtual clock. The same seed, options and commands give the same readings to the last bit.
    """

    def __init__(self, robot: Robot, options: SimulatorOptions = ...) -> None: ...
    def advance(self, duration_s: typing.SupportsFloat | typing.SupportsIndex) -> bool:
        """
        Lets time pass. False: the platform ran into a pulley; the world stands still then.
        """

    def command_each(
        self,
        velocity_m_s: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        by_tension: collections.abc.Sequence[bool],
    ) -> None:
        """
        Each drive by itself, n values each: True its tension, False its speed of pay-out.
        """

    def command_tension(
        self, tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> None:
        """
        Set-points of the drives' tension loops, or motor tensions [N].
        """

    def command_velocity(
        self, velocity_m_s: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ) -> None:
        """
        Speeds of pay-out [m/s], n values.
        """

    def hold(self) -> None:
        """
        Winches stopped and locked.
        """

    def push(
        self,
        velocity_m_s: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        body_rate_rad_s: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    ) -> None:
        """
        Sets the platform moving: centre of mass [m/s, world], rate [rad/s, platform].
        """

    def read(self) -> RobotSample:
        """
        The latest readings.
        """

    def reset(
        self,
        tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        near: Pose | None = None,
    ) -> RestResult:
        """
        At rest under these true tensions [N], n values > 0, at the equilibrium closest to `near`. Time, sensors and noise start over. When none is found nothing has changed.
        """

    def reset_at(self, pose: Pose) -> RestResult:
        """
        At rest with the cable lengths of this pose, winches locked.
        """

    def reset_held(
        self,
        pose: Pose,
        tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> RestResult:
        """
        At rest at this very pose, held by the lengths of six cables and more, under the tensions in balance there that are closest to these [N].
        """

    def truth(self) -> PlantTruth: ...
    @property
    def crashed(self) -> str:
        """
        Why the world stands still; or ''.
        """

    @property
    def offsets(self) -> ReadingOffsets:
        """
        Constant offsets of the readings.
        """

    @property
    def time_s(self) -> float: ...

class TensionControlOptions:
    """
    Tension loop over winches in velocity mode.
    """

    def __init__(self, **kwargs: typing.Any) -> None: ...
    @property
    def axial_stiffness_N(self) -> float: ...
    @axial_stiffness_N.setter
    def axial_stiffness_N(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def bandwidth(self) -> float: ...
    @bandwidth.setter
    def bandwidth(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def direction_error(self) -> float: ...
    @direction_error.setter
    def direction_error(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def filter(self) -> float: ...
    @filter.setter
    def filter(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def locked_bandwidth_1_s(self) -> float: ...
    @locked_bandwidth_1_s.setter
    def locked_bandwidth_1_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class RestOptions:
    """
    How rest is judged while it happens.
    """

    def __init__(self, **kwargs: typing.Any) -> None: ...
    @property
    def confidence(self) -> float: ...
    @confidence.setter
    def confidence(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def tolerance(self) -> float:
        """
        In the sensor's sigma.
        """

    @tolerance.setter
    def tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def window_s(self) -> float: ...
    @window_s.setter
    def window_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class WatchdogOptions:
    """
    When the robot is stopped.
    """

    def __init__(self, **kwargs: typing.Any) -> None: ...
    def slack_N(self, robot: Robot) -> float:
        """
        Tension below which a cable of a robot is slack [N].
        """

    @property
    def attitude_stale_s(self) -> float: ...
    @attitude_stale_s.setter
    def attitude_stale_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def follow_s(self) -> float: ...
    @follow_s.setter
    def follow_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def follow_share(self) -> float: ...
    @follow_share.setter
    def follow_share(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def overload_share(self) -> float: ...
    @overload_share.setter
    def overload_share(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def runaway_m(self) -> float: ...
    @runaway_m.setter
    def runaway_m(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def slack_share(self) -> float: ...
    @slack_share.setter
    def slack_share(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def stale_s(self) -> float: ...
    @stale_s.setter
    def stale_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def stuck_s(self) -> float: ...
    @stuck_s.setter
    def stuck_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def tension_s(self) -> float: ...
    @tension_s.setter
    def tension_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class StartUpPlan:
    """
    Tension set-points to visit, the first is tau_0; transition_s empty, or 0 for one: derived from the robot; via: settle there and go on without measuring, empty: measure everywhere; pose: lengths lead the platform of six cables and more from one to the next, empty: tensions lead it.
    """

    def __init__(
        self,
        setpoint_N: collections.abc.Sequence[
            typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
        ],
        transition_s: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex] = [],
        via: collections.abc.Sequence[bool] = [],
        pose: collections.abc.Sequence[Pose] = [],
    ) -> None: ...
    @property
    def pose(self) -> list[Pose]: ...
    @property
    def setpoint_N(
        self,
    ) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]: ...
    @property
    def transition_s(self) -> list[float]: ...
    @property
    def via(self) -> list[bool]: ...

class StartUpOptions:
    """
    How the start-up is run.
    """

    control: TensionControlOptions
    rest: RestOptions
    watchdog: WatchdogOptions

    def __init__(self, **kwargs: typing.Any) -> None: ...
    @property
    def measure_s(self) -> float: ...
    @measure_s.setter
    def measure_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def record_s(self) -> float: ...
    @record_s.setter
    def record_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def settle_timeout_s(self) -> float: ...
    @settle_timeout_s.setter
    def settle_timeout_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def velocity_limit_m_s(self) -> float: ...
    @velocity_limit_m_s.setter
    def velocity_limit_m_s(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def wait_for_rest(self) -> bool:
        """
        False: set-points are passed without waiting for rest there.
        """

    @wait_for_rest.setter
    def wait_for_rest(self, arg0: bool) -> None: ...

class StartUpState(enum.StrEnum):
    """
    State of the start-up.
    """

    idle = "idle"
    recording = "recording"
    moving_to_start = "moving_to_start"
    moving = "moving"
    settling = "settling"
    measuring = "measuring"
    done = "done"
    holding = "holding"

class StartUpCommand:
    """
    What to do until the next sample.
    """

    @property
    def by_tension(self) -> list[bool]:
        """
        [n] for drives with a tension loop: True, the drive follows its tension set-point; False, it must follow velocity_m_s.
        """

    @property
    def locked(self) -> bool:
        """
        Winches must stand still.
        """

    @property
    def reason(self) -> str:
        """
        Holding: why.
        """

    @property
    def remaining_s(self) -> float: ...
    @property
    def ripple(self) -> float:
        """
        Motion over what rest allows.
        """

    @property
    def setpoint(self) -> int: ...
    @property
    def state(self) -> StartUpState: ...
    @property
    def tension_setpoint_N(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n] for drives with a tension loop of their own, and for the log.
        """

    @property
    def velocity_m_s(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        [n] of pay-out, for drives in velocity mode.
        """

class StartUpRest:
    """
    One measured rest.
    """

    @property
    def begin_s(self) -> float: ...
    @property
    def end_s(self) -> float: ...
    @property
    def setpoint(self) -> int: ...

class StartUp:
    """
    The start-up procedure: a pure function of samples, for any backend.
    """

    def __init__(self, robot: Robot, plan: StartUpPlan, options: StartUpOptions = ...) -> None: ...
    def finish(self) -> None:
        """
        What was measured is enough: the run ends done where it is, the winches stop and lock.
        """

    def go_on_with(self, rest: StartUpPlan) -> None:
        """
        Other stops (StartUpPlan) after the present set-point, or after the one being moved to. Raises InputError, and changes nothing, for what the constructor refuses and when the run has ended.
        """

    def step(self, sample: RobotSample) -> StartUpCommand:
        """
        Takes the sample and says what to do until the next.
        """

    @property
    def finished(self) -> bool: ...
    @property
    def planned_duration_s(self) -> float: ...
    @property
    def reason(self) -> str: ...
    @property
    def rests(self) -> list[StartUpRest]: ...
    @property
    def state(self) -> StartUpState: ...
    @property
    def velocity_limit_m_s(self) -> float: ...

class StartUpChange:
    """
    One change of state.
    """

    @property
    def setpoint(self) -> int: ...
    @property
    def state(self) -> StartUpState: ...
    @property
    def time_s(self) -> float: ...

class StartUpRun:
    """
    What happened in a simulated start-up.
    """

    @property
    def changes(self) -> list[StartUpChange]: ...
    @property
    def log(self) -> Log: ...
    @property
    def max_setpoint_N(self) -> float: ...
    @property
    def max_tension_N(self) -> float: ...
    @property
    def max_velocity_m_s(self) -> float: ...
    @property
    def min_setpoint_N(self) -> float: ...
    @property
    def poses(self) -> list[Pose]:
        """
        True poses, one a row of the log.
        """

    @property
    def reason(self) -> str: ...
    @property
    def rest_rows(self) -> list[SampleRange]:
        """
        Rows of the log of each rest.
        """

    @property
    def rests(self) -> list[StartUpRest]: ...
    @property
    def state(self) -> StartUpState: ...
    @property
    def truth(self) -> list[PlantTruth]:
        """
        One a row of the log.
        """

class OnlineCalibration:
    """
    The estimate while the robot is being measured, a stretch of the log at a time: the same problem as calibrate() poses, started from what was solved before. calibrate() on the finished log has the last word.
    """

    def __init__(self, robot: Robot, options: CalibrateOptions | None = None) -> None:
        """
        options: at_s, segment and guess must be unset. Raises InputError.
        """

    def add(self, since_last: Log) -> CalibrationResult:
        """
        Takes what was read since the last call, best up to the end of a rest; the first sample of the first stretch is the reference. CalibrationResult after it: what calibrate() would say, unobservable while there is too little. Raises InputError for a stretch that does not fit the robot or begins before the last one ended.
        """

    @property
    def calibration(self) -> Calibration:
        """
        So far; a copy.
        """

class AskedAccuracy:
    """
    Standard deviations of the initial pose that somebody wants, of the worst axis whichever way it points. Immutable.
    """

    def __init__(
        self,
        *,
        position_m: typing.SupportsFloat | typing.SupportsIndex,
        rotation_rad: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    def reached(
        self, covariance: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 6]"]
    ) -> bool:
        """
        Whether a covariance [6, 6] of the initial pose (position [m], world-frame rotation vector [rad]) is good enough.
        """

    @property
    def position_m(self) -> float: ...
    @property
    def rotation_rad(self) -> float: ...

class NextStop:
    """
    The stop to measure next and how to get there. Immutable.
    """

    @property
    def predicted_deviation(
        self,
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        [6] of the initial pose after it, from rests alone [m, rad].
        """

    @property
    def stop(self) -> int:
        """
        Which of the plan's poses, from 0.
        """

    @property
    def time_s(self) -> float:
        """
        With settling and measuring.
        """

    @property
    def way(self) -> StartUpPlan:
        """
        StartUpPlan: set-points to pass, then the stop.
        """

class NextStopChooser:
    """
    Chooses among the measured stops of a plan what to measure next: the stop that teaches most about the initial pose per second (A-optimal in the units of the accuracy asked for).
    """

    def __init__(
        self,
        robot: Robot,
        plan: Plan,
        threads: typing.SupportsInt | typing.SupportsIndex = 0,
        progress: collections.abc.Callable[[float], typing.Any] | None = None,
    ) -> None:
        """
        Follows the ways between all stops. Raises InputError for a plan of another robot.
        """

    def choose(
        self,
        measured: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex],
        initial: Pose,
        initial_reading_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        asked: AskedAccuracy,
    ) -> NextStop | None:
        """
        measured: stops so far, in order, from 0; the robot is at the last one, or at τ0. initial: the estimate of ζ0, initial_reading_N [n] the load cells there. None: no stop is left that can be reached.
        """

    def choose_by_worth(
        self,
        measured: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex],
        worth: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
    ) -> NextStop | None:
        """
        The stop of the greatest worth per second. worth: of each pose of the plan, in any unit. None: no stop is left that is worth anything and can be reached.
        """

class TrackedSample:
    """
    What is known of the platform after one sample. Immutable.
    """

    def __repr__(self) -> str: ...
    @property
    def acceleration(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        [6]: derivative of the twist.
        """

    @property
    def left_out(self) -> int:
        """
        Readings of this sample that contradict the others.
        """

    @property
    def pose(self) -> Pose: ...
    @property
    def pose_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        [6, 6]: position [m], world-frame rotation vector [rad].
        """

    @property
    def reason(self) -> str:
        """
        Not trusted: why. Empty otherwise.
        """

    @property
    def time_s(self) -> float: ...
    @property
    def trusted(self) -> bool:
        """
        Whether the readings agree with one another and with the calibration; the pose is no good otherwise.
        """

    @property
    def twist(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
        """
        [6]: velocity of P [m/s], angular velocity [rad/s], world axes.
        """

    @property
    def twist_covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
        """
        [6, 6]
        """

class Track:
    """
    Pose and twist of the platform at every sample of a run. Immutable.
    """

    def __getitem__(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> TrackedSample: ...
    def __len__(self) -> int: ...
    def __repr__(self) -> str: ...
    def _repr_html_(self) -> str: ...
    def plot(self, ax: typing.Any = None) -> typing.Any:
        """
        Draws into a matplotlib Axes (None: a new one), which is returned.
        """

    def to_pandas(self) -> typing.Any:
        """
        A row a sample: time_s, position, roll, pitch, yaw, twist, their standard deviations, trusted.
        """

    @property
    def convention(self) -> EulerConvention:
        """
        EulerConvention of the robot's sensors.
        """

    @property
    def pose_covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        [N, 6, 6]: position [m], world-frame rotation vector [rad].
        """

    @property
    def position_m(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        [N, 3]: P in the world.
        """

    @property
    def quaternion_wxyz(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        [N, 4]: R_world_platform, unit quaternions.
        """

    @property
    def roll_pitch_yaw_rad(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        [N, 3] in `convention`; the yaw is absolute.
        """

    @property
    def time_s(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        [N]
        """

    @property
    def trusted(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        [N]: whether the readings agree with one another and with the calibration.
        """

    @property
    def twist(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        [N, 6]: velocity of P [m/s], angular velocity [rad/s], world axes.
        """

    @property
    def twist_covariance(self) -> numpy.typing.NDArray[numpy.float64]:
        """
        [N, 6, 6]
        """

class Tracker:
    """
    Pose and twist from sample to sample, in some microseconds each: an extended Kalman filter on SE(3) over pose, twist and acceleration. What the calibration leaves open is considered in the covariances and not estimated.
    """

    def __init__(self, calibration: Calibration) -> None:
        """
        Raises InputError for a calibration without a pose that can be trusted.
        """

    def add(self, sample: RobotSample) -> TrackedSample:
        """
        Takes the next RobotSample, which counts from the same power-on as the calibration's log; TrackedSample after it. After a gap of more than 2 s it starts anew. Raises InputError for a sample that is not after the last one or has more cables.
        """

    @property
    def latest(self) -> TrackedSample:
        """
        TrackedSample: time_s is NaN before any.
        """

class Swing:
    """
    A mode in which a platform with locked winches swings. Immutable.
    """

    def __repr__(self) -> str: ...
    @property
    def measured_hz(self) -> float:
        """
        Of the motion's peak that has its shape; NaN: there is none.
        """

    @property
    def model_hz(self) -> float:
        """
        As the model has it about the mean pose.
        """

    @property
    def size_m(self) -> float:
        """
        Root mean square of the motion in it: of the same kinetic energy as such a shift of the mass.
        """

class Push:
    """
    A time in which something pushes a platform whose winches stand still. Immutable.
    """

    def __repr__(self) -> str: ...
    @property
    def after_J(self) -> float:
        """
        Energy of the swing after it.
        """

    @property
    def before_J(self) -> float:
        """
        Energy of the swing before it.
        """

    @property
    def begin_s(self) -> float:
        """
        Time of the log.
        """

    @property
    def end_s(self) -> float:
        """
        Time of the log.
        """

class InMotion:
    """
    A calibration in which the balance counts in motion too. Immutable.
    """

    def __repr__(self) -> str: ...
    @property
    def calibration(self) -> Calibration:
        """
        Calibration of rests and moments of motion; what calibrate() says where motion adds nothing.
        """

    @property
    def damping_shift_1_s(self) -> float:
        """
        1/T: forces 2m/T v hold the centre of mass back.
        """

    @property
    def damping_turn_1_s(self) -> float:
        """
        1/T: moments 2I/T w hold turns back.
        """

    @property
    def in_motion(self) -> bool:
        """
        Whether it is that of rests and motion.
        """

    @property
    def late(self) -> list[AppliedEffect]:
        """
        List of AppliedEffect: what makes readings of one moment belong to different ones (sensor_delay, swivel_delay ...), found beside the pose where it is clear; a copy.
        """

    @property
    def moments_a_reading(self) -> float:
        """
        So many moments of motion are worth one independent reading.
        """

    @property
    def pushes(self) -> list[Push]:
        """
        List of Push: the swing gains energy there while the winches stand still; no balance counts.
        """

    @property
    def swings(self) -> list[Swing]:
        """
        List of Swing, the slowest mode first: where the winches were locked for long enough.
        """

class FrameStatus(enum.StrEnum):
    """
    How find_frame ended.
    """

    converged = "converged"
    not_converged = "not_converged"
    unobservable = "unobservable"

class Estimate:
    """
    One number and its standard deviation. Immutable.
    """

    def __repr__(self) -> str: ...
    @property
    def sigma(self) -> float: ...
    @property
    def value(self) -> float: ...

class LeftOutPose:
    """
    A pose whose readings do not fit the frame. Immutable.
    """

    @property
    def cable(self) -> int:
        """
        The one whose reading is off, from 0; -1: no single one.
        """

    @property
    def error_m(self) -> float:
        """
        By which it is; NaN: no single one.
        """

    @property
    def log(self) -> int:
        """
        Which log, from 0.
        """

    @property
    def sample(self) -> int:
        """
        Its row, from 0; of a rest the first one.
        """

class FrameResult:
    """
    Where the pulleys of a frame are. Look at status first. Immutable.
    """

    def __repr__(self) -> str: ...
    @property
    def anchors_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        Pulley positions in the world [n, 3]; what fixes the world is said by gauge.
        """

    @property
    def anchors_sigma_m(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        Their standard deviations [n, 3], lack of fit included; 0 where gauge fixes them.
        """

    @property
    def corrected(self) -> Robot:
        """
        The robot with these pulleys and their position_sigma_m.
        """

    @property
    def covariance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Of all positions, one pulley after the other [3n, 3n] [m²].
        """

    @property
    def gauge(self) -> str:
        """
        What fixes the frame in the world, in words.
        """

    @property
    def held_out_rms_m(self) -> float:
        """
        Of poses that the frame was not fitted to, a fifth at a time.
        """

    @property
    def iterations(self) -> int: ...
    @property
    def lack_of_fit(self) -> float:
        """
        By which σ are larger than those of independent readings, since residuals of neighbouring poses hang together.
        """

    @property
    def left_out(self) -> list[LeftOutPose]:
        """
        List of LeftOutPose.
        """

    @property
    def next(self) -> list[str]:
        """
        Which poses would tell more, in words.
        """

    @property
    def noise_m(self) -> float:
        """
        Of one length, from the residuals.
        """

    @property
    def not_determined(self) -> list[str]:
        """
        In words.
        """

    @property
    def off_plane_m(self) -> Estimate | None:
        """
        How far belts run outside the plane, where readings show it; else None.
        """

    @property
    def offset_m(self) -> list[Estimate]:
        """
        Reading minus whole length: none, one for all cables, or one a cable.
        """

    @property
    def own_scale(self) -> list[Estimate]:
        """
        Readings a metre of each cable beside the mean of all [1]: none, or one a cable.
        """

    @property
    def poses(self) -> list[Pose]:
        """
        Of the poses that were kept.
        """

    @property
    def reason(self) -> str:
        """
        One sentence.
        """

    @property
    def residual_m(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]:
        """
        Model minus reading of the lengths [n] at each of them.
        """

    @property
    def rms_m(self) -> float:
        """
        Of the lengths' residuals.
        """

    @property
    def scale(self) -> Estimate | None:
        """
        Readings a metre - 1 [1], where a tracker shows it; else None.
        """

    @property
    def solve_time_s(self) -> float: ...
    @property
    def status(self) -> FrameStatus: ...
    @property
    def stiffness_N(self) -> Estimate | None:
        """
        EA of the cables, where tensions are read, NaN where they do not tell it; else None.
        """

    @property
    def weight_N(self) -> Estimate | None:
        """
        Of the platform, from the tensions; None without.
        """

def all_equilibria_at(
    robot: Robot,
    position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    *,
    distribution: TensionDistribution = ...,
    lambda_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...,
    stability: StabilityNotion = ...,
    rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None = None,
) -> list[InverseResult]:
    """
    All distinct equilibria at a position that about a dozen starts reach: found ones first, by falling tension margin; from six cables on the one at the commanded rotation.
    """

def all_equilibria_from_lengths(
    robot: Robot, length_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
) -> list[EquilibriumResult]:
    """
    All equilibria that about a dozen starts reach, distinct, stable ones first.
    """

def all_equilibria_from_tensions(
    robot: Robot, tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
) -> list[EquilibriumResult]:
    """
    All equilibria that about a dozen starts reach, distinct, stable ones first.
    """

def alpha_shape(
    points_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"],
    alpha_m2: typing.SupportsFloat | typing.SupportsIndex | None = None,
) -> AlphaShape:
    """
    Alpha shape of points [m, 3]; alpha (a squared radius) is automatic unless given. Raises InputError for points that are not finite or an alpha that is not positive.
    """

def box_is_inside(workspace: Workspace, box: Box) -> bool:
    """
    Whether every grid cell that a box touches has all its corners inside.
    """

def builtin_robot_names() -> list[str]:
    """
    Names that load_robot knows without a file.
    """

def builtin_robot_yaml(name: str) -> str:
    """
    Robot file text of a built-in robot. Raises InputError for an unknown name.
    """

def cable_derivatives(pulley: Pulley, state: CableState) -> CableDerivatives:
    """
    Derivatives at a state. Raises InputError unless state.status is ok.
    """

def cable_state(
    pulley: Pulley, q_world_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]
) -> CableState:
    """
    CableState for q [3] [m], world axes, from the pulley's entry D to the platform anchor A.
    """

def calibrate(robot: Robot, log: Log, options: CalibrateOptions | None = None) -> Calibration:
    """
    From a log to the initial pose. Look at result.status. The covariance counts what effects may do that the log cannot rule out; where the readings show that the model lacks something, pose and covariance allow for every known effect at its typical size (options.allow_for_effects). Raises as prepare does.
    """

def calibrate_in_motion(
    robot: Robot,
    log: Log,
    options: CalibrateOptions | None = None,
    most_moments: typing.SupportsInt | typing.SupportsIndex = 1000,
    rounds: typing.SupportsInt | typing.SupportsIndex = 2,
) -> InMotion:
    """
    As calibrate(), with the balance of forces and inertia at moments between the rests, or all along where there are none. InMotion. Raises InputError as calibrate() does, and for options that leave motion out (method static or kinematic, formulation paper, specified noise, at_s).
    """

def channel_noise(
    values: typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"], angles: bool = False
) -> float:
    """
    White noise of a channel [N], in its unit, from second differences (robust to motion); NaN entries are passed over; 0 with fewer than three samples. angles: jumps of 2 pi are none.
    """

def channels() -> list[ChannelRow]:
    """
    The channels that noise is estimated by, those of the paper's sensors first.
    """

def characteristic_length_m(robot: Robot) -> float:
    """
    Root mean square distance of the platform anchors from the centre of mass [m].
    """

def compare(
    robot: Robot,
    logs: collections.abc.Sequence[Log],
    options: DiagnoseOptions | None = None,
    progress: collections.abc.Callable[..., typing.Any] | None = None,
) -> Comparison:
    """
    Which numbers of the effects that the logs show moved from log to log, by how much and when. Logs in the order of time. Raises InputError for fewer than two.
    """

def compute_workspace(
    robot: Robot,
    *,
    box: Box | None = None,
    step_m: typing.SupportsFloat | typing.SupportsIndex = 0.05,
    distribution: TensionDistribution = ...,
    lambda_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...,
    stability: StabilityNotion = ...,
    rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None = None,
    seeds_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"] | None = None,
    threads: typing.SupportsInt | typing.SupportsIndex = 0,
    boundary_halvings: typing.SupportsInt | typing.SupportsIndex = 5,
    progress: collections.abc.Callable[[WorkspaceProgress], typing.Any] | None = None,
) -> Workspace:
    """
    Floods outward from seeds_m [s, 3] (default: a lattice in the box), each point warm-started from a solved neighbour. box: default workspace_box. threads: 0 is one a core. progress(WorkspaceProgress): False stops. Stopped so, or by Ctrl-C, the workspace is what was found until then and `complete` is False. The robot's known effects are applied. Raises InputError for a bad box, step or seed, and unless 3 ≤ n ≤ 5.
    """

def constant_tension_modes(
    robot: Robot,
    state: PlatformState,
    tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> tuple[
    typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"],
    typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"],
]:
    """
    The six small oscillations at constant tensions: (natural_frequency_hz [6], rising; shapes [6, 6], one twist a column). NaN: the motion grows instead.
    """

def default_setpoints(
    robot: Robot,
    nx: typing.SupportsInt | typing.SupportsIndex,
    ny: typing.SupportsInt | typing.SupportsIndex,
    nz: typing.SupportsInt | typing.SupportsIndex,
) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]:
    """
    Tension set-points of an nx × ny × nz grid of equilibria, visited in a serpentine. Raises InputError for fewer than 3 cables and when no such grid is found.
    """

def default_stops(
    robot: Robot,
    nx: typing.SupportsInt | typing.SupportsIndex,
    ny: typing.SupportsInt | typing.SupportsIndex,
    nz: typing.SupportsInt | typing.SupportsIndex,
) -> tuple[list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]], list[Pose]]:
    """
    As default_setpoints, with the poses: (setpoints_N, poses).
    """

def describe_invalid(state: PlatformState) -> str:
    """
    Why a state is not valid, with the cable's number from 1; empty when it is.
    """

def detect_equilibria(
    log: Log,
    range: SampleRange | None = None,
    sigma: SensorSigma | None = None,
    options: DetectionOptions | None = None,
) -> list[Equilibrium]:
    """
    Equilibria in `range` of a log (None: all of it), in time order; sigma None is eq. 18. Absent channels do not vote. Raises InputError for a range outside the log and when neither lengths, swivels nor attitude are there to tell.
    """

def diagnose(
    robot: Robot,
    logs: collections.abc.Sequence[Log],
    options: DiagnoseOptions | None = None,
    progress: collections.abc.Callable[..., typing.Any] | None = None,
) -> Diagnosis:
    """
    Names what the model lacks, from one or more logs of one robot. `progress` is called with each step's name; False ends the search and keeps what was found. Ctrl-C is noticed between steps. Raises InputError for a log that does not fit the robot.
    """

def direct_from_lengths(
    robot: Robot,
    length_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    start: Pose | None = None,
) -> EquilibriumResult:
    """
    Where a platform hangs on cables of given length [n] > 0: the lowest centre of mass with no cable longer. Status found, slack, unstable, not_found or invalid_geometry. Raises InputError for n > 6.
    """

def direct_from_tensions(
    robot: Robot,
    tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    start: Pose | None = None,
) -> EquilibriumResult:
    """
    Where a force-controlled platform hangs: minimum of Σ τ l + m g z_G at constant tensions [n] ≥ 0. Status found, unstable, not_found or invalid_geometry.
    """

def effect_catalogue() -> list[EffectInfo]:
    """
    All effects the project knows, as a list of EffectInfo.
    """

def effects_of(robot: Robot) -> list[EffectInfo]:
    """
    The catalogue, then the robot's own effects: those of its file's text.
    """

def equilibrium_mean(log: Log, samples: SampleRange) -> EquilibriumMean:
    """
    The mean over an interval at rest and its covariance, in which correlated readings count as what they are. Raises InputError for a range outside the log.
    """

def euler_from_rotation(
    rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"],
    convention: EulerConvention,
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
    """
    R_world_platform [3, 3] → (roll, pitch, yaw) [rad], the middle angle in [-pi/2, pi/2]; at gimbal lock the last angle is 0.
    """

def euler_rate_matrix(
    roll_pitch_yaw_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    convention: EulerConvention,
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
    """
    H [3, 3] of omega_world = H · d(roll, pitch, yaw)/dt; singular at gimbal lock.
    """

def even_step_m(box: Box, points: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Step [m] of a grid of about so many points in a box; in a flat one as many along a side.
    """

def exp_so3(
    rotation_vector_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
    """
    Rotation vector [3] [rad] → rotation [3, 3].
    """

def expanded_effect(effect: InjectedEffect, robot: Robot) -> InjectedEffect:
    """
    The same effect with scalars broadcast over the robot's cables. Raises InputError when the values do not fit.
    """

def explain_empty(workspace: Workspace) -> str:
    """
    Why nothing is inside, in one sentence; '' when something is.
    """

def fifth_degree(fraction: typing.SupportsFloat | typing.SupportsIndex) -> float:
    """
    Smooth 0 → 1 with zero speed and acceleration at both ends.
    """

def find_discrete_faults(robot: Robot, log: Log) -> list[DiscreteFault]:
    """
    The signs, orders, units and conventions that are wrong in a log, in the order found; none of a log that agrees with the robot. Raises InputError for a log that does not fit it.
    """

def find_frame(
    robot: Robot,
    logs: collections.abc.Sequence[Log],
    *,
    offset: str = "common",
    scale: str = "common",
    poses: str = "automatic",
    leave_out: bool = True,
    off_plane: bool = True,
) -> FrameResult:
    """
    Pulley positions, offsets and scale from the poses of one or more logs of one robot. offset: what whole lengths may be wrong by: 'none', 'common' or 'each'. scale: whether readings a metre are 'common' to all cables or 'each' cable's own. poses: 'samples', 'rests', or 'automatic'. leave_out: poses that do not belong, named in left_out. off_plane: whether belts of a planar robot may run outside the plane. Raises InputError for logs that do not fit the robot or hold no lengths.
    """

def follow_path(
    robot: Robot,
    from_set_point: SetPoint,
    to_set_point: SetPoint,
    *,
    bounds: Box | None = None,
    tension_margin_N: typing.SupportsFloat | typing.SupportsIndex = 0.0,
) -> Path:
    """
    The platform's quasi-static path while the tensions change from one set-point to another: stable, inside the static workspace and the bounds (default workspace_box), or why not.
    """

def foresee(
    robot: Robot,
    setpoints_N: collections.abc.Sequence[
        typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ],
    poses: collections.abc.Sequence[Pose] = [],
    *,
    noise: typing.SupportsFloat | typing.SupportsIndex = 1.0,
    dwell_s: typing.SupportsFloat | typing.SupportsIndex = 5.0,
    move_s: typing.SupportsFloat | typing.SupportsIndex = 5.0,
    of: collections.abc.Sequence[str] = [],
) -> Foresight:
    """
    What a run through these set-points [n] would show. noise: of a rest's readings, in the robot file's sigma. of: names of effects (default: all that rest can show). Raises InputError for a run that is none, and a name that rest cannot show.
    """

def format_log(log: Log) -> str:
    """
    The canonical CSV text; parse_log gives back the same numbers.
    """

def format_plan(plan: Plan) -> str:
    """
    Text of a plan file (CSV).
    """

def formula_course(
    model: DiagnosisModel, effect: typing.SupportsInt | typing.SupportsIndex
) -> Course | None:
    """
    Of one of a model's effects, counted from 0; None unless it is a formula for readings. Raises InputError for one that the model does not have.
    """

def formula_words() -> dict[str, dict[str, str]]:
    """
    What formulas of effects may name ('variables') and add to ('targets'): word and meaning; and 'functions'.
    """

def free_motion_basis(
    state: PlatformState,
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
    """
    Orthonormal basis [6, m] of the motions that no cable length resists.
    """

def free_motion_modes(
    robot: Robot,
    state: PlatformState,
    tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> tuple[
    typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"],
    typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"],
]:
    """
    The 6 - n oscillations with locked cables: (natural_frequency_hz, shapes [6, 6 - n]).
    """

def free_motion_stiffness(
    robot: Robot,
    state: PlatformState,
    tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
    """
    K_f of eq. A4 [6-n, 6-n]: K + Q on the motions that no cable length resists.
    """

def fresh_rows(
    readings: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"],
    begin: typing.SupportsInt | typing.SupportsIndex,
    end: typing.SupportsInt | typing.SupportsIndex,
) -> list[int]:
    """
    Rows of readings [N, columns of one sensor] in which it read anew; all of them where none is held over several rows. Raises InputError for rows that are not there.
    """

def gravity_stiffness(
    robot: Robot, state: PlatformState
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
    """
    Q [6, 6]: -df/ddelta.
    """

def gravity_wrench(
    robot: Robot, state: PlatformState
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
    """
    f of eq. 6 [6] [N, Nm]: weight and its moment about P, world axes.
    """

def held_orientation(
    robot: Robot,
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
    """
    The rotation [3, 3] in which six cables and more are commanded to hold the platform when nobody says: the robot file's own, or the best turn about the vertical.
    """

def holds_orientation(robot: Robot) -> bool:
    """
    Whether lengths hold the whole pose: six cables or more. Then poses are commanded and tensions chosen; with fewer, tensions are commanded and statics choose the orientation.
    """

def in_solid_cell(
    workspace: Workspace,
    position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
) -> bool:
    """
    Whether the grid cell around a position has all its corners inside.
    """

def injectable_effects() -> list[typing.Any]:
    """
    Everything that can be injected: dicts of name, parameters [(name, shape)], generator_only (not in the catalogue of the diagnosis), description.
    """

def inverse(
    robot: Robot,
    position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    *,
    distribution: TensionDistribution = ...,
    lambda_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...,
    stability: StabilityNotion = ...,
    start: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None = None,
    rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None = None,
) -> InverseResult:
    """
    Inverse geometrico-static problem (eqs A1-A3): orientation and tensions at position_m [3] of P. lambda_N [n - 3]: with given_lambda. start [3, 3]: a rotation close to the solution; without it the search is by NLopt from several. From six cables on rotation [3, 3] is commanded (default: held_orientation), the tensions are chosen, and lambda_N has n - 6 values. Raises InputError for n < 3 and for a rotation of fewer than six.
    """

def inverse_along(
    robot: Robot,
    positions_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"],
    *,
    distribution: TensionDistribution = ...,
    lambda_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...,
    stability: StabilityNotion = ...,
    rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None = None,
) -> tuple[
    list[EquilibriumStatus],
    typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"],
    typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"],
]:
    """
    The inverse problem at positions_m [m, 3], each continued from the one before by Newton steps, from nothing by NLopt where that fails: (status [m], quaternion_wxyz [m, 4], tension_N [m, n]), NaN where there is no balance. Raises InputError as inverse does.
    """

def is_rest_list(log: Log, gap_s: typing.SupportsFloat | typing.SupportsIndex = 2.0) -> bool:
    """
    Whether a log has at most 400 rows, no two of them within gap_s: each is then taken as the reading of one rest.
    """

def lambda_of(
    robot: Robot,
    state: PlatformState,
    tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
    """
    lambda [n - 3], from six cables on [n - 6], [N] of given tensions at a pose; empty when the cables do not span space.
    """

def largest_inscribed_box(workspace: Workspace) -> Box | None:
    """
    The axis-aligned box of largest volume whose grid points are all inside, or None.
    """

def left_inverse_rows(cable_count: typing.SupportsInt | typing.SupportsIndex) -> list[WrenchRow]:
    """
    The n wrench rows that the left inverse of eq. 12 solves. Raises InputError for n > 6.
    """

def length_jacobian(
    state: PlatformState,
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 6]"]:
    """
    dl/ddelta [n, 6] for a world-frame twist: row i is (t, a′ × t), eq. 7.
    """

def library_versions() -> dict[str, str]:
    """
    Versions of the compiler and of the libraries that this module was built with, by name.
    """

def linearise(
    problem: CalibrationProblem,
    poses: collections.abc.Sequence[Pose],
    errors: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"] = ...,
) -> tuple[
    typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"],
    typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"],
]:
    """
    (residual [m], jacobian [m, 6 k + 2 n + 1]) at the poses, whitened (eq. 13 over sigma): six columns a pose (world-frame twist), then the errors of the reference readings, which are `errors` [2 n + 1] (none: zero). NaN where a pose has no geometry. Raises InputError for another number of poses or errors.
    """

def load_robot(name_or_path: os.PathLike[str] | str | bytes) -> Robot:
    """
    A robot by built-in name ('irma4') or by path to a robot file. Raises InputError.
    """

def log_groups() -> list[Sensor]:
    """
    What a log holds, in the order of its columns: every sensor, then the set-points.
    """

def log_so3(
    rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"],
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]:
    """
    Rotation [3, 3] → rotation vector [3] [rad], of norm ≤ pi. Raises InputError when it is not a rotation.
    """

def make_plan(
    robot: Robot,
    *,
    box: Box | None = None,
    grid: typing.Annotated[
        collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(3)"
    ] = [2, 2, 2],
    optimal: typing.SupportsInt | typing.SupportsIndex = 0,
    positions_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"] | None = None,
    home_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None = None,
    order: VisitingOrder = ...,
    visits: typing.SupportsInt | typing.SupportsIndex = 2,
    seed: typing.SupportsInt | typing.SupportsIndex = 1,
    set_points: SetPointOptions = ...,
    bounds: Box | None = None,
    timing: TimingOptions = ...,
    threads: typing.SupportsInt | typing.SupportsIndex = 0,
    progress: collections.abc.Callable[[str, float], typing.Any] | None = None,
) -> PlanResult:
    """
    Which poses, in which order, at which tensions and how fast (paper §3.2), every path checked. grid: positions along x, y, z of the box (default: eq. 19 for irma4, else proposed). optimal > 0: that many poses chosen by observability instead. positions_m [k, 3]: instead of both. home_m [3]: where the run starts (default: the middle of the box). visits, seed: of the random order. bounds: that the platform may not leave. progress(stage, share): False stops. The robot's known effects are applied. A pose that cannot be measured or reached is a status. Raises InputError for options that make no sense and for n < 3.
    """

def measurement_at(
    log: Log,
    index: typing.SupportsInt | typing.SupportsIndex,
    kind: PoseKind,
    cable_count: typing.SupportsInt | typing.SupportsIndex,
) -> Measurement:
    """
    The sample at row `index` as a Measurement. Raises InputError for a row that is not in the log and when the log is of another number of cables.
    """

def measurement_mean(
    log: Log,
    range: SampleRange,
    kind: PoseKind,
    cable_count: typing.SupportsInt | typing.SupportsIndex,
) -> Measurement:
    """
    The mean over an interval; time_s is the middle of it. Raises InputError as measurement_at.
    """

def minus(to: Pose, from_: Pose) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
    """
    The twist [6] (m, rad, world axes) for which plus(from_, twist) is `to`.
    """

def model_residuals(model: DiagnosisModel) -> list[ModelResidual]:
    """
    A ModelResidual for each pose of each run.
    """

def motion_basis(robot: Robot) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
    """
    Orthonormal basis [6, f] of the twists that the platform's guides allow, shifts first.
    """

def number_table(
    text: bytes | typing.Annotated[numpy.typing.ArrayLike, numpy.uint8],
    begin: typing.Annotated[numpy.typing.ArrayLike, numpy.int64],
    columns: typing.Annotated[numpy.typing.ArrayLike, numpy.int64],
) -> tuple[numpy.typing.NDArray[numpy.float64], tuple[int, int, bytes] | None]:
    """
    (values [lines, columns], wrong) of comma-separated lines that begin at bytes `begin`; `columns` count from 0 and increase. NaN for a blank cell. wrong: None, or (line, column, text) of the first cell that is no number, and values end before that line. The text is not copied. Raises InputError for lines outside the text.
    """

def obstruction(robot: Robot, pose: Pose) -> str:
    """
    What of the robot's surroundings is in the way at a pose, in words; empty: nothing. The platform is the box along the world's axes around P, its anchors and its outline_m.
    """

def parked_start(
    robot: Robot,
    meant: Pose,
    seed: typing.SupportsInt | typing.SupportsIndex,
    tries: typing.SupportsInt | typing.SupportsIndex = 200,
) -> SetPoint | None:
    """
    Where a robot of six cables and more may have been parked for a run that begins at the Pose `meant`: a SetPoint as near as people park by eye; the same for the same seed. None when `tries` poses were not wrench-feasible. Raises InputError for fewer cables.
    """

def parse_euler_convention(name: str) -> EulerConvention:
    """
    'XYZ' … → EulerConvention. Raises InputError naming the accepted orders.
    """

def parse_formulation(name: str) -> Formulation:
    """
    'full' or 'paper' → Formulation; raises InputError.
    """

def parse_injected_effect(text: str, robot: Robot | None = None) -> InjectedEffect:
    """
    Parses 'NAME=v1,v2,…'. `robot`: whose own effects are known too. Raises InputError naming the accepted effects, or the sizes of this one's parameters.
    """

def parse_log(text: str | bytes, source: str) -> Log:
    """
    Parses the text of a canonical CSV log; `source` is what messages call it. Raises InputError 'source:line: column: …'.
    """

def parse_method(name: str) -> Method:
    """
    'unified', 'static' or 'kinematic' → Method; raises InputError.
    """

def parse_noise_source(name: str) -> NoiseSource:
    """
    'data' or 'specified' → NoiseSource; raises InputError.
    """

def parse_plan(text: str, source: str) -> Plan:
    """
    Text of a plan file → Plan. Raises InputError 'source:line:column: …'.
    """

def parse_robot(yaml_text: str, source: str) -> Robot:
    """
    Parses a robot file's text; `source` is what messages call it. Raises InputError 'source:line:column: field: …'.
    """

def parse_tension_distribution(name: str) -> TensionDistribution:
    """
    'barycentre' … → TensionDistribution. Raises InputError naming the choices.
    """

def parse_visiting_order(name: str) -> VisitingOrder:
    """
    'least-time', 'random' → VisitingOrder. Raises InputError naming the choices.
    """

def path_state(
    robot: Robot, log: Log, smoothing_s: typing.SupportsFloat | typing.SupportsIndex = 1.0
) -> PathState:
    """
    Directions of motion of a log of a robot: what hysteresis and delays depend on.
    """

def perfect_sensors() -> SensorOptions:
    """
    Without noise, quantisation, bias, delay and offsets.
    """

def plain_json_messages(
    records: bytes, channels: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]
) -> (
    tuple[int, list[str], numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.bool]]
    | None
):
    """
    (count, names [K], values [N, K], present [N, K]) of the messages inside of one MCAP chunk: how many, and those on `channels`: NaN for null and for a key that is absent. None unless every record is a whole message, and every one of these a JSON object of numbers and nulls, no key twice, no number beyond double precision, no whole number beyond 64 bits.
    """

def platform_state(robot: Robot, pose: Pose) -> PlatformState:
    """
    PlatformState of a robot at a pose; see its `valid`.
    """

def plus(
    pose: Pose, twist: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[6, 1]"]
) -> Pose:
    """
    pose ⊕ twist, twist [6] = (dp [m], dtheta [rad]) in world axes: p + dp, exp(dtheta) R.
    """

def potential_energy(
    robot: Robot,
    pose: Pose,
    state: PlatformState,
    tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> float:
    """
    Potential energy at constant tensions [J]; its gradient along a twist is wrench_residual.
    """

def predicted_covariance(
    robot: Robot, start: SetPoint, set_points: collections.abc.Sequence[SetPoint]
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"] | None:
    """
    Covariance [6, 6] of the initial pose (position [m], world-frame rotation vector [rad]) that measuring these set-points will give; None while it stays unobservable. Raises InputError for tensions that are not one a cable.
    """

def prepare(robot: Robot, log: Log, options: CalibrateOptions | None = None) -> Calibration:
    """
    The problem that a log poses, and the equilibria it was drawn from; result is not filled. Raises InputError for a log that does not fit the robot or the options.
    """

def probe(
    workspace: Workspace,
    position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
) -> InverseResult:
    """
    Everything about one position [3]: equilibrium, and margin_N to the tension limits.
    """

def published_measurement_box(robot: Robot) -> Box | None:
    """
    The box of eq. 19 when the robot is irma4, else None.
    """

def random_offsets(
    cable_count: typing.SupportsInt | typing.SupportsIndex, random: RandomNormal
) -> ReadingOffsets:
    """
    Random offsets: ±1 m, ±60°, ±180°.
    """

def random_start(
    robot: Robot,
    box: Box,
    seed: typing.SupportsInt | typing.SupportsIndex,
    tries: typing.SupportsInt | typing.SupportsIndex = 200,
) -> SetPoint | None:
    """
    Where a robot may hang at power-on: the SetPoint at a position drawn evenly from the Box, stable at constant tensions; the same for the same seed. None when `tries` positions were none. Raises InputError for robots without an inverse problem.
    """

def read_log(path: os.PathLike[str] | str | bytes) -> Log:
    """
    Reads a canonical CSV log. Raises InputError 'file:line: column: …'.
    """

def read_plan(path: os.PathLike[str] | str | bytes) -> Plan:
    """
    Reads a plan file. Raises InputError 'file:line:column: …'.
    """

def reading_noise(
    sigma: SensorSigma,
    scale: typing.SupportsFloat | typing.SupportsIndex = 1.0,
    absolute: bool = False,
) -> ReadingNoise:
    """
    The sigma of a robot's sensors times `scale`; absolute: those of absolute sensors too.
    """

def robot_size_m(robot: Robot) -> float:
    """
    Largest distance between pulleys or, when that is 0, of the platform's anchors [m].
    """

def rotation_angle_difference_rad(a: Pose, b: Pose) -> float:
    """
    |alpha_a - alpha_b| [rad], eq. 20 of the paper: not a distance between rotations, kept to compare with it.
    """

def rotation_distance_rad(a: Pose, b: Pose) -> float:
    """
    Geodesic angle [rad] between two orientations.
    """

def rotation_from_euler(
    roll_pitch_yaw_rad: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    convention: EulerConvention,
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]:
    """
    (roll, pitch, yaw) [rad] → R_world_platform [3, 3].
    """

def scan(model: DiagnosisModel) -> list[CandidateScore]:
    """
    Scores of all effects that rest can show on what a model leaves, best first; nothing is refitted.
    """

def segments(
    log: Log, gap_s: typing.SupportsFloat | typing.SupportsIndex = 2.0
) -> list[SampleRange]:
    """
    Segments of a log: a gap longer than gap_s starts a new one. The last is the run. A list of rests (is_rest_list) is one segment.
    """

def separation_by_stops(
    diagnosis: Diagnosis,
    effect: typing.SupportsInt | typing.SupportsIndex,
    rival: str,
    poses: collections.abc.Sequence[Pose],
    tensions_N: collections.abc.Sequence[
        typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ],
) -> StopSeparation:
    """
    What stops that a run may still go to would tell between an effect of a diagnosis (its place in effects, from 0) and a rival of it. poses: where they are; tensions_N [n] hold it there. Raises InputError for a rival that is none, and lists of different lengths.
    """

def set_point_at(
    robot: Robot,
    position_m: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    options: SetPointOptions = ...,
) -> tuple[SetPoint | None, str]:
    """
    The set-point at a position [3]: (SetPoint or None, reason why there is none).
    """

def settling_deviation(
    robot: Robot, set_point: SetPoint
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
    """
    Standard deviation [6] of the pose (position [m], world-frame rotation vector [rad]) when every tension is wrong by one sigma of the load cells. Raises InputError for tensions that are not one a cable.
    """

def signals(
    log: Log,
    run: SampleRange,
    equilibria: collections.abc.Sequence[Equilibrium],
    sigma: SensorSigma,
) -> dict[str, Signal]:
    """
    A Signal for each channel, by name; absent ones have the robot file's sigma. Raises InputError for a run or a rest outside the log.
    """

def simulate_startup(
    robot: Robot,
    plan: StartUpPlan,
    *,
    simulator: SimulatorOptions = ...,
    startup: StartUpOptions = ...,
    control_rate_Hz: typing.SupportsFloat | typing.SupportsIndex = 100.0,
    log_rate_Hz: typing.SupportsFloat | typing.SupportsIndex = 10.0,
    initial_tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    | None = None,
    initial_pose: Pose | None = None,
    progress: typing.Any = None,
) -> StartUpRun:
    """
    The start-up procedure on the simulated robot. `progress(command, sample)` is called with every command; False stops the run as the operator would.
    """

def solve(
    problem: CalibrationProblem,
    guess: collections.abc.Sequence[Pose],
    options: SolveOptions | None = None,
) -> CalibrationResult:
    """
    Solves from a guess, one Pose a measurement. Numerical failure is a status. Raises InputError when the problem itself makes no sense.
    """

def specified_noise(sigma: SensorSigma) -> NoiseModel:
    """
    What the robot file says (eq. 18): nothing averages out.
    """

def stability(
    robot: Robot,
    state: PlatformState,
    tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> Stability:
    """
    Both notions of stability at a pose that is in balance.
    """

def steps_of(robot: Robot) -> list[EffectInfo]:
    """
    What happens once, as diagnose names it: a list of EffectInfo, several of one name.
    """

def stiffness(
    robot: Robot,
    state: PlatformState,
    tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
    """
    K + Q [6, 6]; at an equilibrium the Hessian of the potential energy.
    """

def structure_matrix(
    state: PlatformState,
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, n]"]:
    """
    Structure matrix Xi^T [6, n], eq. 7: column i is (t, a′ × t), world axes, about P.
    """

def swivel_jacobian(
    state: PlatformState,
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 6]"]:
    """
    dsigma/ddelta [n, 6]: row i is (w, a′ × w)/(u·q).
    """

def synthetic_log(
    robot: Robot,
    setpoints_N: collections.abc.Sequence[
        typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
    ],
    options: SyntheticLogOptions | None = None,
    poses: collections.abc.Sequence[Pose] = [],
) -> SyntheticLog:
    """
    A quasi-static start-up run through tension set-points [poses][n] under perfect tension control; with poses, one a set-point, led there by the lengths of six cables and more. Raises InputError where there is no stable equilibrium.
    """

def synthetic_measurement(
    robot: Robot,
    pose: Pose,
    tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    kind: PoseKind,
    offsets: ReadingOffsets,
    noise: ReadingNoise,
    random: RandomNormal,
) -> Measurement:
    """
    Exact readings at a pose plus offsets and noise; tension_N [n]: the true tensions there.
    """

def tension_margin_N(
    robot: Robot, tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]
) -> float:
    """
    Distance [N] of the closest tension to its limit; negative outside.
    """

def tension_stiffness(
    state: PlatformState,
    tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 6]"]:
    """
    K of eq. A5 [6, 6]: d(Xi^T tau)/ddelta at constant tensions.
    """

def tensions_least_squares(robot: Robot, state: PlatformState) -> TensionModel:
    """
    Tensions of least squared wrench error, moments scaled by the characteristic length; for n ≤ 6 cables of full rank.
    """

def tensions_left_inverse(
    robot: Robot, state: PlatformState, rows: collections.abc.Sequence[WrenchRow]
) -> TensionModel:
    """
    Tensions by the paper's left inverse (eqs 11, 12) on n rows.
    """

def text_lines(
    text: bytes | typing.Annotated[numpy.typing.ArrayLike, numpy.uint8],
) -> tuple[numpy.typing.NDArray[numpy.int64], numpy.typing.NDArray[numpy.int32]]:
    """
    (begin [lines + 1], commas [lines]) of bytes: where each line begins (the last entry is the size) and how many commas it holds. The text is not copied.
    """

def to_yaml(robot: Robot) -> str:
    """
    The robot as a robot file that parse_robot reads back exactly.
    """

def track(
    calibration: Calibration, log: Log, segment: typing.SupportsInt | typing.SupportsIndex = -1
) -> Track:
    """
    Pose, twist and their covariances at every sample of a run, from its calibration: the log that was calibrated, or one that goes on counting from it. segment: which is the run, from 0, -1 the last. Raises InputError for a calibration without a pose that can be trusted.
    """

def verify_plan(robot: Robot, plan: Plan, bounds: Box | None = None) -> str:
    """
    '' when every set-point of a plan is an equilibrium of this robot and every path clear; otherwise what is wrong with which stop. Raises InputError for a plan of another robot.
    """

def with_effect_definitions(robot: Robot, yaml_text: str, source: str) -> Robot:
    """
    The robot with the effects that a text defines, beside its own; `source` is what messages call it. Raises InputError 'source:line:column: field: …'.
    """

def with_known_effects(robot: Robot, log: Log) -> tuple[Robot, Log]:
    """
    Robot and log with all that the robot lists for that log taken into account: faults of the readings set right, geometry and inertia changed, tensions without what the load cells add. For whoever looks at readings without a model. Raises InputError when the log is another robot's.
    """

def workspace_box(robot: Robot) -> Box:
    """
    Where a suspended platform may be: the pulleys' horizontal rectangle, down from the highest pulley by its larger side, not below the floor; down to the lowest pulley where cables of six or more pull from below, too.
    """

def workspace_shape(
    workspace: Workspace, alpha_m2: typing.SupportsFloat | typing.SupportsIndex | None = None
) -> AlphaShape:
    """
    The boundary as a watertight mesh; alpha_m2 is automatic unless given.
    """

def wrench_residual(
    robot: Robot,
    state: PlatformState,
    tension_N: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[6, 1]"]:
    """
    Xi^T tau - f [6] [N, Nm], world axes, about P: zero at a static equilibrium (eq. 6).
    """

def write_log(log: Log, path: os.PathLike[str] | str | bytes) -> None:
    """
    Writes the canonical CSV; read_log gives back the same numbers. Raises InputError when the file cannot be written.
    """

def write_mesh(
    path: os.PathLike[str] | str | bytes, mesh: Mesh, encoding: MeshEncoding = ...
) -> None:
    """
    Writes .ply (double precision) or .stl (single). Raises InputError.
    """

def write_plan(plan: Plan, path: os.PathLike[str] | str | bytes) -> None:
    """
    Writes a plan file. Raises InputError when it cannot be written.
    """
