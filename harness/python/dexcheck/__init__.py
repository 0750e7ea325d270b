"""Robots from parameter files, URDFs and MJCFs: their terms as NumPy arrays, whether two of them agree; and runs with
controllers of one's own. The README of harness/python has examples."""

import importlib

from .controller import Controller, RunError, serve

_OF_RUNS = ("Run", "diagnose", "run", "study")
__all__ = ["Controller", "RunError", "serve", *_OF_RUNS]


def __getattr__(name):
    """The rest is loaded when it is used: a controller needs NumPy alone, in any version of Python."""
    module = importlib.import_module(".runs" if name in _OF_RUNS else "._dexcheck", __name__)
    return getattr(module, name)
