"""The command line: what it prints, what it refuses and in which words, and one smoke solve."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result
from rich.console import Console

from helpers import walker_of
from opensim_peer import opensim_says, with_opensim
from pathwalker_cli import __version__
from pathwalker_cli.cli import COMMANDS, cli
from pathwalker_cli.commands import doctor
from pathwalker_cli.commands.progress import Progress
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.io.yaml_file import read_mapping
from pathwalker_cli.model.urdf import urdf_text
from pathwalker_cli.nlp.watch import ProgressReport
from pathwalker_cli.ocp.violations import Violation
from pathwalker_cli.patient import load_patient
from pathwalker_cli.results.run_folder import ENTRIES, load_run, write_run
from pathwalker_cli.stride.measures import metrics_of
from pathwalker_cli.stride.series import gait_series
from pathwalker_cli.stride.stride import stride_of
from pathwalker_cli.studies import run as study_run
from test_verdict import verdict

MadeSolution = Callable[..., GaitSolution]
Smoke = tuple[Path, subprocess.CompletedProcess[str]]
PATIENT = "sreenivasa2017-patient"
COMMAND = [sys.executable, "-c", "from pathwalker_cli.cli import main; main()"]
HEAVY = ("numpy", "casadi", "pinocchio", "matplotlib", "scipy", "pydantic", "rich", "yaml")


def run(*words: object) -> Result:
    """Run the command line in this process."""
    return CliRunner().invoke(cli, [str(word) for word in words])


def run_process(folder: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """Run the command line as a user would, in a folder."""
    command = [*COMMAND, *map(str, words)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


# Help, version, usage


@pytest.mark.parametrize("words", [["--help"], ["-h"], ["--version"], ["solve", "-h"]])
def test_help_and_version_import_nothing_heavy(tmp_path: Path, words: list[str]) -> None:
    script = (
        "import sys\n"
        "from pathwalker_cli.cli import cli\n"
        f"cli.main({words!r}, standalone_mode=False)\n"
        f"print('LOADED', [name for name in {HEAVY!r} if name in sys.modules])\n"
    )
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.endswith("LOADED []\n")


def test_help_lists_every_command_as_its_own_help_begins() -> None:
    text = " ".join(run("--help").output.split())
    for name, (_, line) in COMMANDS.items():
        assert f"{name} {line}" in text
        result = run(name, "--help")
        assert result.exit_code == 0, result.output
        assert result.output.startswith(f"Usage: cli {name} ")


def test_version() -> None:
    assert run("--version").output == f"pathwalker, version {__version__}\n"


def test_wrong_usage_exits_with_2() -> None:
    assert run("solve").exit_code == 2
    assert run("solve", "mapd-orthosis", "mapd-orthosis", "--nonsense").exit_code == 2
    result = run("slove")
    assert result.exit_code == 2
    assert "there is no command 'slove'; allowed: solve, " in result.output


# Bad input


def config_of(folder: Path, **blocks: Any) -> Path:
    """Write a config of the shipped patient with these blocks."""
    path = folder / "study.yaml"
    content = {"problem": "mapd-orthosis", "patient": PATIENT, **blocks}
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def patient_of(folder: Path, key: str, value: Any) -> Path:
    """Write a config of a patient like the shipped one but for one dotted key."""
    source = load_patient(PATIENT).source
    assert source is not None
    mapping = read_mapping(source)[0]
    inner: Any = mapping
    *parents, last = key.split(".")
    for parent in parents:
        inner = inner[parent]
    inner[last] = value
    path = folder / "someone.yaml"
    path.write_text(yaml.safe_dump(mapping), encoding="utf-8")
    return config_of(folder, patient="someone.yaml")


def written(folder: Path, text: str) -> Path:
    """Write a config as it stands."""
    path = folder / "study.yaml"
    path.write_text(text, encoding="utf-8")
    return path


BAD_CONFIGS: dict[str, tuple[Callable[[Path], Path], tuple[str, ...]]] = {
    "missing file": (lambda f: f / "nowhere.yaml", ("nowhere.yaml: no such file; check",)),
    "misspelt file": (
        lambda f: f / "mapd-ortosis.yaml",
        ("mapd-ortosis.yaml: no such file; did you mean 'mapd-orthosis'?",),
    ),
    "misspelt file of one's own": (
        lambda f: config_of(f).with_name("stuidy.yaml"),
        ("stuidy.yaml: no such file; did you mean 'study'?",),
    ),
    "not YAML": (lambda f: written(f, "a: [1"), ("study.yaml, line", "not valid YAML")),
    "no mapping": (lambda f: written(f, "- 1"), ("holds a list", "keys with values")),
    "unknown key": (
        lambda f: config_of(f, bounds={"joint_range_margins": 0.2}),
        ("study.yaml", "joint_range_margins", "joint_range_margin"),
    ),
    "wrong unit": (
        lambda f: config_of(f, bounds={"joint_range_margin": 12.0}),
        ("bounds.joint_range_margin", "is 12 rad", "0 to 1.5 rad", "is it in degrees?"),
    ),
    "unit in the number": (
        lambda f: config_of(f, bounds={"joint_range_margin": "12 grad"}),
        ("bounds.joint_range_margin", "not a number in rad", "or a number with deg"),
    ),
    "wrong sign": (
        lambda f: patient_of(f, "orthosis.dorsiflexion_stop", 0.13),
        ("someone.yaml", "dorsiflexion_stop", "give it a minus sign"),
    ),
    "negative mass": (
        lambda f: patient_of(f, "body_mass", -26.0),
        ("someone.yaml", "body_mass", "is -26 kg", "5 to 150 kg"),
    ),
    "mass in grams": (
        lambda f: patient_of(f, "body_mass", 26000.0),
        ("body_mass", "is it in grams?"),
    ),
    "range upside down": (
        lambda f: config_of(f, bounds={"dorsiflexion_stiffness": [92.0, 5.0]}),
        ("bounds.dorsiflexion_stiffness", "is [92, 5], upside down", "[lower, upper]"),
    ),
    "range of springs upside down": (
        lambda f: patient_of(f, "orthosis.stiffness_range.dorsiflexion", [92.0, 5.0]),
        ("someone.yaml", "stiffness_range.dorsiflexion [92, 5]", "upside down"),
    ),
    "another problem": (
        lambda f: config_of(f, problem="mapd-barefoot"),
        (
            "study.yaml, problem",
            "is a config for mapd-barefoot, but mapd-orthosis",
            "use the shipped config mapd-orthosis",
        ),
    ),
    "unknown problem in the file": (
        lambda f: config_of(f, problem="mapd"),
        ("problem", "is 'mapd'", "mapd-barefoot, mapd-orthosis"),
    ),
    "misspelt problem in the file": (
        lambda f: config_of(f, problem="mapd-ortosis"),
        ("problem", "did you mean 'mapd-orthosis'?"),
    ),
    "misspelt patient": (
        lambda f: config_of(f, patient="sreenivasa2017-pateint"),
        ("study.yaml, patient", "did you mean 'sreenivasa2017-patient'?"),
    ),
    "speed in words": (
        lambda f: config_of(f, bounds={"least_walking_speed": "fast"}),
        ("is 'fast'; allowed: 'recorded' or a number, 0 to 3 m/s",),
    ),
    "speed in cm/s": (
        lambda f: config_of(f, bounds={"least_walking_speed": 80.0}),
        ("is 80 m/s; allowed: 'recorded' or a number, 0 to 3 m/s; is it in km/h or cm/s?",),
    ),
    "one number for a range": (
        lambda f: config_of(f, bounds={"dorsiflexion_stiffness": 40}),
        (": bounds.dorsiflexion_stiffness: is 40", "[40, 40] prescribes 40"),
    ),
    "one number for the range of a spring": (
        lambda f: config_of(f, bounds={"stiffness": {"plantarflexion_stiffness_left": 40}}),
        (": bounds.stiffness.plantarflexion_stiffness_left: is 40", "[40, 40] prescribes 40"),
    ),
    "one spring upside down": (
        lambda f: config_of(f, bounds={"stiffness": {"dorsiflexion_stiffness_left": [9, 5]}}),
        (": bounds.stiffness.dorsiflexion_stiffness_left: is [9, 5], upside down",),
    ),
    "one joint upside down": (
        lambda f: config_of(f, bounds={"joint_ranges": {"knee_r": [1.0, 0.5]}}),
        (": bounds.joint_ranges.knee_r: is [1, 0.5], upside down",),
    ),
    "unknown patient": (
        lambda f: config_of(f, patient="nobody"),
        ("study.yaml, patient", "no patient 'nobody'", PATIENT, "a YAML file"),
    ),
    "no orthosis": (
        lambda f: config_of(f, patient="sreenivasa2017-healthy"),
        ("orthosis is not given", "barefoot condition"),
    ),
}


@pytest.mark.parametrize("name", BAD_CONFIGS)
def test_bad_configs_get_one_sentence(here: Path, name: str) -> None:
    make, parts = BAD_CONFIGS[name]
    refused(here, run("solve", "mapd-orthosis", make(here)), parts)


def refused(folder: Path, result: Result, parts: tuple[str, ...]) -> None:
    """Check exit code and message, and that nothing was written."""
    assert isinstance(result.exception, SystemExit), repr(result.exception)
    assert result.exit_code == 2
    (line,) = result.output.splitlines()
    assert line.startswith("Error: ")
    for part in parts:
        assert part in line
    assert {p.name for p in folder.iterdir()} <= {"study.yaml", "someone.yaml", "run", "mine.txt"}


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (
            ["mapd-shoes", "mapd-orthosis"],
            ("no problem 'mapd-shoes'", "mapd-barefoot, mapd-orthosis"),
        ),
        (["mapd-barefoot", "mapd-orthosis"], ("is a config for mapd-orthosis",)),
        (["mapd-orthosis", "mapd-orthosis", "--set", "nonsense"], ("--set", "dotted.key=value")),
        (["mapd-ortosis", "mapd-orthosis"], ("did you mean 'mapd-orthosis'?",)),
        (
            ["mapd-orthosis", "mapd-orthosis", "--set", "mesh.degre=3"],
            ("Error: --set mesh.degre=3: unknown key", "did you mean 'degree'?"),
        ),
        (
            ["mapd-orthosis", "mapd-orthosis", "--set", "mesh.degree=two"],
            ("Error: --set mesh.degree=two: is 'two'",),
        ),
        (
            ["mapd-orthosis", "mapd-orthosis", "--set", "bounds.friction=-1"],
            ("Error: --set bounds.friction=-1: is -1; allowed: 0.05 to 2",),
        ),
        (
            ["mapd-orthosis", "mapd-orthosis", "--set", "bounds.stiffness={K_D: [1, 2]}"],
            ("Error: --set bounds.stiffness={K_D: [1, 2]}: names 'K_D'",),
        ),
        (
            ["mapd-orthosis", "mapd-orthosis", "--set", "bounds={friction: 9}"],
            ("Error: --set bounds={friction: 9}: bounds.friction: is 9",),
        ),
        (
            ["mapd-orthosis", "mapd-orthosis", "--set", "bounds.friction=[1"],
            ("Error: --set bounds.friction=[1: '[1' is not a YAML value",),
        ),
        (["mapd-orthosis", "mapd-orthosis", "--set", "problem.x=1"], ("holds no keys",)),
        (["mapd-orthosis", "mapd-orthosis", "--warm-start", "old"], ("old: no such folder",)),
        (["mapd-orthosis", "mapd-orthosis", "--warm-start", "."], ("is no run folder",)),
        (["mapd-orthosis", "mapd-orthosis", "--out", "."], ("current folder", "--out")),
        (["mapd-orthosis", "mapd-orthosis", "--out", "mine.txt"], ("is a file",)),
    ],
)
def test_bad_words_get_one_sentence(here: Path, words: list[str], parts: tuple[str, ...]) -> None:
    (here / "mine.txt").touch()
    refused(here, run("solve", *words), parts)


@pytest.fixture
def made_run(here: Path, made_solution: MadeSolution, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of a run that is not the fruit of a solve; figures are left out."""
    monkeypatch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
    write_run(here / "run", made_solution())
    return here / "run"


