"""Serves the controller of a Python file to dexcheck, which starts this: python3 dexcheck/__main__.py LAW.py"""

import os
import runpy
import socket
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path[0] = str(Path(__file__).resolve().parents[1])

try:
    from dexcheck.controller import Controller, describe, refuse, serve  # noqa: E402
except ImportError as error:
    # A python3 of a user's own often lacks the NumPy that the system's has.
    system = "/usr/bin/python3"
    if "DEXCHECK_PYTHON" not in os.environ and os.access(system, os.X_OK) and not os.path.samefile(sys.executable, system):
        os.execv(system, [system, __file__, *sys.argv[1:]])
    sys.exit(f"dexcheck: {sys.executable}: {error}: controllers in Python need NumPy; DEXCHECK_PYTHON names another python3")


def find_controller(file):
    """The Controller that the file defines, or its function `step`."""
    sys.path.insert(0, str(Path(file).resolve().parent))
    names = runpy.run_path(file, run_name="dexcheck_controller")
    own = [value for value in names.values() if isinstance(value, type) and issubclass(value, Controller)
           and value.__module__ == "dexcheck_controller"]
    if len(own) == 1:
        return own[0]()
    if not own and callable(names.get("step")):
        return names["step"]
    raise ValueError(f"must define one class that derives from dexcheck.Controller, or a function step(state), got "
                     f"{len(own)} such classes")


def main():
    connection = socket.socket(fileno=os.dup(0))
    os.dup2(2, 1)  # what a controller prints is the user's
    try:
        controller = find_controller(sys.argv[1])
    except Exception as error:  # whatever the file does wrong
        refuse(connection, describe(error))
        return
    serve(connection, controller)


main()
