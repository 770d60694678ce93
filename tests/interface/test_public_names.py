"""The public face: every name is there, loads late, and stands in the stub; starting is fast and light."""

import ast
import importlib
import inspect
import os
import pkgutil
import re
import subprocess
import sys
from pathlib import Path

import pytest

import calib
import fingervision
from fingervision import testing

ROOT = Path(__file__).parents[2]
PACKAGES = [fingervision, calib]


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_every_public_name_is_there(package) -> None:
    for name in package.__all__:
        assert getattr(package, name) is not None
        assert name in dir(package)
    with pytest.raises(AttributeError):
        _ = package.no_such_name
    assert len(set(package.__all__)) == len(package.__all__)


def test_every_public_name_can_be_the_first_that_is_used() -> None:
    # Each in a fork before anything of the package is loaded: what is imported in a circle works in one order only.
    # The libraries are no part of these circles, and are loaded once.
    program = (
        "import os, sys, av, cv2, matplotlib.pyplot, scipy.interpolate, scipy.signal, scipy.stats, skfem\n"
        "import fingervision\n"
        "first = {home: name for name, home in fingervision._HOMES.items()}\n"
        "for home, name in first.items():\n"
        "    child = os.fork()\n"
        "    if not child:\n"
        "        getattr(fingervision, name)\n"
        "        os._exit(0)\n"
        "    if os.waitpid(child, 0)[1]:\n"
        "        sys.exit(home)\n"
    )
    if not hasattr(os, "fork"):
        pytest.skip("This system starts no process as a copy of another.")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_the_stub_names_the_same(package) -> None:
    tree = ast.parse((ROOT / package.__name__ / "__init__.pyi").read_text())
    stated = {alias.asname for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    stated |= {node.target.id for node in tree.body if isinstance(node, ast.AnnAssign)}  # type: ignore[union-attr]
    assert set(package.__all__) == stated - {None}


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_what_is_public_is_documented_with_an_example(package) -> None:
    plain = {"__version__", "batch", "effects"}
    for name in set(package.__all__) - plain:
        assert (getattr(package, name).__doc__ or "").strip(), name
    functions = [getattr(package, name) for name in package.__all__ if name[0].islower() and name not in plain]
    if package is fingervision:
        missing = [each.__name__ for each in functions if ">>>" not in (each.__doc__ or "")]
        assert not missing


@pytest.mark.parametrize("package", ["fingervision", "calib"])
def test_importing_loads_nothing_heavy(package: str) -> None:
    program = (
        f"import sys, {package} as p; dir(p); "
        "heavy = {'numpy', 'cv2', 'scipy', 'matplotlib', 'av', 'click', 'numba'} & set(sys.modules); "
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr


def test_a_function_stands_before_the_module_of_its_name() -> None:
    program = (
        "from calib.scale_from_sizes import ScaleFit; import calib; "
        "assert callable(calib.scale_from_sizes) and calib.ScaleFit is ScaleFit"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr


def own_errors() -> dict[str, type[Exception]]:
    """Classes of errors that the packages define, by their places; the page's server turns its own into messages."""
    found = {}
    for package in PACKAGES:
        for each in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not each.name.endswith("__main__") and not each.name.startswith("fingervision.live."):
                held = vars(importlib.import_module(each.name)).values()
                own = [kind for kind in held if inspect.isclass(kind) and kind.__module__ == each.name]
                found |= {f"{each.name}.{kind.__name__}": kind for kind in own if issubclass(kind, Exception)}
    return found


def caught_by_name() -> set[str]:
    """Names of the classes that the packages themselves catch."""
    trees = [ast.parse(path.read_text()) for package in PACKAGES for path in (ROOT / package.__name__).rglob("*.py")]
    nodes = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ExceptHandler) and node.type]
    return {name for node in nodes for name in re.findall(r"\w+", ast.unparse(node.type))}


def test_every_error_that_can_be_raised_is_public() -> None:
    """An error for users is public or of a public kind, each of a plug-in is public, and others are caught inside."""
    public = {getattr(package, name) for package in (*PACKAGES, testing) for name in package.__all__}
    kinds = public - {fingervision.FingervisionError}
    inside = caught_by_name()
    for place, kind in own_errors().items():
        is_for_users = issubclass(kind, fingervision.FingervisionError)
        known = bool(kinds.intersection(kind.__mro__)) if is_for_users else kind.__name__ in inside
        assert kind in public or (known and not place.startswith("fingervision.plugins.faults.")), place


def test_an_effect_is_one_thing_however_it_is_named() -> None:
    program = (
        "import fingervision as fv; import fingervision.effects.backlash; "
        "assert fv.effects.backlash is fv.effects['backlash'] and 'backlash' in dir(fv.effects); "
        "assert not hasattr(fv.effects, 'backlush')"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