def test_bad_warm_starts_get_one_sentence(made_run: Path, made_solution: MadeSolution) -> None:
    words = ("--warm-start", made_run)
    barefoot = run("solve", "mapd-barefoot", "mapd-barefoot", *words)
    refused(made_run.parent, barefoot, ("(orthosis)", "free parameters", "mapd-barefoot"))
    (made_run / "motion.npz").write_bytes(b"PK")
    spoilt = run("solve", "mapd-orthosis", "mapd-orthosis", *words)
    refused(made_run.parent, spoilt, ("motion.npz: is damaged",))
    write_run(made_run, made_solution(status="stopped by the user"))
    failed = run("solve", "mapd-orthosis", "mapd-orthosis", *words)
    refused(made_run.parent, failed, ("stopped by the user", "a converged run", "solve it again"))


def test_a_folder_that_is_no_run_is_not_replaced(made_run: Path) -> None:
    (made_run / "thesis.txt").touch()
    result = run("solve", "mapd-orthosis", "mapd-orthosis", "--out", made_run)
    refused(made_run.parent, result, ("holds thesis.txt", "choose another --out"))
    assert (made_run / "thesis.txt").exists()


@pytest.mark.parametrize("name", ["missing file", "negative mass", "wrong unit"])
def test_the_real_process_shows_no_traceback(tmp_path: Path, name: str) -> None:
    make, parts = BAD_CONFIGS[name]
    done = run_process(tmp_path, "solve", "mapd-orthosis", make(tmp_path))
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("Error: ")
    assert done.stderr.count("\n") == 1
    assert all(part in done.stderr for part in parts)
    assert not (tmp_path / "runs").exists()


