"""Names of result folders: all different, short where they can be, and told apart by the path."""

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from fingervision.batch.run import LONGEST, folder_names

# Few letters, the separator among them, so that names clash in every way.
PART = st.sampled_from(["a", "b", "A", "a__b", "b__a", "__", "x.mp4", "X.mp4"])
PATHS = st.lists(st.lists(PART, min_size=1, max_size=4).map(lambda parts: Path("/", *parts)), unique=True, max_size=30)


@given(PATHS, st.sets(PART))
def test_no_two_are_the_same_and_none_is_taken(paths: list[Path], taken: set[str]) -> None:
    names = [name.casefold() for name in folder_names(paths, taken)]
    assert len(set(names)) == len(paths)
    assert not set(names) & {name.casefold() for name in taken}


@given(PATHS)
def test_each_name_ends_with_the_full_file_name_or_a_hash_behind_it(paths: list[Path]) -> None:
    for path, name in zip(paths, folder_names(paths, ()), strict=True):
        assert name.endswith(path.name) or f"{path.name}__" in name


def test_a_name_of_its_own_stands_alone() -> None:
    paths = [Path("/lab/day1/run.mp4"), Path("/lab/day2/run.mp4"), Path("/lab/day2/rest.mp4")]
    assert folder_names(paths, ()) == ("day1__run.mp4", "day2__run.mp4", "rest.mp4")


def test_a_very_long_name_still_fits() -> None:
    (name,) = folder_names([Path("/lab") / ("x" * 250)], ())
    assert LONGEST < len(name) < LONGEST + 20
