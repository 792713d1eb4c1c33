"""Raw files as labs have them, made from a log: each a maker, and what a person has to correct.

A maker writes a file (or folder) and gives its path. Corrections are replacements in lines of the
proposed mapping file, at most two.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import cdprcal
from cdprcal.hardware.xsens.measurement import quaternion_from_rotation

Floats = NDArray[np.float64]
Maker = Callable[[cdprcal.Log, Path], Path]
KGF, LBF = 9.80665, 4.4482216


@dataclass(frozen=True)
class Shape:
    """A maker and the lines that a person corrects: (from, to)."""

    make: Maker
    groups: str  #: what the file holds beside lengths: s(wivels), t(ensions), p (set-points)
    corrections: tuple[tuple[str, str], ...] = ()


def deg(values: Any) -> Floats:
    return np.asarray(np.rad2deg(values), dtype=np.float64)


def table(*blocks: Any) -> Floats:
    return np.column_stack(blocks)


def cells(values: Floats, digits: int, decimal: str = ".") -> list[list[str]]:
    return [[f"{v:.{digits}f}".replace(".", decimal) for v in row] for row in values]


def written(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join([*lines, ""]))
    return path


def german_excel(log: cdprcal.Log, folder: Path) -> Path:
    """Excel in German: semicolons, decimal commas, cp1252, ms, mm, degrees."""
    header = ["Zeit [ms]", *(f"Seillänge {i} [mm]" for i in range(1, 5))]
    header += [f"Umlenkwinkel {i} [°]" for i in range(1, 5)]
    header += [f"Seilkraft {i} [N]" for i in range(1, 5)]
    header += ["Rollwinkel [°]", "Nickwinkel [°]", "Gierwinkel [°]"]
    values = table(1e3 * log.time_s, 1e3 * log.length_m, deg(log.swivel_rad), log.tension_N,
                   deg(log.roll_pitch_yaw_rad))  # fmt: skip
    lines = [";".join(header), *(";".join(row) for row in cells(values, 4, ","))]
    path = folder / "Messung 3.csv"
    path.write_bytes("\r\n".join([*lines, ""]).encode("cp1252"))
    return path


def labview(log: cdprcal.Log, folder: Path) -> Path:
    """LabVIEW: a preamble, tabs, decimal commas, the time of day."""
    head = ["LabVIEW Measurement", "Writer_Version\t2", "Separator\tTab", "Operator\tlab 2",
            "***End_of_Header***", ""]  # fmt: skip
    names = [
        "Time",
        *(f"Cable{i} (mm)" for i in range(4)),
        *(f"Load cell {i} (N)" for i in range(4)),
    ]
    names += ["Roll (deg)", "Pitch (deg)", "Yaw (deg)"]
    values = table(1e3 * log.length_m, log.tension_N, deg(log.roll_pitch_yaw_rad))
    lines = []
    for time, row in zip(log.time_s.tolist(), cells(values, 5, ","), strict=True):
        minutes, seconds = divmod(time + 37.5, 60.0)
        clock = f"14:{12 + int(minutes):02d}:{seconds:06.3f}".replace(".", ",")
        lines.append("\t".join([clock, *row]))
    return written(folder / "run.lvm", [*head, "\t".join(names), *lines])


def pandas_index(log: cdprcal.Log, folder: Path) -> Path:
    """to_csv of a data frame: an index without a name, ISO dates, cables from 0, radians."""
    names = ["", "timestamp", *(f"L{i}" for i in range(4)), *(f"swivel_{i}" for i in range(4))]
    names += [*(f"tension_{i}" for i in range(4)), "roll", "pitch", "yaw"]
    values = table(log.length_m, log.swivel_rad, log.tension_N, log.roll_pitch_yaw_rad)
    lines = [",".join(names)]
    begin = np.datetime64("2026-03-01T23:59:30", "ms")  # over midnight
    for i, row in enumerate(cells(values, 6)):
        stamp = begin + np.timedelta64(round(1e3 * float(log.time_s[i])), "ms")
        lines.append(",".join([str(i), str(stamp).replace("T", " "), *row]))
    return written(folder / "frame.csv", lines)


def savetxt(log: cdprcal.Log, folder: Path) -> Path:
    """numpy.savetxt: blanks, no names, no units."""
    path = folder / "log.txt"
    values = table(log.time_s, log.length_m, log.swivel_rad, log.tension_N, log.roll_pitch_yaw_rad)
    np.savetxt(path, values)
    return path


def kilograms(log: cdprcal.Log, folder: Path) -> Path:
    """Load cells of a crane shop, in kgf without saying so; lengths in cm."""
    names = ["t", *(f"rope{i}_cm" for i in range(1, 5)), *(f"load{i}" for i in range(1, 5))]
    names += ["phi_deg", "theta_deg", "psi_deg"]
    values = table(
        log.time_s, 100.0 * log.length_m, log.tension_N / KGF, deg(log.roll_pitch_yaw_rad)
    )
    return written(folder / "crane.csv", [",".join(row) for row in (names, *cells(values, 5))])


def compass(log: cdprcal.Log, folder: Path) -> Path:
    """A heading from 0 to 360 degrees, clockwise, and nothing says degrees."""
    names = ["time", *(f"len{i}" for i in range(1, 5)), *(f"force{i}" for i in range(1, 5))]
    names += ["roll", "pitch", "heading"]
    angles = deg(log.roll_pitch_yaw_rad)
    angles[:, 2] = np.mod(90.0 - angles[:, 2], 360.0)
    values = table(log.time_s, log.length_m, log.tension_N, angles)
    return written(folder / "nav.csv", [", ".join(row) for row in (names, *cells(values, 5))])


def left_handed(log: cdprcal.Log, folder: Path) -> Path:
    """Yaw of the left hand, cables counted as they are reeled in, swivels the other way."""
    names = ["time_s", *(f"cable_{c}_m" for c in "abcd"), *(f"swivel_{c}_deg" for c in "abcd")]
    names += [*(f"tension_{c}_N" for c in "abcd"), "roll_deg", "pitch_deg", "yaw_deg"]
    angles = deg(log.roll_pitch_yaw_rad) * np.array([1.0, 1.0, -1.0])
    values = table(log.time_s, -log.length_m, -deg(log.swivel_rad), log.tension_N, angles)
    return written(folder / "left.csv", [",".join(row) for row in (names, *cells(values, 6))])


def counts(log: cdprcal.Log, folder: Path) -> Path:
    """Raw encoder counts that fall as cable is paid out; a known rate and no time."""
    names = [*(f"enc{i}" for i in range(1, 5)), *(f"F{i}_N" for i in range(1, 5))]
    names += ["roll_rad", "pitch_rad", "yaw_rad"]
    values = table(np.round(-log.length_m / 1e-5), log.tension_N, log.roll_pitch_yaw_rad)
    return written(folder / "plc.csv", [";".join(row) for row in (names, *cells(values, 6))])


def units_row(log: cdprcal.Log, folder: Path) -> Path:
    """A data logger: names, units below, comments, a mode of words, set-points, speeds."""
    names = ["Time", "Mode", *(f"Wire{i}.Length" for i in range(1, 5))]
    names += [*(f"Wire{i}.Speed" for i in range(1, 5)), *(f"Wire{i}.Force" for i in range(1, 5))]
    names += [*(f"Wire{i}.ForceCmd" for i in range(1, 5)), "Euler_X", "Euler_Y", "Euler_Z"]
    units = ["s", "-", *["mm"] * 4, *["m/s"] * 4, *["kN"] * 4, *["kN"] * 4, *["deg"] * 3]
    speed = np.gradient(np.asarray(log.length_m), axis=0)
    head = table(1e3 * log.length_m, speed, 1e-3 * log.tension_N, 1e-3 * log.tension_setpoint_N,
                 deg(log.roll_pitch_yaw_rad))  # fmt: skip
    lines = ["# logger v7", ",".join(names), ",".join(units)]
    for time, row in zip(log.time_s.tolist(), cells(head, 7), strict=True):
        lines.append(",".join([f"{time:.3f}", "HOLD", *row]))
    return written(folder / "logger.csv", lines)


def utf16(log: cdprcal.Log, folder: Path) -> Path:
    """A spreadsheet's Unicode text: UTF-16, tabs, French names."""
    names = ["Temps (s)", *(f"Longueur câble {i} (m)" for i in range(1, 5))]
    names += [*(f"Force {i} (daN)" for i in range(1, 5))]
    names += ["Roulis (deg)", "Tangage (deg)", "Lacet (deg)"]
    values = table(log.time_s, log.length_m, log.tension_N / 10.0, deg(log.roll_pitch_yaw_rad))
    lines = ["\t".join(names), *("\t".join(row) for row in cells(values, 6, ","))]
    path = folder / "essai.txt"
    path.write_bytes("\r\n".join([*lines, ""]).encode("utf-16"))
    return path


