"""``cdprcal track`` and what is behind it: pose and twist at every sample."""

from __future__ import annotations

import doctest
import json
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

import cdprcal
from cdprcal import Calibration, Robot, StartUpRun, Track
from cdprcal.pictures import new_figure
from cdprcal.ros2 import save_track_bag
from cdprcal.tracking import columns_of_track, track_as_dict
from cdprcal.tracking.pictures import draw_track
from conftest import Cli, changed, samples_of
from test_cli_bad_input import assert_refused
from test_schemas import validate

CHANNELS = ("length_m", "swivel_rad", "tension_N", "tension_setpoint_N", "roll_pitch_yaw_rad")


@pytest.fixture(scope="module")
def run(robot: Robot) -> StartUpRun:
    plan = cdprcal.StartUpPlan(setpoint_N=cdprcal.default_setpoints(robot, 2, 2, 1))
    made = cdprcal.simulate_startup(robot, plan, seed=3, log_rate_Hz=50.0)
    assert made.state == cdprcal.StartUpState.done, made.reason
    return made


@pytest.fixture(scope="module")
def calibration(robot: Robot, run: StartUpRun) -> Calibration:
    return cdprcal.calibrate(robot, run.log)


@pytest.fixture(scope="module")
def track(calibration: Calibration, run: StartUpRun) -> Track:
    return cdprcal._core.track(calibration, run.log)


@pytest.fixture
def path(run: StartUpRun, tmp_path: Path) -> Path:
    file = tmp_path / "run.csv"
    cdprcal.write_log(run.log, str(file))
    return file


def rows_of(log: cdprcal.Log, rows: Any) -> cdprcal.Log:
    return changed(log, **{name: getattr(log, name)[rows] for name in ("time_s", *CHANNELS)})


def slipped(log: cdprcal.Log, begin: int, end: int | None = None) -> cdprcal.Log:
    """Cable 1 reads 20 mm more from one sample to another."""
    length_m = log.length_m.copy()
    length_m[begin:end, 0] += 0.02
    return changed(log, length_m=length_m)


def test_the_arrays_are_the_samples(track: Track, run: StartUpRun) -> None:
    assert len(track) == len(run.log.time_s)
    np.testing.assert_array_equal(track.time_s, run.log.time_s)
    assert track.trusted.all()
    sample = track[17]
    np.testing.assert_array_equal(track.position_m[17], sample.pose.position_m)
    np.testing.assert_array_equal(track.twist[17], sample.twist)
    np.testing.assert_array_equal(track.pose_covariance[17], sample.pose_covariance)
    np.testing.assert_array_equal(track.twist_covariance[17], sample.twist_covariance)
    turned = cdprcal.rotation_from_euler(track.roll_pitch_yaw_rad[17], track.convention)
    np.testing.assert_allclose(turned, sample.pose.rotation, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(track.quaternion_wxyz, axis=1), 1.0)
    assert track[-1].time_s == run.log.time_s[-1]
    for index in (len(track), -len(track) - 1):
        with pytest.raises(IndexError):
            track[index]
    poses = [track[row].pose for row in range(len(track))]
    truth = [one.pose for one in run.truth]
    error = np.array(list(map(cdprcal.minus, truth, poses)))
    sigma = np.sqrt(np.diagonal(track.pose_covariance, axis1=1, axis2=2))
    assert 0.9 < (np.abs(error) < 1.96 * sigma).mean() < 0.99


def test_text_frame_and_picture(track: Track) -> None:
    assert repr(track) == (
        f"<Track of {len(track)} samples, 0.000 to {track.time_s[-1]:.3f} s, "
        f"{len(track)} to be trusted>"
    )
    assert repr(track[0]).startswith("<TrackedSample at 0.0")
    pytest.importorskip("pandas")
    frame = track.to_pandas()
    assert len(frame) == len(track)
    np.testing.assert_array_equal(frame["x_m"], track.position_m[:, 0])
    assert "<table" in track._repr_html_()
    from matplotlib.figure import Figure

    ax = Figure().subplots()
    assert track.plot(ax=ax) is ax
    assert ax.lines


def test_the_picture_says_what_its_bands_are(track: Track) -> None:
    figure = new_figure(9.0, 5.5)
    draw_track(track, figure.subplots(2, sharex=True))
    for axes, names in zip(figure.axes, (["x", "y", "z"], ["roll", "pitch", "yaw"]), strict=True):
        legend = axes.get_legend()
        assert legend is not None
        assert [text.get_text() for text in legend.get_texts()] == [*names, "± 2 σ"]


