"""Required versions of fingervision, stated by a plug-in's distribution or by inline script metadata (PEP 723)."""

import re
import tomllib
from collections.abc import Iterable

from fingervision import __version__

# Regular expression for the metadata block, as given in PEP 723.
SCRIPT = re.compile(r"(?m)^# /// script\s*$\s(?P<content>(?:^#(?:| .*)$\s)+?)^# ///\s*$")


def unmet(requires: Iterable[str]) -> str | None:
    """Return the first stated requirement that this version of fingervision does not meet, such as `>=0.9`.

    The function returns None if all requirements are met.

    Parameters
    ----------
    requires : iterable of str
        Requirements as in PEP 508 (`fingervision>=0.2`); requirements on other distributions and invalid requirements
        are ignored here.
    """
    from packaging.requirements import InvalidRequirement, Requirement

    for words in requires:
        if not words.lower().lstrip().startswith("fingervision"):
            continue
        try:
            asked = Requirement(words)
        except InvalidRequirement:
            continue
        applies = asked.marker is None or asked.marker.evaluate({"extra": ""})
        if asked.name.lower() != "fingervision" or not applies:
            continue
        if not asked.specifier.contains(__version__, prereleases=True):
            return str(asked.specifier)
    return None


def stated_in(source: str) -> tuple[str, ...]:
    """Read the requirements in a file's inline script metadata; empty if there are none or they are not valid TOML."""
    found = SCRIPT.search(source)
    if found is None:
        return ()
    lines = (line[2:] if line.startswith("# ") else line[1:] for line in found["content"].splitlines())
    try:
        stated = tomllib.loads("\n".join(lines)).get("dependencies", [])
    except tomllib.TOMLDecodeError:
        return ()
    return tuple(one for one in stated if isinstance(one, str)) if isinstance(stated, list) else ()