def simulink(log: cdprcal.Log, folder: Path) -> Path:
    """Simulink's structure with time: signals with labels."""
    io = pytest.importorskip("scipy.io")
    signals = [
        {"values": np.array(log.length_m), "dimensions": 4.0, "label": "cable lengths"},
        {"values": np.array(log.swivel_rad), "dimensions": 4.0, "label": "swivel angles"},
        {"values": np.array(log.tension_N), "dimensions": 4.0, "label": "cable forces"},
        {"values": np.array(log.roll_pitch_yaw_rad[:, 0]), "dimensions": 1.0, "label": "roll"},
        {"values": np.array(log.roll_pitch_yaw_rad[:, 1]), "dimensions": 1.0, "label": "pitch"},
        {"values": np.array(log.roll_pitch_yaw_rad[:, 2]), "dimensions": 1.0, "label": "yaw"},
    ]
    path = folder / "ScopeData.mat"
    held = {"time": np.array(log.time_s)[:, None], "signals": signals, "blockName": "rig/Scope"}
    io.savemat(path, {"ScopeData": held})
    return path


def matlab(log: cdprcal.Log, folder: Path) -> Path:
    """Vectors and matrices of a workspace, beside parameters; forces in pounds, nothing says so."""
    io = pytest.importorskip("scipy.io")
    angles = deg(log.roll_pitch_yaw_rad)
    held: dict[str, Any] = {
        "t": np.array(log.time_s),
        "L": 1e3 * log.length_m,
        "F": log.tension_N / LBF,
    }
    held |= {"phi": angles[:, 0], "theta": angles[:, 1], "psi": angles[:, 2], "m": 12.992}
    path = folder / "exp12.mat"
    io.savemat(path, held | {"A": np.eye(4)})
    return path