def test_streaming_is_tracking(calibration: Calibration, run: StartUpRun, track: Track) -> None:
    tracker = cdprcal.Tracker(calibration)
    assert np.isnan(tracker.latest.time_s)
    for row, sample in enumerate(samples_of(run.log)):
        now = tracker.add(sample)
        np.testing.assert_array_equal(now.pose.position_m, track.position_m[row])
        np.testing.assert_array_equal(now.twist, track.twist[row])
        np.testing.assert_array_equal(now.pose_covariance, track.pose_covariance[row])
        assert now.trusted == track.trusted[row]
    assert tracker.latest.time_s == run.log.time_s[-1]
    kept = tracker.latest
    with pytest.raises(cdprcal.InputError, match="give them in order"):
        tracker.add(next(samples_of(run.log)))
    assert tracker.latest.time_s == kept.time_s


def test_the_time_of_the_drives_counts(calibration: Calibration, run: StartUpRun) -> None:
    tracker = cdprcal.Tracker(calibration)
    sample = next(samples_of(run.log))
    sample.drives_time_s = 0.25
    assert tracker.add(sample).time_s == 0.25


def test_the_call_takes_paths(path: Path, track: Track) -> None:
    found = cdprcal.track("irma4", path)
    np.testing.assert_array_equal(found.position_m, track.position_m)
    again = cdprcal.track("irma4", path, cdprcal.calibrate("irma4", path), segment=0)
    np.testing.assert_array_equal(again.position_m, track.position_m)
    with pytest.raises(cdprcal.InputError, match="segment 7"):
        cdprcal.track("irma4", path, segment=7)


def test_a_calibration_without_a_pose_is_refused(robot: Robot, run: StartUpRun) -> None:
    poor = changed(run.log, swivel_rad=None, tension_N=None)
    options = cdprcal.CalibrateOptions(method=cdprcal.parse_method("kinematic"), at_s=[1.0, 10.0])
    calibration = cdprcal._core.calibrate(robot, poor, options)
    with pytest.raises(cdprcal.InputError, match="no pose that can be trusted"):
        cdprcal._core.track(calibration, poor)
    with pytest.raises(cdprcal.InputError, match="no pose that can be trusted"):
        cdprcal.Tracker(calibration)


def test_the_command_says_where_the_platform_is(
    cli: Cli, path: Path, tmp_path: Path, track: Track
) -> None:
    csv, png = tmp_path / "track.csv", tmp_path / "track.png"
    ran = cli("track", "irma4", path, "-o", csv, "--plot", png)
    assert ran.code in (0, 3), ran.stderr
    assert f"at {track.time_s[-1]:.3f} s: x " in ran.stdout
    assert "100 % of them to be trusted" in ran.stdout
    assert png.read_bytes().startswith(b"\x89PNG")
    assert png.stat().st_size > 20_000
    header, *lines = csv.read_text().splitlines()
    columns = columns_of_track(track)
    assert header == ",".join(columns)
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    for i, (name, expected) in enumerate(columns.items()):
        np.testing.assert_array_equal(values[:, i], expected, err_msg=name)
    assert len(columns) == 30


def test_the_document_is_what_the_schema_says(cli: Cli, path: Path, track: Track) -> None:
    ran = cli("track", "irma4", path, "--json")
    assert ran.code == cli("calibrate", "irma4", path, "--json").code
    document = json.loads(ran.stdout)
    validate("track", document)
    assert document["samples"] == document["trusted_samples"] == len(track)
    assert document["untrusted"] == []
    assert document["last"]["pose"]["position_m"] == track.position_m[-1].tolist()
    assert document["last"]["covariance"] == track.pose_covariance[-1].tolist()
    assert document["last"]["twist"] == track.twist[-1].tolist()
    speeds = np.linalg.norm(track.twist[:, :3], axis=1)
    assert document["largest_speed_m_s"] == speeds.max()


