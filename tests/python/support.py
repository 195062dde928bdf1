"""Shared by the tests: where things are, and the programs beside the module."""

import json
import os
import subprocess
import sys
import unittest

try:
    import numpy  # noqa: F401
    import pandas  # noqa: F401
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)

import trocar  # noqa: E402

here = os.path.dirname(os.path.abspath(__file__))
program = os.environ["TROCAR_PROGRAM"]
source = os.environ["TROCAR_SOURCE_DIR"]
data = os.environ.get("TROCAR_DATA")


def run_program(*words, expect=0):
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, timeout=250)
    assert done.returncode == expect, done.stderr
    return done.stdout


def json_of(*words, expect=0):
    return json.loads(run_program(*words, "--json", expect=expect))


def python(*words, **more):
    """A Python process that imports the module and the tests' own."""
    path = os.pathsep.join([here, *sys.path])
    return subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True, timeout=250,
                          env={**os.environ, "PYTHONPATH": path}, **more)


class Case(unittest.TestCase):
    maxDiff = 2000

    def refuses(self, call, *parts):
        """One line of InputError with all parts."""
        with self.assertRaises(trocar.InputError) as caught:
            call()
        text = str(caught.exception)
        self.assertNotIn("\n", text)
        for part in parts:
            self.assertIn(part, text)


sys.path.insert(0, here)
