"""Reading of tables that other programs wrote: file format, columns and units are recognised.

The result is a measured table, a drive history or a model.
"""
