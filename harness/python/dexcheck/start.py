"""Starts the program that a wheel brings; without NumPy, which only the module needs."""

import os
import sys
from pathlib import Path


def main():
    program = str(Path(__file__).resolve().parent / "_program/bin/dexcheck")
    os.execv(program, [program, *sys.argv[1:]])
