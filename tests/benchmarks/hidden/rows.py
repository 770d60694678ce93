"""The rows of the table of diagnosing.md, section 5."""

from tests.benchmarks.hidden.experiment import Row

ROWS = {
    row.name: row
    for row in (
        Row("null", ("rich", "ordinary"), 0, False, (1.0,)),
        Row("single_3", ("rich",), 1, False, (3.0,)),
        Row("single_1", ("rich",), 1, False, (1.0,)),
        Row("single_03", ("rich",), 1, False, (0.3,)),
        Row("single_everyday", ("rich",), 1, False, (0.0,)),
        Row("ordinary", ("ordinary",), 1, False, (1.0, 3.0)),
        Row("outside", ("rich",), 0, True, (1.0, 3.0)),
        Row("pair_3", ("rich",), 2, False, (3.0,)),
        Row("pair_1", ("rich",), 2, False, (1.0,)),
        Row("poor", ("poor",), 1, False, (1.0, 3.0)),
    )
}
