"""What several rooms need: where the exercises lie, whole files, a terminal that never acts."""
