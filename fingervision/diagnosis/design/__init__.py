"""Design of the next run: the experiment that best separates the remaining explanations."""
