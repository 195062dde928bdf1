"""Type stubs agree with the module, and types of the package with themselves."""

import os
import sys
import tempfile
import unittest

from support import Case, python

try:
    import mypy  # noqa: F401
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)


class Stubs(Case):
    def accepts(self, *words):
        with tempfile.TemporaryDirectory() as folder:  # for its cache
            done = python("-m", *words, cwd=folder)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_stubtest_accepts_them(self):
        self.accepts("mypy.stubtest", "trocar")

    def test_the_package_is_typed(self):
        import trocar
        self.accepts("mypy", "--strict", "--implicit-reexport", os.path.dirname(trocar.__file__))


if __name__ == "__main__":
    unittest.main()
