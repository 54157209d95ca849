"""An exam and what it needs: the student's process, the checks, the points, the verdict."""