def test_errors_that_nobody_foresaw_are_not_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> None:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(doctor, "findings", broken)
    assert isinstance(run("doctor").exception, ZeroDivisionError)


def test_ctrl_c_outside_of_a_solve_exits_with_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(doctor, "findings", interrupted)
    result = run("doctor")
    assert result.exit_code == 130
    assert "stopped by the user" in result.output


# Ends of a solve, without a solve


class _Solver:
    """Takes the place of the solver: reports some iterations and returns what it was given."""

    end: GaitSolution
    started_from: Any = None

    def __init__(self, config: Any, observer: Any) -> None:
        self.observer = observer

    def solve(self, warm_start: Any = None) -> GaitSolution:
        type(self).started_from = warm_start
        for i in range(45):
            self.observer("fine", ProgressReport(i, 1.0 / (i + 1), 10.0**-i, 0.1 * i))
        return self.end


@pytest.fixture
def ends(monkeypatch: pytest.MonkeyPatch, here: Path) -> Callable[[GaitSolution], None]:
    """Return a function that decides how the next solves end."""
    monkeypatch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
    monkeypatch.setattr(study_run, "GaitSolver", _Solver)
    monkeypatch.setattr(study_run, "verdict_of", lambda solution: None)

    def decide(solution: GaitSolution) -> None:
        monkeypatch.setattr(_Solver, "end", solution, raising=False)

    return decide


