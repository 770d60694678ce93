"""Batch processing of many recordings or tables, on this machine's cores or on an existing Dask cluster.

Each input gets its own result folder.
"""
