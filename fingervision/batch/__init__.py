"""Batch processing of many recordings or tables, on the cores of this computer or on an existing Dask cluster.

Each input has a result folder of its own.
"""
