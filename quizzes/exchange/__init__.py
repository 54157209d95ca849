"""Banks and learning platforms: export to Moodle and Canvas, and back from Moodle."""
