# title: New namespaces, mounts, tracing, keyrings, leases, watches, the kernel's other doors
# prints: opened: []

import ctypes
import os

libc = ctypes.CDLL(None, use_errno=True)
opened = []
for name, number, *arguments in [
    ("unshare", 272, 0x10000000),
    ("clone", 56, 0x10000000 | 17, 0, 0, 0, 0),
    ("mount", 165, b"none", b"/tmp", b"tmpfs", 0, 0),
    ("ptrace", 101, 16, 1, 0, 0),
    ("keyctl", 250, 0, -3, 0),
    ("bpf", 321, 0, 0, 0),
    ("io_uring_setup", 425, 8, bytes(200)),
    ("perf_event_open", 298, bytes(200), 0, -1, -1, 0),
    ("userfaultfd", 323, 0),
    ("setns", 308, 0, 0),
    ("clone3", 435, bytes(88), 88),
    ("semget", 64, 0, 32000, 0o600),
    ("shmget", 29, 0, 4096, 0o600),
    ("msgget", 68, 0, 0o600),
    ("setxattr", 188, b"/tmp", b"user.a", b"x", 1, 0),
    ("inotify_init", 253),
    ("inotify_init1", 294, 0),
    ("fanotify_init", 300, 0, 0),
    ("lease", 72, os.open(os.__file__, 0), 1024, 0),
    ("notify", 72, os.open("/tmp", 0), 1026, 1),
    ("lock without an owner", 72, os.open("/tmp/lock", os.O_RDWR | os.O_CREAT), 37, bytes(32)),
]:
    if libc.syscall(number, *arguments) >= 0:
        opened.append(name)
for path in ("/proc/self/oom_score_adj", "/proc/1/oom_score_adj", "/proc/self/mem"):
    try:
        with open(path, "r+b"):
            opened.append(path)
    except OSError:
        pass
for path in ("/proc/1/mem", "/proc/sys/kernel/core_pattern", "/proc/sysrq-trigger", "/dev/kmsg"):
    try:
        with open(path, "wb"):
            opened.append(path)
    except OSError:
        pass
with open("/proc/self/oom_score_adj") as score:
    if score.read() != "1000\n":
        opened.append("oom score")
if os.getuid() == 0:
    opened.append("root")
print("opened:", opened)
