"""What of a submission may be shown in a page, and at what cost."""
