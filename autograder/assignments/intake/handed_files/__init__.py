"""The files that were handed in: folders, zip files, and names that strangers gave."""
