# title: A driver that does not come up
# fails: nodes_start

camera_qos = "best effort"
