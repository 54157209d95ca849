"""What a bank holds, how it is read and checked, and which of its questions a learner gets."""
