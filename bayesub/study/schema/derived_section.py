"""Quantities of a study's own that follow from the coefficients: a Python function each."""

import importlib.util
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pydantic

from bayesub.io.errors import InputError, nearest
from bayesub.io.toml_files import Section

if TYPE_CHECKING:
    from bayesub.model.boats import Boats
    from bayesub.model.quantities import Quantity
    from bayesub.model.vehicles import Vehicle


class DerivedSection(Section):
    """A quantity of a study's own.

    Attributes
    ----------
    name : ends with the unit, as in ``first_dive_m``
    function : ``file.py:function``, the file relative to the study. The function takes boats, n of them
        (:class:`bayesub.model.boats.Boats`), and returns n numbers, not a number where a boat has none. The file must
        not need others beside it.
    meaning : one sentence for the report
    none : what is so of a boat that has no such value
    """

    name: str = pydantic.Field(pattern=r"^[a-z][a-z0-9_]*$")
    function: str = pydantic.Field(pattern=r"^[^:]+\.py:[A-Za-z_]\w*$")
    meaning: str = ""
    none: str = "the function says so"

    @property
    def file(self) -> str:
        """The file of the function."""
        return self.function.rpartition(":")[0]

    def build(self, vehicle: "Vehicle", path: Callable[[str], str]) -> "Quantity":
        """The quantity, whose function has been tried on the vehicle.

        Parameters
        ----------
        vehicle : of the study
        path : where the file is, by its name in the study

        Raises
        ------
        InputError : for a name that is taken, a function that is not there, and one that fails or returns something
            else
        """
        from bayesub.model.boats import Boats  # they import numba, which a study file is read without
        from bayesub.model.quantities import QUANTITIES, Quantity

        if self.name in QUANTITIES:
            raise InputError(
                f"derived: '{self.name}' is built in and needs no function; give another name", "conflict", self.name
            )
        function = partial(_called, self.function, _function(Path(path(self.file)), self.function))
        function(Boats(vehicle, np.tile(vehicle.xi, (2, 1))))
        return Quantity(self.name, "", self.meaning, (), "", function, self.none)


def _function(path: Path, function: str) -> Callable:
    """The function of a file; the file is run."""
    name = function.rpartition(":")[2]
    spec = importlib.util.spec_from_file_location(f"derived_{re.sub(r'[^A-Za-z0-9]', '_', path.stem)}", path)
    assert spec is not None  # as the name of the file ends with .py
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever a file of the user's raises
        raise InputError(f"derived: {path} cannot be run: {_words(error)}", "format", "derived.file") from None
    if not callable(getattr(module, name, None)):
        valid = [key for key, value in vars(module).items() if callable(value)]
        raise InputError(
            f"derived: {path} has no function '{name}'{nearest(name, valid)}", "unknown", "derived.function"
        )
    return getattr(module, name)


def _called(name: str, function: Callable, boats: "Boats") -> np.ndarray:
    """The values (n,) of a function of a user's."""
    try:
        values = np.asarray(function(boats), dtype=float)
    except Exception as error:  # whatever a function of the user's raises
        raise InputError(f"derived: {name} fails: {_words(error)}", "value", name) from None
    if values.shape != (len(boats),):
        raise InputError(
            f"derived: {name} returns shape {values.shape} for {len(boats)} boats; return one number for each, "
            f"({len(boats)},)",
            "value",
            name,
        )
    return values


def _words(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
