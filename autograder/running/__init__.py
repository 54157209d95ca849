"""From a submission to its outcome: its processes, workers, and outcomes that are kept."""
