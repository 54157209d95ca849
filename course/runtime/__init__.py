"""What runs nodes: sessions, their executors, waiting, recording, simulated time and logs."""
