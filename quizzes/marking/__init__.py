"""What answers earn, at once or when an instructor marks, and how it is put into words."""
