"""The environment variables of a submission and of its examiner."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from autograder.sandbox.confinement import visible_files
from course.interfaces.building import cache

PROFILE = {"FASTRTPS_DEFAULT_PROFILES_FILE": str(Path(__file__).with_name("fastdds.xml"))}
"""Makes Fast DDS less patient; the file says how, and why."""

DDS = {
    **PROFILE,
    # Two processes that share a network but not /dev/shm would find each other and then exchange
    # nothing: Fast DDS takes shared memory for granted on one host. LOCALHOST switches it back on.
    "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET",
    "COURSE_DISCOVERY": "inherit",
}
INLINE = "module://matplotlib_inline.backend_inline"
"""Where plots go, as in a kernel: into the outputs of a cell."""
KEPT = ("LANG", "LC_ALL", "LC_CTYPE", "TZ", "LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE",
        "AMENT_PREFIX_PATH", "PYTHONWARNINGS")  # fmt: skip
"""What a subject gets of the grader's environment: no token, no path of the course."""


def submission_environment() -> dict[str, str]:
    """Return a submission's whole environment."""
    kept = {name: os.environ[name] for name in KEPT if name in os.environ}
    programs = f"{Path(sys.executable).parent}:/usr/local/bin:/usr/bin:/bin"
    home = str(visible_files.HOME)
    return {
        **kept, **DDS, "PATH": programs, "HOME": home, "USER": "student", "LOGNAME": "student",
        "IPYTHONDIR": f"{home}/.ipython", "ROS_LOG_DIR": f"{home}/log", "MPLBACKEND": INLINE,
        "COURSE_INTERFACES_CACHE": str(cache.root()), "TMPDIR": "/tmp",
        # A numeric library's threads, one a processor of the machine, count as processes.
        "OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2", "PYTHONDONTWRITEBYTECODE": "1",
    }  # fmt: skip


def examiner_environment() -> dict[str, str]:
    """Return an examiner's whole environment: it has no secret of the grader's to give away."""
    # Its own messages are made of the right types: to look at each field again takes its time.
    return {**submission_environment(), "ROS_PYTHON_CHECK_FIELDS": "0"}
