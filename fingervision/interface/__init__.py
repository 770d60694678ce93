"""Functions of the Python interface (`import fingervision as fv`), and what the commands share with it.

`fingervision.__init__` lists the public names, and imports a module of this package when its name is first used. The
commands of `fingervision.cli` call the same functions, so that both give the same numbers.
"""