def test_a_converged_solve_exits_with_0(
    here: Path, ends: Callable[[GaitSolution], None], made_solution: MadeSolution
) -> None:
    ends(made_solution())
    result = run("solve", "mapd-orthosis", "mapd-orthosis")
    assert result.exit_code == 0, result.output
    folder = here / "runs" / f"mapd-orthosis-{PATIENT}"
    assert load_run(folder).metrics["status"] == "converged"
    text = result.output
    assert "knee_l at its lower bound 0.264 rad (15.1 deg) in left_toe" in text
    assert "walking speed at its lower bound 0.636 m/s" in text
    assert "activation at its" not in text, "bounds that are no choice are not shown"
    assert "K_D right" in text
    assert "5.0e-04 rad or m" in text
    assert "joint ranges: barefoot recordings widened by 0.2 rad" in text
    assert "6 years instead of 7" in text
    assert "seconds               build 1.0, solve 1.5, verify" in text
    log = (folder / "log.txt").read_text(encoding="utf-8")
    assert log.count("fine       iteration") == 45
    assert "stage fine: converged; 32 intervals" in log
    assert "status: converged" in log


def test_quiet_prints_nothing(
    here: Path, ends: Callable[[GaitSolution], None], made_solution: MadeSolution
) -> None:
    ends(made_solution())
    result = run("solve", "mapd-orthosis", "mapd-orthosis", "--quiet", "--out", "mine")
    assert (result.exit_code, result.output) == (0, "")
    assert (here / "mine" / "metrics.json").is_file()


