# title: A list of names in place of a design
# fails: design_runs
# says: design_runs: 'list' object

design = ["lidar_driver", "obstacle_detection", "path_planner", "navigation", "controller"]
