"""The result for readers: where measurement and simulation differ, figures, the page, the files."""
