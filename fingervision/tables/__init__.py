"""Reading of any laboratory's tables: format, columns and units are recognised.

The result is a table, drive or model.
"""