def matlab_73(log: cdprcal.Log, folder: Path) -> Path:
    """MATLAB's version 7.3, which is HDF5: arrays transposed, a structure, words, references."""
    h5 = pytest.importorskip("h5py")
    path = folder / "exp13.mat"
    angles = deg(log.roll_pitch_yaw_rad)
    with h5.File(path, "w", userblock_size=512) as file:
        file["out/time"] = np.asarray(log.time_s)[None, :]
        file["out/swivel"] = log.swivel_rad.T
        for axis, column in zip(("roll_deg", "pitch_deg", "yaw_deg"), angles.T, strict=True):
            file[f"out/{axis}"] = column[None, :]
        words = {"label1": "cable length", "label2": "cable force", "note": "all well"}
        for name, text in words.items():
            file[f"#refs#/{name}"] = np.array([[ord(letter)] for letter in text], dtype=np.uint16)
            file[f"#refs#/{name}"].attrs["MATLAB_class"] = np.bytes_("char")
        file["#refs#/values1"], file["#refs#/values2"] = 1e3 * log.length_m.T, log.tension_N.T
        for field in ("label", "values"):
            of_two = file.create_dataset(f"signals/{field}", (2, 1), dtype=h5.ref_dtype)
            for i in range(2):
                of_two[i, 0] = file[f"#refs#/{field}{i + 1}"].ref
        file["comment"] = file["#refs#/note"]
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM"
    with path.open("r+b") as stream:
        stream.write(head)
    return path


