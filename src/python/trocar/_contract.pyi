import os
from typing import List, Union

def run_contract_tests(words: List[str], share: Union[str, os.PathLike[str]]) -> int: ...
