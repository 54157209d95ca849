"""The course's material: where it lies, a student's working copy of it, and what students get."""
