"""Robots from parameter files, URDFs and MJCFs: their terms as NumPy arrays, whether two of them agree, whether one explains a
recording; and runs with controllers of one's own. The README of harness/python has examples."""

import importlib

_PLACES = {
    "comparison": ("Cause", "Comparison", "Diagnosis", "Judgement", "diagnose", "judge"),
    "controller": ("Controller", "InputError", "RunError", "serve"),
    "robot": ("Log", "Robot", "__version__", "load"),
    "runs": ("Run", "Study", "run", "study"),
}
__all__ = [name for names in _PLACES.values() for name in names if not name.startswith("_")]


def __getattr__(name):
    """Loads a name when it is used first: to start the program needs none, to serve a controller those of controller.py."""
    for place, names in _PLACES.items():
        if name in names:
            return getattr(importlib.import_module("." + place, __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
