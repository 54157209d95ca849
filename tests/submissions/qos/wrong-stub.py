# title: The stub as it was handed out
# fails: camera_best_effort, lidar_fresh, stop_complete, camera_moves_on, stop_repaired
# says: camera_best_effort: so DDS re-sends
# says: lidar_fresh: It then worked through the last
# says: stop_complete: 90 of 100 were lost
# says: camera_moves_on: frames that were lost in the gap were sent again
# says: stop_repaired: of 100 were lost
# in: the stub