def hdf5(log: cdprcal.Log, folder: Path) -> Path:
    """HDF5 of a data recorder: groups a device, units as attributes, a table of an AHRS."""
    h5 = pytest.importorskip("h5py")
    path = folder / "run_0007.h5"
    attitude = np.zeros(len(log.time_s), dtype=[("roll", "f4"), ("pitch", "f4"), ("yaw", "f4")])
    for axis, column in zip(("roll", "pitch", "yaw"), log.roll_pitch_yaw_rad.T, strict=True):
        attitude[axis] = column
    with h5.File(path, "w") as file:
        for name, values, unit in (
            ("time", log.time_s, "s"),
            ("winches/length", 1e3 * log.length_m, "mm"),
            ("winches/force", 1e-3 * log.tension_N, "kN"),
        ):
            file[name] = values
            file[name].attrs["units"] = unit
        file["ahrs"] = attitude
        file["operator"] = "nobody"
    return path


def workbook(log: cdprcal.Log, folder: Path) -> Path:
    """Excel: a sheet of notes, one of readings under merged names, dates, units below."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Rig", 4])
    sheet = book.create_sheet("Messung")
    sheet.append(["Rig 4, trial 7"])
    sheet.append(["", "Length", "", "", "", "Force", "", "", "", "Attitude"])
    for first, last in ((2, 5), (6, 9), (10, 12)):
        sheet.merge_cells(start_row=2, end_row=2, start_column=first, end_column=last)
    sheet.append(["time", 1, 2, 3, 4, 1, 2, 3, 4, "roll", "pitch", "yaw"])
    sheet.append(["", *["mm"] * 4, *["N"] * 4, *["deg"] * 3])
    begin = datetime(2026, 3, 1, 12)
    values = table(1e3 * log.length_m, log.tension_N, deg(log.roll_pitch_yaw_rad))
    for time, row in zip(log.time_s.tolist(), values.tolist(), strict=True):
        sheet.append([begin + timedelta(seconds=time), *row])
    path = folder / "Messung 4.xlsx"
    book.save(path)
    return path


def merged_names(log: cdprcal.Log, folder: Path) -> Path:
    """A data frame with names of two levels, as pandas writes them."""
    upper = ["t", *["length"] * 4, *["tension"] * 4, *["attitude"] * 3]
    lower = ["", *"1234", *"1234", "roll", "pitch", "yaw"]
    values = table(log.time_s, log.length_m, log.tension_N, log.roll_pitch_yaw_rad)
    lines = [",".join(row) for row in (upper, lower, *cells(values, 6))]
    return written(folder / "levels.csv", lines)


def parquet(log: cdprcal.Log, folder: Path) -> Path:
    """A data lake: time stamps, lists a cable, quaternions."""
    pa = pytest.importorskip("pyarrow")
    from pyarrow import parquet as pq

    begin = np.datetime64("2026-03-01T12:00:00", "ns")
    stamps = begin + np.round(1e9 * np.asarray(log.time_s)).astype("timedelta64[ns]")
    columns = {"stamp": pa.array(stamps)}
    for name, values in (("cable_length", 1e3 * log.length_m), ("cable_tension", log.tension_N)):
        columns[name] = pa.array(values.tolist(), type=pa.list_(pa.float64()))
    columns |= {f"q{axis}": q for axis, q in zip("wxyz", quaternions(log).T, strict=True)}
    path = folder / "part-0000.parquet"
    pq.write_table(pa.table(columns), path)
    return path


def feather(log: cdprcal.Log, folder: Path) -> Path:
    """A data frame on disk: microseconds, single precision, cables by their corners."""
    pa = pytest.importorskip("pyarrow")
    from pyarrow import feather as writer

    corners = ("fr", "fl", "rl", "rr")
    held: dict[str, Any] = {"time_us": np.round(1e6 * np.asarray(log.time_s)).astype(np.int64)}
    for i, corner in enumerate(corners):
        held[f"len_{corner}"] = np.float32(log.length_m[:, i])
        held[f"load_{corner}"] = np.float32(log.tension_N[:, i])
    for i, axis in enumerate(("roll", "pitch", "yaw")):
        held[axis] = np.float32(log.roll_pitch_yaw_rad[:, i])
    path = folder / "run.feather"
    writer.write_feather(pa.table(held), str(path))
    return path


def json_lines(log: cdprcal.Log, folder: Path) -> Path:
    """A data logger of the web: an object a line, arrays, a text, null where nothing was read."""
    lines = []
    blocks = (log.time_s, log.length_m, log.tension_N, log.roll_pitch_yaw_rad)
    for time, lengths, tensions, angles in zip(
        *(np.asarray(block).tolist() for block in blocks), strict=True
    ):
        held = {"t": time, "phase": "run", "lengths": lengths, "tension": tensions, "spare": None}
        held |= {"imu": dict(zip(("roll", "pitch", "yaw"), angles, strict=True))}
        lines.append(json.dumps(held))
    path = folder / "log.jsonl"
    path.write_text("\n".join([*lines, lines[-1][:50]]))  # cut off as the power went
    return path


def signals_of(log: cdprcal.Log) -> dict[str, Floats]:
    """Every reading by a name of its own, in mm, N and degrees."""
    out: dict[str, Floats] = {}
    for i in range(4):
        out[f"length_{i + 1}"] = 1e3 * np.asarray(log.length_m[:, i])
        out[f"force_{i + 1}"] = np.asarray(log.tension_N[:, i])
    for i, angle in enumerate(("roll", "pitch", "yaw")):
        out[angle] = deg(log.roll_pitch_yaw_rad[:, i])
    return out


def influx(log: cdprcal.Log, folder: Path) -> Path:
    """Annotated CSV of InfluxDB: a reading a row, one signal after another, each a table."""
    begin = np.datetime64("2026-03-01T11:00:00", "us")
    stamps = [f"{begin + np.timedelta64(round(1e6 * t), 'us')}Z" for t in log.time_s.tolist()]
    lines = []
    for table_id, (name, values) in enumerate(signals_of(log).items()):
        lines += ["#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,double,string,string",
                  "#group,false,false,true,false,false,true,true", "#default,_result,,,,,,",
                  ",result,table,_start,_time,_value,_field,_measurement"]  # fmt: skip
        lines += [f",,{table_id},2026-03-01T10:59:00Z,{stamp},{value:.6f},{name},robot"
                  for stamp, value in zip(stamps, values.tolist(), strict=True)]  # fmt: skip
        lines.append("")
    path = folder / "influx.csv"
    path.write_text("\n".join(lines))
    return path


def historian(log: cdprcal.Log, folder: Path) -> Path:
    """A plant's historian: a reading a row, the tag and its unit beside, decimal commas."""
    units = {"length": "mm", "force": "N"}
    lines = ["Zeit [s];Signal;Wert;Einheit"]
    for i, time in enumerate(log.time_s.tolist()):
        for name, values in signals_of(log).items():
            unit = units.get(name.partition("_")[0], "deg")
            lines.append(f"{time:.4f};{name};{values[i]:.6f};{unit}".replace(".", ","))
    return written(folder / "historian.csv", lines)


