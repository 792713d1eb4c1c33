"""What a session file may hold. Lengths in m, forces in N, speeds of pay-out; see docs/hardware.md.

Every model is strict and knows no keys but these: a typing error is an error, never a default.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from cdprcal.hardware.session.objects import IntegerType, object_type, parse_object
from cdprcal.strict_yaml import misplaced

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Pair = Annotated[list[Finite], Field(min_length=2, max_length=2)]
Triple = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Sign = Literal[1, -1]
NodeId = Annotated[int, Field(ge=1, le=127)]


def _checked_object(text: str) -> str:
    parse_object(text)
    return text


def _increasing(pair: list[float]) -> list[float]:
    if not pair[0] < pair[1]:
        raise ValueError("the first must be less than the second")
    return pair


Object = Annotated[str, AfterValidator(_checked_object)]
Range = Annotated[Pair, AfterValidator(_increasing)]


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class CanopenBus(_Strict):
    """A CAN bus with CANopen nodes, by python-can."""

    type: Literal["canopen"]
    interface: str = Field(
        description="python-can interface: socketcan, pcan, kvaser, slcan … for real ones; virtual "
        "(in this process) and udp_multicast (on this machine) for simulated drives."
    )
    channel: str = Field(
        description="Channel of the interface, as can0. Of udp_multicast: the group, and a port if "
        "there are several busses on this machine, as 239.74.163.4:43200."
    )
    bitrate_bit_s: int = Field(
        1_000_000, gt=0, description="Ignored by socketcan: `ip link` sets it there."
    )
    master_node: NodeId = Field(127, description="Node number of this computer, for its heartbeat.")
    outputs: Literal["at_once", "next_sync"] = Field(
        "at_once", description="When a drive takes over a command: as it comes, or at the SYNC."
    )


class EthercatBus(_Strict):
    """An EtherCAT segment, by pysoem (extra `ethercat`). `node` counts the slaves from 1."""

    type: Literal["ethercat"]
    interface: str = Field(description="Network interface, as eth1.")
    sync0: bool = Field(False, description="Drives take over at the pulse of their own clocks.")


Bus = Annotated[CanopenBus | EthercatBus, Field(discriminator="type")]


class Limits(_Strict):
    """What never passes the last layer before the bus. Wider than what the plan needs."""

    tension_N: Range = Field(
        description="Beyond these a winch may only be moved back; beyond by a tenth, quick stop."
    )
    velocity_m_s: Positive = Field(description="Of cable, either way.")
    quick_stop_m_s2: Positive = Field(
        description="Deceleration of a quick stop, written to the drives (0x6085)."
    )
    travel_m: Positive | None = Field(
        None,
        description="How far a cable may go from its length at power-on, either way: a quick stop "
        "beyond, and the drives' position limits (0x607D) the stop's way further. None if left "
        "out.",
    )


class Safety(_Strict):
    """When the winches are stopped."""

    missed_cycles: int = Field(
        1,
        ge=0,
        le=10,
        description="Cycles in a row that a device may miss; one more is a quick stop.",
    )
    late_s: Positive | None = Field(
        None,
        description="A control cycle that begins later than this is a quick stop. A cycle if left "
        "out.",
    )
    brakes: bool = Field(
        description="true: the winches have brakes, and drives are switched off after a quick "
        "stop; false: they stay on and hold the platform at standstill."
    )
    wiggle_m: Annotated[Finite, Field(ge=0.0, le=0.005)] = Field(
        0.002,
        description="Before a run each cable is paid out by at most so much and reeled in again, "
        "less where tensions answer sooner: load cells, signs and scales are told apart by it. 0: "
        "not at all.",
    )
    heartbeat_s: Positive = Field(0.1, description="Of the drives; 2.5 of them missing are a stop.")


class LoadCell(_Strict):
    """A load cell on an analog input."""

    object: Object
    type: IntegerType
    counts_per_N: Positive
    zero_counts: Finite = Field(0.0, description="Reading of the unloaded cell.")
    sign: Sign = 1
    valid_counts: Range | None = Field(
        None,
        description="Readings outside mean a broken wire or a dead amplifier. The type's whole "
        "range but its ends if left out.",
    )
    node: NodeId | None = Field(None, description="Where the object is; the winch's own if absent.")


class Swivel(_Strict):
    """A swivel encoder, as the secondary encoder of a drive or on a node of its own."""

    object: Object
    type: IntegerType
    counts_per_turn: Positive
    sign: Sign = 1
    node: NodeId | None = Field(None, description="Where the object is; the winch's own if absent.")


class Torque(_Strict):
    """Between motor torque (0x6071, per mille of rated) and cable tension."""

    drum_radius_m: Positive
    gear_ratio: Positive = Field(1.0, description="Turns of the motor per turn of the drum.")
    rated_torque_Nm: Positive = Field(description="Of the motor, 0x6076.")
    efficiency: Annotated[float, Field(gt=0.5, le=1.0)] = Field(
        0.7,
        description="Of gear, drum and pulleys together, by their data sheets: how far torque and "
        "load cell may be apart at standstill.",
    )


class Winch(_Strict):
    """One cable's drive, load cell and swivel encoder."""

    cable: int = Field(ge=1, le=8)
    node: NodeId
    sign: Sign = Field(description="1: position counts grow as cable is paid out; -1: as it is "
                       "reeled in.")  # fmt: skip
    counts_per_m: Positive = Field(description="Position counts (0x6064) per metre of cable.")
    velocity_units_per_m_s: Positive | None = Field(
        None, description="Units of 0x60FF at 1 m/s; counts_per_m if absent (counts per second)."
    )
    deceleration_units_per_m_s2: Positive | None = Field(
        None, description="Units of 0x6085 at 1 m/s²; velocity_units_per_m_s if absent."
    )
    load_cell: LoadCell
    swivel: Swivel | None = None
    torque: Torque | None = Field(None, description="Needed in mode torque.")
    serial_number: int | None = Field(
        None, ge=0, description="Of the drive (0x1018:04); another one there is refused."
    )

    @property
    def velocity_scale(self) -> float:
        """Units of 0x60FF at 1 m/s."""
        return self.velocity_units_per_m_s or self.counts_per_m

    @property
    def deceleration_scale(self) -> float:
        """Units of 0x6085 at 1 m/s²."""
        return self.deceleration_units_per_m_s2 or self.velocity_scale

    @property
    def load_cell_range(self) -> tuple[float, float]:
        """Counts that a load cell that is alive can give."""
        if self.load_cell.valid_counts is not None:
            return self.load_cell.valid_counts[0], self.load_cell.valid_counts[1]
        low, high = object_type(self.load_cell.type).range
        return low + 1.0, high - 1.0


