# title: The stub as it was handed out
# fails: driver_runs, managed_runs
# in: the stub
