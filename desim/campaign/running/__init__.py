"""What is run, in which order, and by whom: processes here, or a Dask cluster."""
