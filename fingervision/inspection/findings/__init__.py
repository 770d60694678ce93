"""Findings, one limit of a set-up per file; each file has `find(sample) -> Finding`.

A new finding is one new file (`inspection.catalogue` collects them).
"""
