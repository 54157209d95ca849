# title: Sockets in the network that the examiner is in, too, from when a node is made
# told: there were more than 1200 sockets in its network

import os
import socket
import time


class SensorConsumers(Node):
    def __init__(self):
        super().__init__("sensor_consumers")
        elsewhere = os.fork()  # no process may have so many files open
        self.hoard = [socket.socketpair() for _ in range(400)]
        while elsewhere == 0:
            time.sleep(1)


class SensorDrivers(Node):
    def __init__(self):
        super().__init__("sensor_drivers")
