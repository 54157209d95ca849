# title: The stub as it was handed out
# fails: driver_runs, managed_runs
# says: driver_runs: There is no subscription to camera/zoom on the graph.
# says: managed_runs: Your process has not opened that camera.
# points: 0
# in: the stub
