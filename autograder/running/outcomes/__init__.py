"""What came of notebooks: kept, entered once, and run again when something has changed."""