class Ahrs(_Strict):
    """An Xsens MTi on a serial port."""

    port: str = Field(description="Serial device, as /dev/ttyUSB0; 'simulated' with simulated "
                      "drives in this process.")  # fmt: skip
    baudrate_bit_s: int = Field(115_200, gt=0)
    rate_Hz: int = Field(100, ge=1, le=400)
    output: Literal["quaternion", "euler"] = "quaternion"
    precision: Literal["float32", "float64"] = "float32"
    frame: Literal["ENU", "NED", "NWU"] = "ENU"
    mounting_deg: Triple = Field(
        [0.0, 0.0, 0.0],
        description="Roll, pitch, yaw (ZYX) that turn the platform's axes into the sensor's.",
    )
    inertial_unit: bool = Field(
        False, description="Whether its accelerometer and gyroscope are logged too."
    )
    stale_s: Positive | None = Field(
        None,
        description="A reading older than this is a quick stop. If left out: half a cycle more "
        "than missed_cycles, of the bus or the AHRS, whichever is longer.",
    )


class Ros2(_Strict):
    """Names in ROS 2 bags."""

    joint_states: str = Field("/joint_states", description="sensor_msgs/JointState")
    imu: str = Field("/imu/data", description="sensor_msgs/Imu")
    wrenches: list[str] = Field(
        [], description="geometry_msgs/WrenchStamped, one a cable; tension is the norm of the force"
    )
    setpoints: str = Field(
        "/tension_setpoints", description="sensor_msgs/JointState, effort: tension set-points"
    )
    length_joints: list[str] = Field([], description="Joints of the winches; cable_N if empty.")
    swivel_joints: list[str] = Field([], description="Joints of the swivels; swivel_N if empty.")
    length_per_position_m: Positive = Field(
        1.0, description="Cable a unit of joint position: 1 for prismatic joints, the drum's "
        "radius for revolute ones."
    )  # fmt: skip
    length_sign: Sign = 1
    swivel_sign: Sign = 1
    tension_sign: Sign = Field(1, description="Of a joint's effort, when it is the tension.")
    mounting_deg: Triple = Field(
        [0.0, 0.0, 0.0],
        description="Roll, pitch, yaw (ZYX) that turn the platform's axes into the IMU's.",
    )