def quoted_commas(log: cdprcal.Log, folder: Path) -> Path:
    """Decimal commas in quotes between commas; the first row has no time yet."""
    names = ["Zeit [s]", *(f"Seil {i} Länge [mm]" for i in range(1, 5))]
    names += [*(f"Zugspannung F{i} [N]" for i in range(1, 5)), "Roll [°]", "Nick [°]", "Gier [°]"]
    values = table(log.time_s, 1e3 * log.length_m, log.tension_N, deg(log.roll_pitch_yaw_rad))
    rows = cells(values, 5, ",")
    lines = [",".join(f'"{cell}"' for cell in row) for row in (names, ["", *rows[0][1:]], *rows)]
    return written(folder / "quoted.csv", lines)


def whole_quaternions(log: cdprcal.Log, folder: Path) -> Path:
    """Quaternions as whole numbers, numbered from w; two numbers in a name; an index of pandas
    beside a clock that stands still now and then; what was commanded before what was read."""
    names = ["", "t", *(f"TargetPosition_{i} [mm]" for i in range(1, 5))]
    names += [*(f"current_position_{i + 1}_AI{i} [mm]" for i in range(4))]
    names += [*(f"LC{i}_500N" for i in range(1, 5)), *(f"quat{i}" for i in range(1, 5))]
    lengths = 1e3 * log.length_m
    values = table(log.time_s, np.round(lengths) + 5.0, lengths, log.tension_N)
    lines = [",".join(names)]
    for row, q in zip(cells(values, 5), np.round(1e6 * quaternions(log)), strict=True):
        lines.append(",".join([str(len(lines)), *row, *(f"{part:.0f}" for part in q)]))
        if len(lines) % 40 == 0:
            lines.append(lines[-1])
    return written(folder / "bits.csv", lines)