def test_a_reading_that_is_wrong_for_a_while_is_a_caveat(
    cli: Cli, run: StartUpRun, path: Path, tmp_path: Path
) -> None:
    rows = len(run.log.time_s)
    log = tmp_path / "slipped.csv"
    cdprcal.write_log(slipped(run.log, rows // 2, rows // 2 + 100), str(log))
    document = cli("track", "irma4", log, "--start", path, "--json").document(3)
    validate("track", document)
    assert document["last"]["trusted"]
    (first, *_) = document["untrusted"]
    assert first["reason"].startswith("length_1_m contradicts the other readings by ")
    assert document["trusted_samples"] + sum(s["samples"] for s in document["untrusted"]) == rows
    said = cli("track", "irma4", log, "--start", path)
    assert said.code == 3
    assert "not to be trusted from" in said.stdout
    assert document["longest_left_out_s"] > 1.0
    assert re.search(
        r"readings left out: they contradict the others, for up to \d\.\d s on end", said.stdout
    )


def test_a_reading_that_is_wrong_for_a_moment_is_a_spike(
    cli: Cli, run: StartUpRun, path: Path, tmp_path: Path
) -> None:
    row = len(run.log.time_s) // 2
    log = tmp_path / "spike.csv"
    cdprcal.write_log(slipped(run.log, row, row + 1), str(log))
    ran = cli("track", "irma4", log, "--start", path, "--json")
    assert json.loads(ran.stdout)["longest_left_out_s"] <= 0.1
    assert re.search(
        r"readings? left out: spikes", cli("track", "irma4", log, "--start", path).stdout
    )


def test_an_end_that_is_wrong_exits_with_1(
    cli: Cli, run: StartUpRun, path: Path, tmp_path: Path
) -> None:
    log, csv = tmp_path / "slipped.csv", tmp_path / "track.csv"
    time_s = run.log.time_s
    cdprcal.write_log(slipped(run.log, np.searchsorted(time_s, time_s[-1] - 0.35)), str(log))
    ran = cli("track", "irma4", log, "--start", path, "-o", csv)
    assert ran.code == 1
    assert "; not to be trusted" in ran.stdout.splitlines()[0]
    assert csv.read_text().splitlines()[-1].endswith(",0")


def test_without_the_one_reading_that_is_wrong_the_end_is_trusted(
    cli: Cli, run: StartUpRun, path: Path, tmp_path: Path
) -> None:
    log = tmp_path / "slipped.csv"
    time_s = run.log.time_s
    cdprcal.write_log(slipped(run.log, np.searchsorted(time_s, time_s[-1] - 5.0)), str(log))
    document = cli("track", "irma4", log, "--start", path, "--json").document(3)
    assert document["last"]["trusted"]
    assert len(document["untrusted"]) == 1
    assert "contradicts the other readings" in document["untrusted"][0]["reason"]
    assert document["longest_left_out_s"] > 4.0


def test_no_pose_to_start_from_exits_with_1(cli: Cli, run: StartUpRun, tmp_path: Path) -> None:
    log = tmp_path / "short.csv"
    few = changed(rows_of(run.log, slice(0, 40)), swivel_rad=None, tension_N=None)
    cdprcal.write_log(few, str(log))
    ran = cli("track", "irma4", log, "--json", "-o", tmp_path / "track.csv")
    assert ran.code == 1
    assert ran.stdout == ""
    assert "no initial pose to track from" in ran.stderr
    assert not (tmp_path / "track.csv").exists()


def test_a_log_goes_on_counting_from_its_start(
    cli: Cli, robot: Robot, run: StartUpRun, tmp_path: Path
) -> None:
    """Two parts of one run: the second is tracked from the first as the whole is, but for what the
    filter remembers of the speed and of the jerk."""
    cut = 3 * len(run.log.time_s) // 4
    first = rows_of(run.log, slice(0, cut))
    start, later, csv = (tmp_path / name for name in ("start.csv", "later.csv", "track.csv"))
    cdprcal.write_log(first, str(start))
    cdprcal.write_log(rows_of(run.log, slice(cut, None)), str(later))
    ran = cli("track", "irma4", later, "--start", start, "-o", csv)
    assert ran.code in (0, 3), ran.stderr
    whole = cdprcal._core.track(cdprcal.calibrate(robot, first), run.log)
    values = np.genfromtxt(csv, delimiter=",", names=True)
    np.testing.assert_array_equal(values["time_s"], whole.time_s[cut:])
    for i, name in enumerate(("x_m", "y_m", "z_m")):
        apart = np.abs(values[name] - whole.position_m[cut:, i])
        assert (apart < 4.0 * values[f"sigma_{name}"]).all()
        assert (apart[-50:] < values[f"sigma_{name}"][-50:]).all()


def messages(bag: Path, topic: str) -> list[Any]:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Reader(bag) as reader:
        wanted = [c for c in reader.connections if c.topic == topic]
        return [
            (stamp, store.deserialize_cdr(data, connection.msgtype))
            for connection, stamp, data in reader.messages(wanted)
        ]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_bag_holds_what_is_trusted(
    calibration: Calibration, run: StartUpRun, tmp_path: Path, storage: Any
) -> None:
    track = cdprcal._core.track(calibration, slipped(run.log, len(run.log.time_s) - 100))
    kept = np.flatnonzero(track.trusted)
    assert 0 < len(kept) < len(track)
    bag = tmp_path / "bag"
    save_track_bag(track, bag, storage=storage)
    poses, twists = messages(bag, "/pose"), messages(bag, "/twist")
    assert len(poses) == len(twists) == len(kept)
    for row, (stamp, pose), (_, twist) in list(zip(kept, poses, twists, strict=True))[::50]:
        assert stamp == round(1e9 * track.time_s[row])
        header = pose.header
        assert header.stamp.sec * 10**9 + header.stamp.nanosec == stamp
        assert header.frame_id == twist.header.frame_id == "world"
        at, turn = pose.pose.pose.position, pose.pose.pose.orientation
        np.testing.assert_array_equal([at.x, at.y, at.z], track.position_m[row])
        np.testing.assert_array_equal([turn.w, turn.x, turn.y, turn.z], track.quaternion_wxyz[row])
        np.testing.assert_array_equal(pose.pose.covariance, track.pose_covariance[row].ravel())
        linear, angular = twist.twist.twist.linear, twist.twist.twist.angular
        np.testing.assert_array_equal(
            [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z], track.twist[row]
        )
        np.testing.assert_array_equal(twist.twist.covariance, track.twist_covariance[row].ravel())
    with pytest.raises(cdprcal.InputError, match="exists already"):
        save_track_bag(track, bag)


def test_the_command_writes_a_bag(cli: Cli, path: Path, tmp_path: Path, track: Track) -> None:
    ran = cli("track", "irma4", path, "--bag", tmp_path / "bag")
    assert ran.code in (0, 3), ran.stderr
    assert len(messages(tmp_path / "bag", "/pose")) == len(track)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("-o", "track.txt"), ("track.txt", "give a track a name in .csv")),
        (("-o", "run.csv"), ("run.csv: is the log that is read", "-o")),
        (("--plot", "track.gif"), ("track.gif", r"\.png")),
        (("-o", "a.csv", "--plot", "a.csv"), ("a.csv: is the file of -o too",)),
        (("-o", "nowhere/track.csv"), ("nowhere/track.csv", "cannot be written")),
        (("--bag", "there"), ("there: exists already",)),
        (("--start", "no.csv"), ("no.csv",)),
        (("--segment", "9"), ("segment 9",)),
    ],
)
def test_wrong_use_is_refused(
    cli: Cli,
    path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    words: tuple[str, ...],
) -> None:
    monkeypatch.chdir(path.parent)
    Path("there").mkdir()
    before = path.read_bytes()
    assert_refused(cli("track", "irma4", "run.csv", *arguments), *words)
    assert path.read_bytes() == before
    assert sorted(p.name for p in path.parent.iterdir()) == ["run.csv", "there"]