class Simulated(_Strict):
    """Present: the drives are simulated. Only on the buses virtual and udp_multicast."""

    speed: Annotated[float, Field(ge=0.0)] = Field(
        0.0, description="Simulated seconds per second; 0: as fast as it goes."
    )
    axial_stiffness_N: Positive = Field(
        1.5e5, description="EA of the cables. Much stiffer ones than this default need a tension "
        "loop in the drive, or mode torque."
    )  # fmt: skip


class TopicMap(_Strict):
    """What bags need of a session: its robot and its topics."""

    format: Literal["cdprcal-session-1"]
    robot: str = Field(description="Name in the robot file; another robot is refused.")
    ros2: Ros2 | None = None


class Session(TopicMap):
    """The devices of one robot."""

    rate_Hz: Annotated[float, Field(ge=50.0, le=1000.0)] = 100.0
    mode: Literal["velocity", "torque"] = Field(
        "velocity",
        description="velocity: cyclic synchronous velocity (9), tensions are controlled here; "
        "torque: cyclic synchronous torque (10).",
    )
    bus: Bus
    limits: Limits
    safety: Safety
    winches: list[Winch] = Field(min_length=1, max_length=8)
    ahrs: Ahrs | None = None
    simulated: Simulated | None = None

    @property
    def period_s(self) -> float:
        """Of the control cycle."""
        return 1.0 / self.rate_Hz

    @property
    def late_s(self) -> float:
        """How late a cycle may begin."""
        return self.safety.late_s or self.period_s

    @property
    def ahrs_stale_s(self) -> float:
        """How long the AHRS may be silent."""
        if self.ahrs is None:
            return math.inf
        cycle = max(self.period_s, 1.0 / self.ahrs.rate_Hz)
        return self.ahrs.stale_s or (self.safety.missed_cycles + 0.5) * cycle

    @property
    def is_simulated(self) -> bool:
        """The drives cannot be real ones: nothing needs arming."""
        return self.simulated is not None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self._check_winches()
        interface = self.bus.interface
        if self.is_simulated and (
            not isinstance(self.bus, CanopenBus) or interface not in ("virtual", "udp_multicast")
        ):
            raise misplaced(
                "bus.interface",
                "simulated drives live on virtual or udp_multicast; take `simulated` out for real "
                "ones",
            )
        in_process = self.is_simulated and interface == "virtual"
        if self.ahrs is not None and self.ahrs.port == "simulated" and not in_process:
            raise misplaced("ahrs.port", "simulated needs `simulated` and the interface virtual")
        return self

    def _check_winches(self) -> None:
        count = len(self.winches)
        cables: set[int] = set()
        nodes: set[int] = set()
        for at, winch in enumerate(self.winches):
            here = f"winches.{at}"
            if winch.cable > count or winch.cable in cables:
                raise misplaced(
                    f"{here}.cable", f"{count} winches need the cables 1 to {count}, each once"
                )
            if winch.node in nodes:
                raise misplaced(f"{here}.node", "another winch has this node; give each its own")
            if isinstance(self.bus, CanopenBus) and self.bus.master_node == winch.node:
                raise misplaced(f"{here}.node", "is bus.master_node too; give another")
            if self.mode == "torque" and winch.torque is None:
                raise misplaced(here, "mode torque needs a torque section")
            if (winch.swivel is None) != (self.winches[0].swivel is None):
                raise misplaced(here, "give all winches a swivel encoder, or none")
            cables.add(winch.cable)
            nodes.add(winch.node)
