# title: The stub as it was handed out
# fails: camera_best_effort, camera_newest, lidar_fresh, imu_burst, stop_complete, late_joiner, camera_moves_on, stop_repaired
# says: camera_best_effort: so DDS re-sends
# says: camera_newest: It then worked through the last
# says: lidar_fresh: It then worked through the last
# says: imu_burst: It then worked through the last 80
# says: stop_complete: 20 of 100 were lost
# says: late_joiner: It was handed camera readings from before it started
# says: camera_moves_on: frames that were lost in the gap were sent again
# says: stop_repaired: of 100 were lost
# points: 0
# in: the stub