def test_a_track_that_is_never_trusted_has_a_document(
    calibration: Calibration, run: StartUpRun
) -> None:
    """Sensors that are all silent: no numbers but a reason."""
    nothing = np.full((20, 4), np.nan)
    silent = changed(
        rows_of(run.log, slice(0, 20)),
        length_m=nothing,
        swivel_rad=nothing,
        roll_pitch_yaw_rad=nothing[:, :3],
    )
    found = cdprcal._core.track(calibration, silent)
    assert not found.trusted.any()
    document = json.loads(json.dumps(track_as_dict(found, 0.0), allow_nan=False))
    validate("track", document)
    assert document["largest_speed_m_s"] is None
    assert document["largest_standard_deviation"] == [None] * 6
    (stretch,) = document["untrusted"]
    assert "leave the pose open" in stretch["reason"]


def test_the_page_holds(cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = Path(__file__).resolve().parents[2] / "docs" / "tracking.md"
    text = page.read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (commands,) = re.findall(r"^```sh\n(.*?)^```$", text, re.M | re.S)
    for line in commands.splitlines():
        ran = cli(*shlex.split(line)[1:])
        assert ran.code in (0, 3), ran.stderr
    assert Path("track.png").exists()
    (session,) = re.findall(r"^```pycon\n(.*?)^```$", text, re.M | re.S)
    said: list[str] = []
    test = doctest.DocTestParser().get_doctest(session, {}, "tracking", str(page), 0)
    runner = doctest.DocTestRunner()
    runner.run(test, out=said.append)
    assert runner.failures == 0, "".join(said)
    for name in re.findall(r"`((?:x|velocity|angular_velocity|quaternion)_\w+)`", text):
        assert name in Path("track.csv").read_text().splitlines()[0].split(",")