def test_the_verdict_is_told_and_kept(
    here: Path,
    ends: Callable[[GaitSolution], None],
    made_solution: MadeSolution,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ends(made_solution())
    monkeypatch.setattr(study_run, "verdict_of", lambda solution: verdict())
    result = run("solve", "mapd-orthosis", "mapd-orthosis", "--out", "judged")
    assert "How sure are the springs?" in result.output
    assert "sits at the upper limit" in result.output
    kept = load_run(here / "judged").metrics["verdict"]
    assert kept["springs"][0]["determined"] == "determined"
    assert "K_P right: 20.0 N m/rad" in (here / "judged" / "log.txt").read_text(encoding="utf-8")


def test_a_failed_solve_exits_with_1_and_names_the_worst(
    here: Path, ends: Callable[[GaitSolution], None], made_solution: MadeSolution
) -> None:
    worst = (Violation("hip_r equation of motion in left_flat at 40 % of the phase", 3.0),)
    ends(made_solution(status="stopped by the user", violations=worst))
    result = run("solve", "mapd-orthosis", "mapd-orthosis", "--quiet", "--out", "mine")
    assert result.exit_code == 1
    (line,) = result.output.splitlines()
    assert "did not converge: stopped by the user" in line
    assert "hip_r equation of motion in left_flat at 40 % of the phase by 3" in line
    assert "the last iterate is in mine, marked as not converged" in line
    assert (here / "mine" / "NOT_CONVERGED.txt").is_file()


def test_a_stiffness_at_its_limit_is_said_in_words(
    here: Path, ends: Callable[[GaitSolution], None], made_solution: MadeSolution
) -> None:
    bounds = made_solution().bounds
    table = bounds.table.replace({("dorsiflexion_stiffness_right",): (5.0, 50.0)})
    ends(made_solution(bounds=replace(bounds, table=table)))
    result = run("solve", "mapd-orthosis", "mapd-orthosis")
    assert "note: K_D right sits at its upper limit of 50 N m/rad" in result.output


def test_a_warm_start_hands_over_the_exact_motion(
    made_run: Path, ends: Callable[[GaitSolution], None], made_solution: MadeSolution
) -> None:
    ends(made_solution(start="earlier run"))
    words = ("solve", "mapd-orthosis", "mapd-orthosis", "--warm-start", made_run, "--out", "new")
    assert run(*words).exit_code == 0
    given = _Solver.started_from
    assert np.array_equal(given.phases[3].states, made_solution().last_motion.phases[3].states)
    metrics = load_run("new").metrics
    assert (metrics["start"], metrics["warm_start"]) == ("earlier run", str(made_run))
    assert metrics["input_hashes"].keys() == {"config", "patient", "patient_kept", "warm_start"}


def reports(progress: Progress) -> None:
    """Show two stages of 30 iterations."""
    with progress:
        for stage in ("coarse", "fine"):
            for i in range(31):
                progress(stage, ProgressReport(i, 1.0, 1e-3, 0.0))


def test_plain_progress_shows_every_twentieth_and_the_last_iteration() -> None:
    out = StringIO()
    progress = Progress(console=Console(file=out, width=40))
    reports(progress)
    shown = [line.split()[:3] for line in out.getvalue().splitlines()]
    assert shown == [[s, "iteration", n] for s in ("coarse", "fine") for n in ("0", "20", "30")]
    assert len(progress.lines) == 62


def test_a_heading_stands_once_before_the_first_iteration() -> None:
    out = StringIO()
    with Progress(console=Console(file=out, width=40), heading=("what is worn",)) as progress:
        assert out.getvalue() == "", "nothing is refused any more once it begins"
        reports(progress)
    assert out.getvalue().splitlines()[0] == "what is worn"
    assert out.getvalue().count("what is worn") == 1


def test_live_progress_leaves_one_line_per_stage() -> None:
    out = StringIO()
    reports(Progress(console=Console(file=out, width=100, force_terminal=True)))
    assert "building the problem" in out.getvalue()
    assert out.getvalue().count("iteration   30") >= 2


# doctor and model


def test_doctor_finds_everything() -> None:
    result = run("doctor")
    assert result.exit_code == 0, result.output
    for part in ("casadi", "dynamics compiled", "IPOPT with MUMPS", "mapd-orthosis", "is ready"):
        assert part in result.output


def test_doctor_knows_the_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATHWALKER_CACHE", str(tmp_path))
    (tmp_path / "1.tapes").write_bytes(bytes(2_000_000))
    assert f"{tmp_path}: 1 files, 2 MB" in run("doctor").output
    monkeypatch.setenv("PATHWALKER_CACHE", "off")
    assert "PATHWALKER_CACHE says so" in run("doctor").output


def test_doctor_speaks_json() -> None:
    content = json.loads(run("doctor", "--json").output)
    assert content["usable"] is True
    found = {finding["name"]: finding for finding in content["findings"]}
    assert found["dynamics"]["detail"].endswith("is at work")
    assert found["pathwalker"]["detail"] == __version__


def test_doctor_reports_what_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> None:
        raise ImportError("libcasadi.so is gone")

    monkeypatch.setattr(doctor, "_solver", broken)
    result = run("doctor")
    assert result.exit_code == 1
    assert "MISSING" in result.output
    assert "libcasadi.so is gone" in result.output


def test_model_writes_the_urdf(here: Path) -> None:
    text = urdf_text(load_patient(PATIENT), "orthosis")
    done = run_process(here, "model", PATIENT, "--condition", "orthosis")
    assert (done.returncode, done.stdout) == (0, text)
    assert "6 years instead of 7" in done.stderr
    assert "thigh_r 2.178" in done.stderr
    result = run("model", PATIENT, "--condition", "orthosis", "-o", "walker.urdf")
    assert result.exit_code == 0, result.output
    assert (here / "walker.urdf").read_text(encoding="utf-8") == text


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["nobody", "--condition", "barefoot"], "no patient 'nobody'"),
        (["sreenivasa2017-healthy", "--condition", "orthosis"], "orthosis"),
        ([PATIENT, "--condition", "barefoot", "-o", "."], "is a folder"),
        ([PATIENT, "--condition", "barefoot", "-o", "no/where.urdf"], "cannot be written"),
        ([PATIENT, "--condition", "sandals"], "'barefoot', 'orthosis'"),
    ],
)
def test_model_refuses(here: Path, words: list[str], part: str) -> None:
    result = run("model", *words)
    assert result.exit_code == 2
    assert part in result.output
    assert not list(here.iterdir())


