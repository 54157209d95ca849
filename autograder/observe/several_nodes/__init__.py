"""Several of the student's nodes, one at a time, on a clock that only the examiner moves."""
