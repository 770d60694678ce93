"""`python -m fingervision` is the command line."""

from fingervision.cli import main

main()