# One smoke solve, shared


@pytest.fixture(scope="module")
def smoke(tmp_path_factory: pytest.TempPathFactory) -> Smoke:
    """Return folder and process of a smoke solve."""
    folder = tmp_path_factory.mktemp("smoke")
    words = ("solve", "mapd-orthosis", "mapd-orthosis", "--smoke", "--out", "run")
    return folder / "run", run_process(folder, *words)


@pytest.mark.xdist_group("smoke")
def test_the_smoke_solve_converges(smoke: Smoke) -> None:
    folder, done = smoke
    assert done.returncode == 0, done.stderr
    assert {path.name for path in folder.iterdir()} == ENTRIES - {"NOT_CONVERGED.txt", "recordings"}
    assert "status                        converged" in done.stdout
    assert "first mesh iteration    0" in done.stderr
    assert "\x1b" not in done.stdout + done.stderr, "no colours off a terminal"


@pytest.mark.xdist_group("smoke")
def test_the_smoke_solution_proves_itself(smoke: Smoke) -> None:
    metrics = load_run(smoke[0]).metrics
    assert metrics["smoke"] is True
    assert metrics["largest_violation"] <= 1e-6
    assert metrics["min_vertical_force"] >= -1e-6
    assert metrics["second_engine_residual"] <= 1e-6
    assert metrics["walking_speed"] >= 0.636 - 1e-6
    for stiffness in ("dorsiflexion_stiffness", "plantarflexion_stiffness"):
        for side in ("left", "right"):
            assert 5.0 - 1e-6 <= metrics[f"{stiffness}_{side}"] <= 92.0 + 1e-6


