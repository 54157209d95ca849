# title: The stub as it was handed out
# fails: camera_best_effort, lidar_fresh, stop_complete, camera_moves_on, stop_repaired
# in: the stub
