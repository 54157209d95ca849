"""``course doctor``: what hurts is named in plain words, with the mend; what is well is not."""

from __future__ import annotations

import fcntl
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from course import doctor
from course.doctor import environment, machine, ros, software
from course.doctor.finding import HealthFinding, make_ok, make_problem, make_warning

COMMAND = [
    sys.executable,
    "-c",
    "from course.command_line.launch import course; course()",
    "doctor",
]
PREFIX = "/opt/python"


def look(**variables: str) -> list[HealthFinding]:
    return list(environment.examine_environment(variables, PREFIX))


def test_the_environment_of_a_plain_shell_is_well() -> None:
    harmless = {"ROS_DOMAIN_ID": "7", "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp", "PATH": "/bin"}
    [found] = look(**harmless, ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET", ROS_LOCALHOST_ONLY="0")
    assert found.status == "ok"


@pytest.mark.parametrize(
    ("variables", "status", "says"),
    [
        ({"ROS_DOMAIN_ID": "300"}, "warning", "too large"),
        ({"ROS_DOMAIN_ID": "233"}, "warning", "too large"),
        ({"ROS_DOMAIN_ID": "102"}, "warning", "collide"),
        ({"ROS_DOMAIN_ID": "-1"}, "warning", "whole number"),
        ({"ROS_DOMAIN_ID": "seven"}, "warning", "'seven'"),
        ({"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, "problem", "rmw_cyclonedds_cpp"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, "warning", "OFF"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "localhost"}, "warning", "none of"),
        ({"ROS_LOCALHOST_ONLY": "1"}, "warning", "deprecated"),
        ({"ROS_SECURITY_ENABLE": "true"}, "problem", "security"),
        ({"FASTRTPS_DEFAULT_PROFILES_FILE": "/no/such.xml"}, "problem", "/no/such.xml"),
        ({"FASTDDS_DEFAULT_PROFILES_FILE": "/etc/passwd"}, "warning", "/etc/passwd"),
        ({"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}, "warning", "UDPv4"),
        ({"PYTHONPATH": "/x:/opt/ros/humble/lib/python3"}, "warning", "humble"),
        ({"_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}, "problem", "inherited"),
    ],
)
def test_each_variable_that_hurts_is_named_with_its_mend(
    variables: dict[str, str], status: str, says: str
) -> None:
    [found] = look(**variables)
    assert found.status == status
    assert says in found.message
    assert found.mend


def test_the_wheels_own_mark_is_no_problem() -> None:
    path = f"/lib:{PREFIX}/lib"
    [found] = look(_ROS_WHEELS_BOOTSTRAP_COMPLETE="1", LD_LIBRARY_PATH=path)
    assert found.status == "ok"


def test_space_is_judged_by_what_is_left(tmp_path: Path) -> None:
    assert [machine.check_disk(tmp_path, free).status for free in (10, 100, 5000)] == [
        "problem",
        "warning",
        "ok",
    ]
    assert [machine.shared_memory(tmp_path, free).status for free in (3, 64)] == ["warning", "ok"]
    assert machine.shared_memory(tmp_path / "none").status == "warning"
    assert machine.check_disk(tmp_path).message.endswith(f"MB are free in {tmp_path}")
    assert machine.temporary_folder().status == "ok"


def test_only_segments_whose_owner_is_gone_are_left_over(tmp_path: Path) -> None:
    for name in ("fastrtps_0123", "fastrtps_4567", "fastrtps_port7411"):
        (tmp_path / name).write_bytes(b"x" * 2**20)
        (tmp_path / f"{name}_el").touch()
    with (tmp_path / "fastrtps_0123_el").open() as living:
        fcntl.flock(living, fcntl.LOCK_EX)
        found = machine.stale_segments(tmp_path, Path("/proc/locks"))
        assert found.status == "warning"
        assert found.message.startswith("1 shared-memory locks or segments (1 MB)")
        (tmp_path / "fastrtps_4567_el").unlink()
        assert machine.stale_segments(tmp_path, Path("/proc/locks")).status == "ok"
    assert machine.stale_segments(tmp_path, tmp_path / "no-such-table").status == "ok"


def test_the_log_folder_is_tried(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert machine.log_folder(str(tmp_path / "log"), None).status == "ok"
    assert machine.log_folder(None, str(tmp_path)).message == f"{tmp_path / 'log'} can be written"
    found = machine.log_folder(str(tmp_path / "file" / "log"), None)
    assert found.status == "warning"
    assert "ROS_LOG_DIR" in found.mend


def test_a_clock_that_was_set_back_is_noticed() -> None:
    assert machine.check_clock(1_700_000_000, 1_600_000_000).status == "ok"
    found = machine.check_clock(0.0, 1_600_000_000)
    assert found.status == "warning"
    assert "before the course was installed" in found.message


def test_packages_are_compared_with_their_bounds() -> None:
    found = software.check_packages()
    assert found.status == "ok"
    assert "nbgrader 0.9." in found.message
    assert software.check_packages("no-such-distribution").status == "problem"


def test_a_package_out_of_bounds_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    info = tmp_path / "sample_course-1.dist-info"
    info.mkdir()
    needs = ["nbgrader<0.1", "no-such-package>=1", "pytest", "nothing; python_version < '3'"]
    lines = ["Metadata-Version: 2.1", "Name: sample-course", "Version: 1"]
    (info / "METADATA").write_text("\n".join([*lines, *(f"Requires-Dist: {n}" for n in needs)]))
    monkeypatch.syspath_prepend(tmp_path)
    found = software.check_packages("sample-course")
    assert found.status == "problem"
    assert "is not <0.1" in found.message
    assert "no-such-package is missing" in found.message
    assert "pytest" not in found.message


def test_python_and_kernel_are_looked_at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert software.check_python().status == "ok"
    assert software.check_python("Not here.") == make_problem("Python", "Not here.")
    assert software.check_kernel().status == "ok"
    folder = tmp_path / "kernels" / "python3"
    folder.mkdir(parents=True)
    spec = {"argv": ["/bin/true", "{connection_file}"], "display_name": "x", "language": "python"}
    (folder / "kernel.json").write_text(json.dumps(spec))
    monkeypatch.setenv("JUPYTER_PATH", str(tmp_path))
    found = software.check_kernel()
    assert found.status == "problem"
    assert str(folder) in found.mend


def test_a_missing_compiler_is_a_warning_with_its_mend(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    for name in ("CC", "CXX"):
        monkeypatch.delenv(name, raising=False)
    found = software.check_compiler()
    assert found.status == "warning"
    assert "g++" in found.mend


def test_domains_run_out() -> None:
    found = [ros.check_domains(free).status for free in (400, 5, 0)]
    assert found == ["ok", "warning", "problem"]


def test_a_message_travels_within_a_process_and_between_two() -> None:
    for found in (ros.in_one_process(), ros.between_processes()):
        assert found.status == "ok", found.message
        assert "a message went there and back" in found.message


def test_a_probe_that_fails_is_a_sentence() -> None:
    assert "error" in ros.run_probe("both", 300)
    assert "out of range" in str(ros.run_probe("both", 300)["error"])
    assert "error" in ros.run_probe("both", "not a number")


def test_the_summary_and_the_exit_code_follow_the_worst_finding() -> None:
    well, warned, ill = (
        make_ok("a", "x"),
        make_warning("b", "y", "do z"),
        make_problem("c", "y", "do z"),
    )
    assert [doctor.exit_code(f) for f in ([well], [well, warned], [warned, ill])] == [0, 0, 1]
    assert "All is well" in doctor.summary_line([well])
    assert "1 to know" in doctor.summary_line([well, warned])
    assert doctor.summary_line([warned, ill]).startswith("1 to mend")
    assert ill.as_text().splitlines() == ["problem  c: y", "         -> do z"]


def run(*arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMMAND, *arguments],
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        timeout=150,
        check=False,
    )


def test_the_command_reports_in_json() -> None:
    done = run("--json")
    assert done.stderr == ""
    findings = json.loads(done.stdout)
    names = [finding["name"] for finding in findings]
    assert {"Python", "packages", "round trip between processes", "clock"} <= set(names)
    assert all(set(finding) == {"name", "status", "message", "mend"} for finding in findings)
    ill = [finding for finding in findings if finding["status"] == "problem"]
    assert ill == []
    assert done.returncode == 0


def test_the_command_survives_an_environment_that_breaks_ros() -> None:
    done = run(ROS_DOMAIN_ID="300", RMW_IMPLEMENTATION="rmw_cyclonedds_cpp")
    assert done.returncode == 1
    assert done.stderr == ""
    assert "warning  ROS_DOMAIN_ID: 300 is too large" in done.stdout
    assert "problem  RMW_IMPLEMENTATION: It asks for rmw_cyclonedds_cpp" in done.stdout
    assert "Traceback" not in done.stdout


def test_the_command_sees_a_bootstrap_mark_from_elsewhere() -> None:
    done = run(_ROS_WHEELS_BOOTSTRAP_COMPLETE="1", LD_LIBRARY_PATH="")
    assert done.returncode == 1
    assert "problem  _ROS_WHEELS_BOOTSTRAP_COMPLETE: It was inherited" in done.stdout
    assert "problem  ROS 2: rclpy cannot be imported" in done.stdout
    assert "Traceback" not in done.stdout
