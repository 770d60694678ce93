"""Instruments that talk in lines of text: their words from a TOML file, and the conversation over a port."""
