"""Words of the browser page for what an error message calls by an option of the command line."""

import json
import re
from typing import Any

OPTION = re.compile(r"`[^`\"]*`|(?: with)? (?P<out>--out)|(?<![\w/.-])--(?P<name>[a-z][a-z-]*)")
"""Matches a command in backticks, which is not changed, or an option."""
OF_PAGE = {
    "px-per-mm": "The scale",
    "u-px-per-mm": "The uncertainty of the scale",
    "below-tip-mm": "The height below the tips",
    "roi": "The region",
    "out": "The output folder",
    "size-mm": "The size",
    "u-size-mm": "The uncertainty of the size",
    "rate-hz": "The frame rate",
}


def page_json(content: Any) -> str:
    """Write a message to the page as JSON, without options of the command line, which its user did not type.

    Examples
    --------
    >>> page_json("--px-per-mm must be positive, but is -3.")
    '"The scale must be positive, but is -3."'
    >>> page_json("The disk is full: name another folder with --out.")
    '"The disk is full: name another folder at the next start."'
    """
    text = json.dumps(content, ensure_ascii=False)
    return OPTION.sub(_in_page, text) if "--" in text else text


def _in_page(found: re.Match[str]) -> str:
    if found["out"]:
        return " at the next start"
    name = found["name"]
    return found[0] if name is None else OF_PAGE.get(name, name.replace("-", " "))
