# title: The network of the host and beyond
# prints: reached: []

import socket

reached = []
for family, kind, address in [
    (socket.AF_INET, socket.SOCK_STREAM, ("127.0.0.1", PORT)),
    (socket.AF_INET, socket.SOCK_STREAM, ("1.1.1.1", 53)),
    (socket.AF_INET, socket.SOCK_DGRAM, ("8.8.8.8", 53)),
    (socket.AF_UNIX, socket.SOCK_STREAM, "\0ros2-course-hostile-PORT"),
    (socket.AF_UNIX, socket.SOCK_STREAM, "/run/docker.sock"),
]:
    try:
        with socket.socket(family, kind) as sock:
            sock.settimeout(1)
            sock.connect(address)
            sock.send(b"hostile")
            reached.append(address)
    except OSError:
        pass
try:
    socket.socket(socket.AF_VSOCK, socket.SOCK_STREAM)
    reached.append("vsock")
except OSError:
    pass
print("reached:", reached)
