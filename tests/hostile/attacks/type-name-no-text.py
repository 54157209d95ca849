# title: A type on the graph has a name that is no text
# reaches: the exam
# base: right-chapter
# score: 0
# told: A name on the ROS graph is no text: b'\xff/X'

import ctypes
import time

from rclpy.context import Context
from rclpy.node import Node
from std_msgs.msg import UInt8

lib = ctypes.CDLL("libstd_msgs__rosidl_typesupport_fastrtps_c.so")
get = lib.rosidl_typesupport_fastrtps_c__get_message_type_support_handle__std_msgs__msg__UInt8
get.restype = ctypes.c_void_p
data = ctypes.cast(get() + 8, ctypes.POINTER(ctypes.c_void_p))[0]  # message_type_support_callbacks_t
names = ctypes.cast(data, ctypes.POINTER(ctypes.c_char_p))

_Drivers = SensorDrivers


class SensorDrivers(_Drivers):
    def __init__(self):
        super().__init__()
        other = Context()  # a participant knows one type of a topic
        other.init(domain_id=self.context.get_domain_id())
        self.odd = Node("odd", context=other, start_parameter_services=False, enable_rosout=False)
        names[0], names[1] = b"\xff", b"X"
        self.odd.create_publisher(UInt8, "camera/image", 1)
        time.sleep(3)  # until everybody has heard of it