def quaternions(log: cdprcal.Log) -> Floats:
    """[N, 4] w, x, y, z."""
    convention = cdprcal.load_robot("irma4").euler_convention
    angles = np.asarray(log.roll_pitch_yaw_rad)
    poses = (cdprcal.Pose.from_euler(np.zeros(3), row, convention) for row in angles)
    return np.array([quaternion_from_rotation(pose.rotation) for pose in poses])


def write_bag(path: Path, topics: dict[str, tuple[str, list[Any]]], time_s: Floats) -> Path:
    """A bag with a message of every topic at every time."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for name, (kind, messages) in topics.items():
            link = writer.add_connection(name, kind, typestore=store)
            for time, message in zip(time_s.tolist(), messages, strict=True):
                taken = 1_772_366_400_000_000_000 + round(1e9 * time)
                writer.write(link, taken, store.serialize_cdr(message, kind))
    return path


def _types() -> Any:
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE).types


def _header(types: Any, time: float) -> Any:
    nanoseconds = 1_772_366_400_000_000_000 + round(1e9 * time)
    stamp = types["builtin_interfaces/msg/Time"](
        nanoseconds // 1_000_000_000, nanoseconds % 1_000_000_000
    )
    return types["std_msgs/msg/Header"](stamp, "base")


def _imu(types: Any, log: cdprcal.Log) -> list[Any]:
    vector, zeros = types["geometry_msgs/msg/Vector3"], np.zeros(9)
    return [
        types["sensor_msgs/msg/Imu"](
            _header(types, time),
            types["geometry_msgs/msg/Quaternion"](x, y, z, w),
            zeros, vector(0.0, 0.0, 0.0), zeros, vector(0.0, 0.0, 9.81), zeros,
        )
        for time, (w, x, y, z) in zip(log.time_s.tolist(), quaternions(log).tolist(), strict=True)
    ]  # fmt: skip


def bag_of_joints(log: cdprcal.Log, folder: Path) -> Path:
    """Winches under ros2_control by corners: drums of 50 mm, efforts in Nm, an IMU elsewhere."""
    types, joints = _types(), ["winch_fr", "winch_fl", "winch_rl", "winch_rr"]
    states = [
        types["sensor_msgs/msg/JointState"](
            _header(types, time), joints, length / 0.05, np.zeros(4), tension * 0.05
        )
        for time, length, tension in zip(
            log.time_s.tolist(), log.length_m, log.tension_N, strict=True
        )
    ]
    topics = {
        "/rig/winches": ("sensor_msgs/msg/JointState", states),
        "/platform/ahrs": ("sensor_msgs/msg/Imu", _imu(types, log)),
    }
    return write_bag(folder / "bag", topics, log.time_s)


def bag_of_arrays(log: cdprcal.Log, folder: Path) -> Path:
    """Arrays without stamps, a wrench a cable, an IMU: a robot that a student wired up."""
    types = _types()
    layout = types["std_msgs/msg/MultiArrayLayout"]([], 0)
    vector = types["geometry_msgs/msg/Vector3"]
    lengths = [types["std_msgs/msg/Float64MultiArray"](layout, row) for row in log.length_m]
    topics: dict[str, tuple[str, list[Any]]] = {
        "/rope_lengths": ("std_msgs/msg/Float64MultiArray", lengths),
        "/imu": ("sensor_msgs/msg/Imu", _imu(types, log)),
    }
    for i in range(4):
        topics[f"/loadcell_{i}"] = (
            "geometry_msgs/msg/WrenchStamped",
            [
                types["geometry_msgs/msg/WrenchStamped"](
                    _header(types, time),
                    types["geometry_msgs/msg/Wrench"](
                        vector(0.6 * force, 0.0, -0.8 * force), vector(0.0, 0.0, 0.0)
                    ),
                )
                for time, force in zip(
                    log.time_s.tolist(), log.tension_N[:, i].tolist(), strict=True
                )
            ],
        )
    return write_bag(folder / "student", topics, log.time_s)


SHAPES = {
    "German Excel": Shape(german_excel, "st"),
    "LabVIEW": Shape(labview, "t"),
    "pandas with an index": Shape(pandas_index, "st"),
    "numpy.savetxt": Shape(savetxt, "st"),
    "kgf, unsaid": Shape(kilograms, "t"),
    "compass heading": Shape(compass, "t"),
    "left-handed": Shape(left_handed, "st"),
    "encoder counts": Shape(
        counts,
        "t",
        (
            (r"rate_Hz: \S+}", "rate_Hz: 10}"),
            (r"(lengths: .*unit: )\S+, sign: \S+}", r"\g<1>1e-5, sign: -1}"),
        ),
    ),
    "units below names": Shape(units_row, "tp"),
    "UTF-16, French": Shape(utf16, "t"),
    "Simulink": Shape(simulink, "st"),
    "MATLAB workspace": Shape(matlab, "t"),
    "MATLAB 7.3": Shape(matlab_73, "st"),
    "HDF5": Shape(hdf5, "t"),
    "Excel workbook": Shape(workbook, "t"),
    "names in two lines": Shape(merged_names, "t"),
    "Parquet": Shape(parquet, "t"),
    "Feather": Shape(feather, "t"),
    "JSON lines": Shape(json_lines, "t"),
    "InfluxDB": Shape(influx, "t"),
    "historian": Shape(historian, "t"),
    "quoted decimal commas": Shape(quoted_commas, "t"),
    "whole quaternions": Shape(whole_quaternions, "t"),
    "bag of joints": Shape(
        bag_of_joints,
        "t",
        (
            (r"(lengths: .*unit: )\S+,", r"\g<1>0.05,"),
            (r"(tensions: .*unit: )\S+,", r"\g<1>20,"),
        ),
    ),
    "bag of arrays": Shape(bag_of_arrays, "t"),
}