@pytest.mark.xdist_group("smoke")
def test_the_smoke_motion_gives_the_same_metrics_again(smoke: Smoke) -> None:
    loaded = load_run(smoke[0])
    again = metrics_of(stride_of(gait_series(walker_of("orthosis"), loaded.motion)))
    assert json.loads(json.dumps(again)) == {key: loaded.metrics[key] for key in again}


@with_opensim
@pytest.mark.xdist_group("smoke")
def test_opensim_finds_the_torques_of_the_smoke_solve(smoke: Smoke, tmp_path: Path) -> None:
    assert run("export", smoke[0], "-o", tmp_path, "--opensim").exit_code == 0
    said = opensim_says(tmp_path)
    assert max(said["torques"].values()) < 1e-3, "[N m], at the pelvis [N] too"
    assert said["accelerations"] < 1e-5 * said["largest acceleration"]
    by_tool = said["tool, median"]  # it differentiates the angles of a coarse mesh
    assert max(value for name, value in by_tool.items() if not name.startswith("pelvis")) < 1.0


@pytest.mark.slow
def test_ctrl_c_keeps_the_last_iterate(tmp_path: Path) -> None:
    words = ["solve", "mapd-orthosis", "mapd-orthosis", "--smoke", "--out", "run"]
    with subprocess.Popen(
        [*COMMAND, *words], cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith("first mesh"):
                process.send_signal(signal.SIGINT)
                break
        error = process.stderr.read()
        assert process.wait() == 1
    assert "did not converge: stopped by the user" in error
    assert (
        load_run(tmp_path / "run", allow_unconverged=True).metrics["stages"][-1]["iterations"] < 9
    )


@pytest.mark.slow
def test_a_warm_start_converges(smoke: Smoke, tmp_path: Path) -> None:
    words = ("solve", "mapd-orthosis", "mapd-orthosis", "--smoke", "--warm-start", smoke[0])
    done = run_process(tmp_path, *words, "--out", "again")
    assert done.returncode == 0, done.stderr
    first, second = load_run(smoke[0]).metrics, load_run(tmp_path / "again").metrics
    assert second["cost"] == pytest.approx(first["cost"], rel=1e-6), "the very same optimum"
    assert second["iterations"] <= 3
    assert second["start"] == "earlier run of the same problem"
