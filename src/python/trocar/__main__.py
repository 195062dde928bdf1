"""The program trocar with methods written in Python: python3 -m trocar [--method NAME=MODULE:CLASS]... COMMAND ..."""

import sys

import trocar
from trocar import _trocar


def _run(words: "list[str]") -> int:
    return _trocar.run_program(["trocar", *words], trocar._share(), [sys.executable, "-m", "trocar"])


if __name__ == "__main__":
    sys.exit(trocar._main(sys.argv[1:], _run))
