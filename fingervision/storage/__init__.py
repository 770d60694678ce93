"""Reading and writing of all data files: tables, drawings, settings, runs and results."""
