"""The examples of docs/PYTHON.md run as they stand, but for studies."""

import os
import re
import tempfile
import unittest

import trocar
from detect_test import FACES, FIRST, SECOND, write_meshes
from support import Case, source


class Examples(Case):
    def test_run(self):
        with open(os.path.join(source, "docs", "PYTHON.md"), encoding="utf-8") as file:
            blocks = re.findall(r"```python\n(.*?)```", file.read(), flags=re.S)
        names = {"trocar": trocar, "vertices_a": FIRST, "faces_a": FACES, "vertices_b": SECOND, "faces_b": FACES}
        before, run = os.getcwd(), 0
        with tempfile.TemporaryDirectory() as folder:
            write_meshes(folder, "liver.obj", "tool.obj")
            os.symlink(os.path.join(source, "reports"), os.path.join(folder, "reports"))
            os.chdir(folder)
            try:
                for block in blocks:
                    if "trocar.study(" not in block:
                        exec(compile(block, "docs/PYTHON.md", "exec"), names)
                        run += 1
            finally:
                os.chdir(before)
        self.assertGreaterEqual(run, 5)
        self.assertEqual(names["found"].pairs.tolist(), [[3, 1], [3, 2], [3, 3]])
        self.assertEqual((names["result"].outcome, names["simulation"].outcome), ("ok", "ok"))


if __name__ == "__main__":
    unittest.main()
