# title: A driver that does not come up
# fails: nodes_start
# in: the stub

camera_qos = "best effort"
