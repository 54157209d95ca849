# title: A type on the graph is called like a module that would end, or take, whoever imports it
# reaches: the exam
# exercise: architecture
# base: wrong-emptied
# score: 0
# told: Nobody publishes on /scan

import ctypes
from rclpy.node import Node as _Node
from std_msgs.msg import UInt8

lib = ctypes.CDLL("libstd_msgs__rosidl_typesupport_fastrtps_c.so")
get = lib.rosidl_typesupport_fastrtps_c__get_message_type_support_handle__std_msgs__msg__UInt8
get.restype = ctypes.c_void_p
data = ctypes.cast(get() + 8, ctypes.POINTER(ctypes.c_void_p))[0]  # message_type_support_callbacks_t
names = ctypes.cast(data, ctypes.POINTER(ctypes.c_char_p))

PLACES = [
    b"tests.hostile.attacks::segfault", b"submitted.evil.ch05::evil", b"..::evil", b"os::path",
    b"tests.hostile.attacks::exits",
]


class Evil(_Node):
    def __init__(self):
        super().__init__("evil")
        for number, place in enumerate(PLACES):
            names[0], names[1] = place, b"X"
            self.create_publisher(UInt8, f"evil_{number}", 1)


class Design:
    def node_factories(self):
        return {"evil": Evil}


design = Design()
