"""What several packages need: where the exercises lie, whole files, CSV, the terminal."""
