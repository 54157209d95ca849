"""nbgrader's configuration for a student's JupyterLab, where `course lab` starts it."""

c = get_config()  # noqa: F821 - given by nbgrader

# The Validate button runs the checks in a kernel: some need several seconds of simulated time.
c.Execute.timeout = 300
