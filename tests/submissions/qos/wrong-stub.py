# title: The stub as it was handed out
# fails: camera_best_effort, lidar_fresh, stop_complete
# in: the stub
