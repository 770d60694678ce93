"""Plug-ins: parts that other distributions and single files add, found, checked and listed with where they come from.

README.md beside this file says what an author of a plug-in must know.
"""
