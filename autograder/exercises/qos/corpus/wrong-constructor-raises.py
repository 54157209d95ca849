# title: A driver that does not come up
# fails: nodes_start
# says: nodes_start: SensorDrivers() makes a node without an error.
# in: the stub

camera_qos = "best effort"
