"""Who runs notebooks: threads of this process, or a Dask cluster."""
