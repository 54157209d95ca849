"""What a submission uses of the machine, watched from outside: one that uses too much is ended."""
