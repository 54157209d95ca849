"""What all views share: pace, text form, the registry, and what a saved notebook shows."""
