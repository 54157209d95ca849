"""What several rooms need: where the exercises lie, whole files, CSV, the terminal."""
