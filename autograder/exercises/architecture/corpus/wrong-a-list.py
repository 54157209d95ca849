# title: A list of names in place of a design
# fails: design_runs
# says: design_runs: design is of type list, which has no nodes

design = ["lidar_driver", "obstacle_detection", "path_planner", "navigation", "controller"]
