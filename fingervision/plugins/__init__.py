"""Plug-ins: parts added by other distributions or single files, which are found, checked and listed with their origin.

README.md in the folder of this package is the guide for authors of plug-ins.
"""
