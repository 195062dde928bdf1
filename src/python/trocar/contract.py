"""The contract tests on methods written in Python: python3 -m trocar.contract --method NAME=MODULE:CLASS ...

Further words are GoogleTest's, such as --gtest_list_tests. Allocations are not counted here. Exit status: 0 all passed;
1 one failed; 2 there is none to run, or a method cannot be read.
"""

import sys

import trocar


def _run(words: "list[str]") -> int:
    try:
        from trocar import _contract
    except ImportError:
        print("trocar: contract tests: expected the target trocar_python_contract, got a build without it", file=sys.stderr)
        return 2
    return _contract.run_contract_tests(["trocar.contract", *words], trocar._share())


if __name__ == "__main__":
    sys.exit(trocar._main(sys.argv[1:], _run))
