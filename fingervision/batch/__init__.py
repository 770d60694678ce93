"""Many recordings or tables: each in its own result folder, on this machine's cores or on an existing Dask cluster."""
