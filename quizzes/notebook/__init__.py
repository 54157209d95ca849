"""A quiz in a notebook: opened by its name, shown as a widget."""
