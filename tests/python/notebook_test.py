"""The notebook of the documentation runs from begin to end, and draws."""

import os
import sys
import tempfile
import unittest

from support import Case, source

try:
    import ipykernel  # noqa: F401
    import matplotlib  # noqa: F401
    import nbclient
    import nbformat
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit(77)


class Notebook(Case):
    def test_runs_and_draws(self):
        notebook = nbformat.read(os.path.join(source, "docs", "notebooks", "compare.ipynb"), as_version=4)
        for cell in notebook.cells:
            self.assertFalse(cell.get("outputs"), "outputs are of one machine and are not kept")
        with tempfile.TemporaryDirectory() as folder:
            # A cell that raises ends the test with its traceback.
            nbclient.NotebookClient(notebook, timeout=250, kernel_name="python3",
                                    resources={"metadata": {"path": folder}}).execute()
            self.assertEqual(os.listdir(folder), [])
        outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
        drawings = [output for output in outputs if "image/png" in output.get("data", {})]
        self.assertEqual(len(drawings), 2)


if __name__ == "__main__":
    unittest.main()
