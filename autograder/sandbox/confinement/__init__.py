"""What a submission cannot reach: files, network, system calls, the environment of others."""
