"""Parts shared by all contract tests: a failure is a sentence; a test may declare that it does not apply."""

from typing import Any
from unittest import SkipTest


class ContractError(AssertionError):
    """A plug-in (effect, model, device) violates its contract; the message states the requirement and the violation."""


class NotApplicable(SkipTest):
    """The test does not apply to the part, for the stated reason."""


def hold(kept: bool, sentence: str) -> None:
    """Raise a ContractError with the sentence unless the condition is true."""
    if not kept:
        raise ContractError(sentence)


def checks_of(contract: type) -> tuple[str, ...]:
    """Names of the tests of a contract, in the order of their definition."""
    names = [name for base in reversed(contract.__mro__) for name in vars(base) if name.startswith("test_")]
    return tuple(dict.fromkeys(names))


def run(contract: type, **given: Any) -> dict[str, str]:
    """Run every test of a contract without pytest.

    Parameters
    ----------
    contract : type
        The contract class, such as `EffectContract`.
    **given
        Attributes that the contract requires, such as `effect=EFFECT`.

    Returns
    -------
    dict of str to str
        Sentence of each failed test, by the name of the test; empty if all tests passed.
    """
    failed = {}
    for name in checks_of(contract):
        of = contract()
        for key, value in given.items():
            setattr(of, key, value)
        try:
            getattr(of, name)()
        except NotApplicable:
            continue
        except Exception as error:
            failed[name] = str(error) if isinstance(error, ContractError) else f"{type(error).__name__}: {error}"
    return failed
