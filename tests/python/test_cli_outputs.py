"""What commands write: never over what they read, all of it or nothing, and trusted only if so."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdprcal
from cdprcal import InputError
from cdprcal.io.replacing import refuse_to_replace
from conftest import Cli, changed

OVERWRITING: dict[str, tuple[tuple[str, ...], str]] = {
    "calibrate, its log": (("calibrate", "mine.yaml", "run.csv", "-o", "run.csv"), "log"),
    "calibrate, its robot": (("calibrate", "mine.yaml", "run.csv", "-o", "mine.yaml"), "robot"),
    "by another way": (("calibrate", "mine.yaml", "run.csv", "-o", "./folder/../run.csv"), "log"),
    "by a link": (("calibrate", "mine.yaml", "run.csv", "-o", "link.csv"), "log"),
    "diagnose, its log": (("diagnose", "mine.yaml", "run.csv", "-o", "run.csv"), "log"),
    "diagnose, one of its logs": (
        ("diagnose", "mine.yaml", "other.csv", "run.csv", "--result", "run.csv"),
        "log",
    ),
    "diagnose, its robot": (("diagnose", "mine.yaml", "run.csv", "-o", "mine.yaml"), "robot"),
    "diagnose, one name twice": (
        ("diagnose", "mine.yaml", "run.csv", "-o", "new.yaml", "--result", "./new.yaml"),
        "is the file of -o too",
    ),
    "explore": (("explore", "mine.yaml", "run.csv", "-o", "run.csv"), "log"),
    "plan": (("plan", "mine.yaml", "-o", "mine.yaml"), "robot"),
    "generate": (("generate", "mine.yaml", "-o", "mine.yaml"), "robot"),
    "generate, the truth": (
        ("generate", "mine.yaml", "-o", "new.csv", "--truth", "mine.yaml"),
        "robot",
    ),
    "acquire, the truth": (
        ("acquire", "mine.yaml", "plan.csv", "-o", "new.csv", "--truth", "plan.csv"),
        "plan",
    ),
    "import, its log": (("import", "run.csv", "-o", "run.csv", "--force"), "log"),
    "import, its map": (
        ("import", "raw.csv", "--map", "map.csv", "-o", "map.csv", "--force"),
        "mapping file",
    ),
    "import, its robot": (
        ("import", "run.csv", "--robot", "robot.yaml", "-o", "x.csv", "--inputs", ".", "--force"),
        "robot file",
    ),
    "check, its log": (("check", "mine.yaml", "run.csv", "--propose", "run.csv", "--force"), "log"),
    "report, its log": (("report", "mine.yaml", "p.html", "-o", "p.html", "--force"), "input"),
    "workspace": (("workspace", "mesh.ply", "-o", "mesh.ply", "--force"), "robot file"),
    "stdout": (("calibrate", "mine.yaml", "run.csv", "-o", "-"), "-o -: is no file; give its name"),
    "stdout, a log": (
        ("generate", "mine.yaml", "-o", "-"),
        "-o -: is no file; give its name, or /dev/stdout",
    ),
}


@pytest.mark.parametrize("case", OVERWRITING)
def test_what_is_read_is_never_written_over(
    cli: Cli, log_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str
) -> None:
    arguments, words = OVERWRITING[case]
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("mine.yaml").write_text(cdprcal.builtin_robot_yaml("irma4"))
    Path("run.csv").write_bytes(log_path.read_bytes())
    Path("other.csv").write_bytes(log_path.read_bytes())
    Path("plan.csv").write_text("a plan that took an hour")
    Path("link.csv").symlink_to("run.csv")
    Path("robot.yaml").write_text(cdprcal.builtin_robot_yaml("irma4"))
    before = {path: path.read_bytes() for path in Path().iterdir() if path.is_file()}
    cli(*arguments).refused(words, "give")
    assert {path: path.read_bytes() for path in Path().iterdir() if path.is_file()} == before


#: What is there already, by a name that a command is given → its options.
NOT_REPLACED: dict[str, tuple[str, ...]] = {
    "generate": ("mine.yaml", "-o", "old.csv"),
    "generate, the truth": ("mine.yaml", "-o", "new.csv", "--truth", "old.json"),
    "import": ("run.csv", "-o", "old.csv"),
    "check": ("mine.yaml", "run.csv", "--propose", "old.yaml"),
    "plan": ("mine.yaml", "-o", "old.csv"),
    "plan, its picture": ("mine.yaml", "--plot", "old.png"),
    "track": ("mine.yaml", "run.csv", "-o", "old.csv"),
    "calibrate": ("mine.yaml", "run.csv", "-o", "old.json"),
    "diagnose, the robot": ("mine.yaml", "run.csv", "-o", "old.yaml"),
    "diagnose, the result": ("mine.yaml", "run.csv", "-o", "old.json"),
    "geometry": ("mine.yaml", "run.csv", "-o", "old.yaml"),
    "explore": ("mine.yaml", "run.csv", "-o", "old.yaml"),
    "workspace": ("mine.yaml", "-o", "old.ply"),
    "report": ("mine.yaml", "run.csv", "-o", "old.html"),
    "compare": ("mine.yaml", "run.csv", "run.csv", "--plot", "old.png"),
}


@pytest.mark.parametrize("case", NOT_REPLACED)
def test_a_file_that_nobody_makes_again_is_not_replaced(
    cli: Cli, log_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str
) -> None:
    """Measurements, what was edited by hand, and what is of another kind."""
    arguments = NOT_REPLACED[case]
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(cdprcal.builtin_robot_yaml("irma4"))
    Path("run.csv").write_bytes(log_path.read_bytes())
    for ending in (".csv", ".json", ".yaml", ".png", ".ply", ".html"):
        Path(f"old{ending}").write_bytes(b"# cdprcal acquisition\n" + log_path.read_bytes())
    before = {path: path.read_bytes() for path in Path().iterdir()}
    ran = cli(case.partition(",")[0], *arguments)
    assert ran.code == 2, ran
    assert re.search(r"cdprcal: old\.\w+: exists already.*--force", ran.stderr), ran.stderr
    assert {path: path.read_bytes() for path in Path().iterdir()} == before


#: A file of somebody's that looks like what a command writes → its options and name.
LOOKS_ALIKE: dict[str, tuple[str, ...]] = {
    "robot.yaml": ("diagnose", "irma4", "run.csv", "--fit", "mass", "-o"),
    "edited.yaml": ("diagnose", "irma4", "run.csv", "--fit", "mass", "-o"),
    "plan.csv": ("plan", "irma4", "--grid", "1x1x2", "-o"),
    "log.csv": ("generate", "irma4", "--grid", "1x1x1", "-o"),
    "index.html": ("report", "irma4", "run.csv", "-o"),
    **{
        f"figure{ending}": ("track", "irma4", "run.csv", "--plot")
        for ending in (".png", ".svg", ".pdf")
    },
}


@pytest.mark.parametrize("name", LOOKS_ALIKE)
def test_what_only_looks_like_a_result_stays(
    cli: Cli, log_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """A robot file by hand, one or a plan that was edited, a log, pages, pictures of others."""
    from matplotlib.figure import Figure

    monkeypatch.chdir(tmp_path)
    command, mine = LOOKS_ALIKE[name], Path(name)
    if name in ("edited.yaml", "plan.csv"):
        assert cli(*command, name).code in (0, 1)
        mine.write_text(re.sub("(mass_kg: |measure,-?)", r"\g<1>1", mine.read_text()))
    elif mine.stem == "figure":
        Figure().savefig(mine)
    else:
        mine.write_bytes(
            {
                "robot.yaml": cdprcal.builtin_robot_yaml("irma4").encode(),
                "log.csv": log_path.read_bytes(),
                "index.html": b"<!doctype html>\n<p>mine</p>\n",
            }[name]
        )
    before = mine.read_bytes()
    cli(*command, name).refused(f"{name}: exists already", "--force")
    assert mine.read_bytes() == before


#: What is written → a command that writes it, and its file.
AGAIN: dict[str, tuple[str, ...]] = {
    "robot file": ("diagnose", "irma4", "run.csv", "--fit", "mass", "-o", "corrected.yaml"),
    "truth": ("generate", "irma4", "--grid", "1x1x1", "-o", "new.csv", "--truth", "truth.json"),
    "plan": ("plan", "irma4", "--grid", "1x1x2", "-o", "plan.csv"),
    "track": ("track", "irma4", "run.csv", "-o", "track.csv"),
    "result": ("calibrate", "irma4", "run.csv", "-o", "result.json"),
    "page": ("report", "result.json", "-o", "report.html"),
    "result of diagnose": ("diagnose", "irma4", "run.csv", "--fit", "mass", "-o", "found.json"),
    "picture": ("track", "irma4", "run.csv", "--plot", "track.png"),
    "picture, SVG": ("track", "irma4", "run.csv", "--plot", "track.svg"),
    "picture, PDF": ("track", "irma4", "run.csv", "--plot", "track.pdf"),
    **{
        f"mesh, {name} {ascii}": ("workspace", "irma4", "--step-m", "0.4", *ascii, "-o", name)
        for name in ("mesh.ply", "mesh.stl")
        for ascii in ((), ("--ascii",))
    },
}


def test_a_script_of_results_can_run_again(
    cli: Cli, log_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert log_path == tmp_path / "run.csv"
    for kind, command in AGAIN.items():
        ran = cli(*command)
        assert ran.code in (0, 1), (command, ran.stderr)
        refuse_to_replace(Path(command[-1]), re.split(r",| of ", kind)[0])  # type: ignore[arg-type]
    assert cli(*AGAIN["plan"]).code == 0
    assert cli(*AGAIN["plan"][:-1], "corrected.yaml").code == 2
    with pytest.raises(InputError, match=r"plan.csv: exists already and is no earlier robot file"):
        refuse_to_replace(Path("plan.csv"), "robot file")


def test_force_replaces_what_is_no_input(
    cli: Cli, log_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("new.csv").touch()  # nothing is lost
    assert cli("import", log_path, "-o", "new.csv").code == 0
    refused = cli(
        "import", log_path, "-o", "new.csv"
    )  # which no one could tell from a measured one
    assert "new.csv: exists already; give another name, or --force" in refused.stderr
    assert cli("import", log_path, "-o", "new.csv", "--force").code == 0
    assert cli("check", log_path, "--propose", "map.yaml").code in (0, 1)
    Path("map.yaml").write_text("corrected by hand")
    assert cli("check", log_path, "--propose", "map.yaml").code == 2
    assert Path("map.yaml").read_text() == "corrected by hand"
    assert cli("check", log_path, "--propose", "map.yaml", "--force").code in (0, 1)
    assert Path("map.yaml").read_text() != "corrected by hand"


def test_stdin_is_no_log(cli: Cli) -> None:
    for command in (("check", "irma4", "-"), ("check", "-", "--propose", "new.yaml")):
        cli(*command).refused("-: nothing is read from stdin; save it to a file")


@pytest.mark.parametrize("arguments", [("irma4", "--effect", "nonsense=3")])
def test_a_demo_that_cannot_be_leaves_no_folder(
    cli: Cli, tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    ran = cli("demo", *arguments, "-o", tmp_path / "demo")
    assert ran.code == 2, ran
    assert not (tmp_path / "demo").exists()


def test_diagnose_writes_all_or_nothing(cli: Cli, log_path: Path, tmp_path: Path) -> None:
    corrected = tmp_path / "corrected.yaml"
    cli(
        "diagnose", "irma4", log_path, "-o", corrected, "--result", tmp_path / "none" / "d.json"
    ).refused("d.json")
    assert not corrected.exists()


def test_a_log_that_says_nothing_is_no_consistent_one(
    cli: Cli, log: cdprcal.Log, tmp_path: Path
) -> None:
    """Every cell zero: nothing speaks against the model, and nothing for any pose."""
    groups = ("length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad", "tension_setpoint_N")
    zeros = {name: np.zeros_like(np.array(getattr(log, name))) for name in groups}
    path = tmp_path / "zeros.csv"
    cdprcal.write_log(changed(log, **zeros), str(path))
    ran = cli("diagnose", "irma4", path)
    assert ran.code == 1, ran
    assert "zeros.csv gives no initial pose that can be trusted" in ran.stdout


def test_a_platform_ten_times_as_heavy_is_not_consistent(
    cli: Cli, log_path: Path, tmp_path: Path
) -> None:
    """Far beyond any believable size: either it is found, or no pose comes out of it."""
    robot = tmp_path / "light.yaml"
    robot.write_text(cdprcal.builtin_robot_yaml("irma4").replace("12.992", "1.2992"))
    ran = cli("diagnose", robot, log_path, "--json")
    found = json.loads(ran.stdout)
    if ran.code == 0:
        assert found["verdict"] == "explained", ran
        assert [effect["name"] for effect in found["effects"]] == ["mass"]
        error_kg = found["effects"][0]["parameters"]["mass_error_kg"]
        assert error_kg == pytest.approx(11.6928, abs=0.02)
    else:
        assert ran.code == 1, ran
        assert found["verdict"] == "unexplained"


@pytest.mark.parametrize("command", ["diagnose", "report"])
def test_one_run_is_not_counted_twice(
    cli: Cli, log_path: Path, tmp_path: Path, command: str
) -> None:
    """Not even under another name and in another format."""
    other = tmp_path / "other.mcap"
    assert cli("import", log_path, "-o", other).code == 0
    page = tmp_path / "page.html"
    ran = cli(command, "irma4", log_path, other, *(["-o", page] if command == "report" else []))
    assert ran.code == 2, ran
    assert re.search("other.mcap: holds the same run as .*; give each run once", ran.stderr)
    assert not page.exists()


def test_load_cells_of_two_cables_exchanged_are_not_passed_over(
    cli: Cli, log: cdprcal.Log, tmp_path: Path
) -> None:
    """The balance is off by far more than noise, although not by more than sigma allows."""
    tension = np.array(log.tension_N)[:, [1, 0, 2, 3]]
    path = tmp_path / "exchanged.csv"
    cdprcal.write_log(changed(log, tension_N=tension), str(path))
    ran = cli("diagnose", "irma4", path)
    assert "unexplained" in ran.stdout or re.search(
        r"within the sigma of the robot file, but more than the readings ripple at rest, is left: "
        r".*tension \d+ N \(they ripple by",
        ran.stdout,
    )
    page = tmp_path / "page.html"
    cli("report", "irma4", path, "-o", page)
    assert "Model and sensors agree" not in page.read_text()


def test_a_consistent_log_leaves_nothing_over(cli: Cli, log_path: Path) -> None:
    ran = cli("diagnose", "irma4", log_path)
    assert ran.stdout.startswith("consistent: no effect found\n")
    assert "is left: " not in ran.stdout


def test_diagnose_says_that_there_is_no_rest(cli: Cli, log: cdprcal.Log, tmp_path: Path) -> None:
    """A sample a second cannot show a rest; 'fewer readings than unknowns' would mislead."""
    groups = ("time_s", "length_m", "swivel_rad", "tension_N", "roll_pitch_yaw_rad")
    path = tmp_path / "slow.csv"
    slow: dict[str, Any] = {
        name: np.array(getattr(log, name))[::10] for name in (*groups, "tension_setpoint_N")
    }
    cdprcal.write_log(cdprcal.Log(**slow), str(path))
    cli("diagnose", "irma4", path).refused("slow.csv: no pose at rest was found", "10 Hz")


def test_calibrate_says_what_to_do_when_it_cannot_be_trusted(
    cli: Cli, log: cdprcal.Log, tmp_path: Path
) -> None:
    path = tmp_path / "backwards.csv"
    cdprcal.write_log(changed(log, length_m=-np.array(log.length_m)), str(path))
    ran = cli("calibrate", "irma4", path)
    assert ran.code == 1, ran
    assert f"next: cdprcal check irma4 {path}, then cdprcal diagnose" in ran.stdout


def test_minus_o_writes_what_the_name_says(cli: Cli, log_path: Path, tmp_path: Path) -> None:
    robot, result = tmp_path / "corrected.yaml", tmp_path / "diagnosis.json"
    assert cli("diagnose", "irma4", log_path, "-o", robot, "-o", result).code == 0
    assert cdprcal.load_robot(str(robot)).cable_count == 4
    assert json.loads(result.read_text())["verdict"] == "consistent"
    said = cli("diagnose", "irma4", log_path, "-o", robot).stdout
    assert "corrected.yaml: nothing was found: the robot file as it was given; next:" in said
    ran = cli("diagnose", "irma4", log_path, "-o", result, "--result", tmp_path / "other.json")
    ran.refused("would be the same result; give one")
    ran = cli("diagnose", "irma4", log_path, "-o", robot, "-o", tmp_path / "other.yaml")
    ran.refused("would be the same robot file; give one")
    ran = cli("calibrate", "irma4", log_path, "-o", robot)
    ran.refused("corrected.yaml: calibrate corrects no robot file; give a name in .json")


@pytest.mark.parametrize("name", ["out.txt", "out.md"])
@pytest.mark.parametrize(
    ("command", "option", "kinds"),
    [
        (("diagnose", "irma4", "LOG"), "-o", "robot file a name in .yaml or .yml; a result"),
        (("calibrate", "irma4", "LOG"), "-o", "result a name in .json"),
        (("track", "irma4", "LOG"), "-o", "track a name in .csv"),
        (("compare", "irma4", "LOG", "LOG"), "--plot", "picture a name in .png or .pdf or .svg"),
        (("geometry", "irma4", "LOG"), "-o", "robot file a name in .yaml or .yml"),
        (("explore", "irma4", "LOG"), "-o", "robot file a name in .yaml or .yml"),
        (("report", "irma4", "LOG"), "-o", "page a name in .html or .htm"),
        (("plan", "irma4"), "-o", "plan a name in .csv"),
        (("workspace", "irma4"), "-o", "mesh a name in .ply or .stl"),
        (("generate", "irma4", "-o", "made.csv"), "--truth", "truth a name in .json"),
        (("acquire", "irma4", "p.csv", "-o", "run.csv"), "--truth", "truth a name in .json"),
        (("template",), "-o", "robot file a name in .yaml or .yml"),
        (("check", "LOG"), "--propose", "mapping file a name in .yaml or .yml"),
    ],
)
def test_a_name_that_does_not_say_what_is_in_it_is_refused(
    cli: Cli,
    log_path: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: tuple[str, ...],
    option: str,
    kinds: str,
    name: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    words = [log_path if word == "LOG" else word for word in command]
    for given in (name, "out") if kinds.startswith(("page", "picture", "mesh")) else (name,):
        ran = cli(*words, option, given)
        ran.refused(f"{given}: its ending does not say what it is; give a {kinds}")
    assert not Path(name).exists()


def test_a_result_has_any_name_where_it_is_asked_for(
    cli: Cli, log_path: Path, tmp_path: Path
) -> None:
    result = tmp_path / "result"
    assert cli("diagnose", "irma4", log_path, "--result", result).code == 0
    assert json.loads(result.read_text())["verdict"] == "consistent"
