#!/usr/bin/env python3
"""Would the tests notice? Changes one line of the product at a time and says which test fails.

./test.sh mutants [N] calls this. A copy of the tracked files is made in build/mutants/tree and built in
build/mutants/build; the clone itself is never changed. N places are drawn by a seed from all places that the rules fit.
Each is changed, built, and held against the tests of its folder; then those that these let pass are held against all
tests, which takes much longer. What was found stands in build/mutants/results.jsonl, and a run that is started again goes
on where it stopped; what an earlier clone found is taken from tests/mutation/judged.jsonl, which is such a file. Tests that
fail without any change are left out and reported.

Exit status: 0 all N were tried; 1 fewer than 90 in 100 of them were killed; 2 bad input; 130 interrupted.
"""
import argparse
import hashlib
import itertools
import json
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Folders of tests that hold a folder of the product beside the one of its own name.
TESTS_OF = {
    "baselines": ["contract"],
    "src/app": ["app", "view"],
    "src/contact": ["contact", "respond"],
    "src/detect": ["detect", "contract"],
    "src/respond": ["respond", "contract"],
    "src/tissue": ["tissue", "contract"],
    "src/contact_generation": ["contact_generation", "simulate"],
    "src/web": ["report", "view"],
    "src/trocar": ["house"],
}
# Not seen by the tests of its folder, the others yet to be asked.
PASSED = "passed its folder"
# A header that more files than these include costs a build of everything.
MOST_INCLUDERS = 12


def larger(match):
    """Twice a constant; of what is small enough to allow for rounding only, a million times."""
    return f"({'1e6' if float(match[0]) < 1e-8 else '2.0'} * {match[0]})"


def rules():
    """Name, pattern on the code without comments and texts, replacement."""
    for old, new in [("<", "<="), ("<=", "<"), (">", ">="), (">=", ">"), ("==", "!="), ("!=", "==")]:
        yield "comparison", rf"(?<= ){old}(?= )", new
    for old, new in [("+", "-"), ("-", "+"), ("+=", "-="), ("-=", "+=")]:
        yield "sign", rf"(?<=[\w)\]] ){re.escape(old)}(?= )", new
    yield "sign", r"(?:(?<=[=(,?:] )|(?<=[(\[])|(?<=return ))-(?=[\w(])", ""
    yield "factor", r"(?<= )\*(?= )", "/"
    yield "factor", r"(?<= )/(?= )", "*"
    yield "logic", r"(?<= )&&(?= )", "||"
    yield "logic", r"(?<= )\|\|(?= )", "&&"
    yield "logic", r"(?<=[ (])!(?=[\w(])", ""
    yield "logic", r"\btrue\b", "false"
    yield "logic", r"\bfalse\b", "true"
    yield "off by one", r"(?<= [+-] )1(?=[;,) \]])", "0"
    yield "off by one", r"(?<== )0(?=; \w+ <)", "1"
    yield "off by one", r"(?<== )1(?=; \w+ <)", "0"
    yield "constant", r"(?<![\w.])(?!0\.0\b)\d+\.\d+(e[-+]?\d+)?(?![\w.])", larger
    yield "constant", r"(?<![\w.])0\.0(?![\w.])", "1.0"
    yield "constant", r"(?<![\w.])\d+e[-+]?\d+(?![\w.])", larger
    yield "dropped term", r" [+-] [\w.]+(?:\([\w., ]*\))?(?=[;)])", ""
    yield "dropped condition", r" (?:&&|\|\|) [^&|();]+(?=\))", ""
    yield "dropped statement", r"(?m)(?<=^)( +)[\w.\[\]]+(?:->[\w.\[\]]+)* [+\-*/|&]?= [^;{}]+;$", lambda m: f"{m[1]};"
    yield "dropped statement", r"(?m)(?<=^)( +)[\w.]+\([^;{}]*\);$", lambda m: f"{m[1]};"
    yield "swap", r"\bstd::(f?)min\(", lambda m: f"std::{m[1]}max("
    yield "swap", r"\bstd::(f?)max\(", lambda m: f"std::{m[1]}min("


HIDDEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![\w])\'(?:\\.|[^\'\\\n])\''
    r"|^[ \t]*#(?:\\\n|[^\n])*|\.reserve\([^;]*;|\bstatic_assert\([^;]*;|\bthrow [^;]*;|\bfmt::print\([^;]*;|\bInputError\([^;]*;",
    re.DOTALL | re.MULTILINE)


def without_texts(code):
    """The same code with comments, texts, preprocessor lines and messages blanked; places stay."""
    return HIDDEN.sub(lambda m: re.sub(r"[^\n]", "\x00", m[0]), code)


class Mutant:
    def __init__(self, key, path, code, rule, match, new):
        self.path, self.rule = path, rule
        self.begin, self.end, self.new = match.start(), match.end(), new
        self.line = code.count("\n", 0, self.begin) + 1
        changed = code[:self.begin] + new + code[self.end:]
        start = code.rfind("\n", 0, self.begin) + 1
        self.before = code[start:code.find("\n", self.end)].strip()
        self.after = changed[start:changed.find("\n", self.begin + len(new))].strip()
        self.code = changed
        self.key = key

    def folder(self):
        parts = pathlib.PurePath(self.path).parts
        return "/".join(parts[:2]) if parts[0] == "src" else parts[0]

    def text(self):
        before, after = (" ".join(text.split()) for text in (self.before, self.after))
        return f"{self.path}:{self.line}: {self.rule}: {before}  →  {after}"


def tracked_files(tree):
    """Files of the clone that stand in `tree` too, which is itself or the copy (under build, which git does not see)."""
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True,
                            capture_output=True).stdout.decode()
    return [name for name in listed.split("\0") if name and (tree / name).is_file()]


def product_files(tree):
    names = [n for n in tracked_files(tree) if re.match(r"(src|baselines)/.*\.[ch]pp$", n)]
    texts = {n: (tree / n).read_text() for n in names}
    included = {}
    for text in texts.values():
        for name in set(re.findall(r'#include "([^"]+)"', text)):
            included[name] = included.get(name, 0) + 1
    return {n: t for n, t in texts.items()
            if n.endswith(".cpp") or included.get(n.removeprefix("src/"), 0) <= MOST_INCLUDERS}


def all_mutants(tree, folders):
    by_rule = {}
    for path, code in sorted(product_files(tree).items()):
        if folders and not any(path.startswith(f.rstrip("/") + "/") for f in folders):
            continue
        plain = without_texts(code)
        for rule, pattern, new in rules():
            for match in re.finditer(pattern, plain):
                if "\x00" in match[0]:
                    continue
                text = new(match) if callable(new) else new
                by_rule.setdefault(rule, []).append((path, code, rule, match, text))
    return by_rule


def drawn(by_rule, seed):
    """All places in the order of the seed, the rules by turns, so that the commonest does not crowd out the others. The
    order of two places does not depend on any third, so that what is known of most stays of use when the code changes."""
    piles = []
    for rule in sorted(by_rule):
        pile, seen = [], {}
        for place in by_rule[rule]:
            path, code, _, match, new = place
            line = code[code.rfind("\n", 0, match.start()) + 1:code.find("\n", match.end())]
            column = match.start() - code.rfind("\n", 0, match.start())
            name = f"{path} {line} {column} {new}"
            seen[name] = seen.get(name, 0) + 1
            name += f" {seen[name]}"
            pile.append((digest_of(f"{seed} {name}"), digest_of(name)[:16], place))
        piles.append([(key, *place) for _, key, place in sorted(pile, key=lambda entry: entry[0])])
    while any(piles):
        for pile in piles:
            if pile:
                yield Mutant(*pile.pop())


def digest_of(text):
    return hashlib.sha1(text.encode()).hexdigest()


def copy_tree(target):
    """What has changed alone is written, so that a second run builds little. Says whether anything had."""
    names = set(tracked_files(ROOT))
    changed = False
    for name in names:
        source, copy = ROOT / name, target / name
        if copy.is_file() and copy.read_bytes() == source.read_bytes():
            continue
        changed = True
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, copy)
    for copy in target.rglob("*"):
        if copy.is_file() and str(copy.relative_to(target)) not in names:
            changed = True
            copy.unlink()
    return changed


def tests_digest(tree):
    digest = hashlib.sha1()
    for name in sorted(n for n in tracked_files(tree) if n.startswith("tests/")):
        digest.update((tree / name).read_bytes())
    return digest.hexdigest()[:16]


class Workshop:
    def __init__(self, tree, build, jobs, limit):
        self.tree, self.build, self.jobs, self.limit = tree, build, jobs, limit
        self.left_out = []

    def run(self, command, limit):
        """Exit status and both outputs; None where the time was up."""
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, cwd=self.tree)
        try:
            output = process.communicate(timeout=limit)[0]
        except BaseException as stopped:
            process.terminate()
            process.wait()
            if isinstance(stopped, subprocess.TimeoutExpired):
                return None, ""
            raise
        return process.returncode, output.decode(errors="replace")

    def make(self, *targets):
        return self.run(["cmake", "--build", str(self.build), f"-j{self.jobs}", "--target", *targets], 3600)

    def configure(self, changed=()):
        # Files that will be changed are compiled alone: a mutant costs its own file.
        alone = ";".join(str(self.tree / name) for name in changed)
        # A place behind the end of a list is what the tests under ASan would report; here the library's own checks do.
        arguments = ["-DCMAKE_BUILD_TYPE=Release", "-DTROCAR_WERROR=OFF",
                     "-DCMAKE_CXX_FLAGS_RELEASE=-O2 -DNDEBUG -D_GLIBCXX_ASSERTIONS",
                     "-DTROCAR_PRECOMPILED=ON", "-DTROCAR_UNITY=ON", f"-DTROCAR_ALONE={alone}",
                     f"-DTROCAR_TEST_SECONDS={self.limit}"]
        status, output = self.run(["cmake", "-G", "Ninja", "-S", str(self.tree), "-B", str(self.build), *arguments], 600)
        if status != 0:
            sys.exit(f"mutants: the unchanged tree cannot be configured:\n{output[-3000:]}")

    def make_all(self):
        status, output = self.make("all")
        if status != 0:
            sys.exit(f"mutants: the unchanged tree does not build:\n{output[-3000:]}")

    def compiled(self):
        """Sources that this build compiles: not those of baselines whose library is absent."""
        files = []
        for command in json.loads((self.build / "compile_commands.json").read_text()):
            file = pathlib.Path(command["directory"], command["file"])
            if file.parent.name == "Unity":
                files += map(pathlib.Path, re.findall(r'#include "([^"]+)"', file.read_text()))
            files.append(file)
        return {str(file.relative_to(self.tree)) for file in files if file.is_relative_to(self.tree)}

    def failures(self, folder=None, all_of_them=False):
        """Names of tests that fail; the first alone unless all are wanted."""
        place = self.build / "tests" / folder if folder else self.build
        if not place.is_dir():
            return []
        only = [] if all_of_them else ["--stop-on-failure"]
        if folder:
            only += ["-LE", "long"]  # these wait until all are asked
        passed_alone = []
        while reported := self.reported_by_ctest(place, only, self.left_out + passed_alone):
            # Others may have had the machine: what ran out of time is asked once more, alone.
            late = [name for name, why in reported if why == "Timeout"]
            if all_of_them or len(late) < len(reported):
                return [name for name, _ in reported]
            for name in late:
                if self.reported_by_ctest(place, ["-R", f"^{re.escape(name)}$"], []):
                    return [name]
            passed_alone += late
        return []

    def reported_by_ctest(self, place, arguments, left_out):
        """Name and reason of each test that failed."""
        command = ["ctest", "--test-dir", str(place), f"-j{self.jobs}", "--timeout", str(self.limit), *arguments]
        if left_out:
            command += ["-E", "^(" + "|".join(re.escape(name) for name in left_out) + ")$"]
        status, output = self.run(command, 7200)
        if status == 0:
            return []
        reported = re.findall(r"^\s*\d+ - (\S+) \((?!Skipped|Disabled)([^)]*)\)", output, re.MULTILINE)
        if not reported:
            sys.exit(f"mutants: expected ctest to name what failed, found\n{output[-3000:]}")
        return reported

    def judge(self, mutant, by_all):
        """killed, does not compile, or not killed: `survived` where `by_all` asks all tests, else PASSED; and by which."""
        file = self.tree / mutant.path
        original = file.read_text()
        try:
            file.write_text(mutant.code)
            # A source file of the library changes the shared library alone, which the tests then load.
            in_library = mutant.path.endswith(".cpp") and not mutant.path.startswith("src/app/")
            own = TESTS_OF.get(mutant.folder(), [mutant.folder().split("/")[-1]])
            own = [folder for folder in own if (self.build / "tests" / folder).is_dir()]
            targets = ["trocar"] if in_library else ["all"] if by_all else ["trocar", *(f"tests/{f}/all" for f in own)]
            if self.make(*targets)[0] != 0:
                return "does not compile", []
            for folder in [None] if by_all else own:
                if failed := self.failures(folder):
                    return "killed", failed
            return ("survived" if by_all else PASSED), []
        finally:
            file.write_text(original)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", nargs="?", type=int, default=100, help="mutants that compile (default 100)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folders", default="", help="only these, as src/detect,baselines")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--limit", type=int, default=180, help="seconds that one test may take")
    parser.add_argument("--list", action="store_true", help="print the mutants and build nothing")
    parser.add_argument("--in-place", metavar="BUILD",
                        help="change this very tree, which is a copy, and use its build folder, which is up to date")
    options = parser.parse_args()
    if options.count < 1 or options.jobs < 1 or options.limit < 1:
        parser.error("count, --jobs and --limit: expected a whole number >= 1")
    return options


def main():
    options = arguments()
    work = ROOT / "build/mutants"
    tree = ROOT if options.in_place else work / "tree"
    build = pathlib.Path(options.in_place).resolve() if options.in_place else work / "build"
    work.mkdir(parents=True, exist_ok=True)
    unchanged = work / "fail_unchanged.json"
    if not options.in_place and not options.list and copy_tree(tree):
        unchanged.unlink(missing_ok=True)
    by_rule = all_mutants(ROOT if options.list else tree, [f for f in options.folders.split(",") if f])
    if not by_rule:
        print(f"mutants: expected folders of the product such as src/detect, found {options.folders}", file=sys.stderr)
        return 2
    print(", ".join(f"{rule} {len(by_rule[rule])}" for rule in sorted(by_rule)), "places", flush=True)
    queue = drawn(by_rule, options.seed)
    if options.list:
        for _, mutant in zip(range(options.count), queue):
            print(mutant.text())
        return 0

    shop = Workshop(tree, build, options.jobs, options.limit)
    if not options.in_place:
        shop.configure()
    compiled = shop.compiled()
    queue = (mutant for mutant in queue if not mutant.path.endswith(".cpp") or mutant.path in compiled)
    if not options.in_place:
        # A third more than are wanted: some do not compile.
        queue = list(itertools.islice(queue, options.count + options.count // 3 + 1))
        shop.configure(sorted({mutant.path for mutant in queue}))
        shop.make_all()
    if not unchanged.is_file():
        unchanged.write_text(json.dumps(shop.failures(all_of_them=True)))
    shop.left_out = json.loads(unchanged.read_text())
    if shop.left_out:
        print("left out, fail without any change:", ", ".join(shop.left_out))
    results = work / "results.jsonl"
    known = {}
    for file in (ROOT / "tests/mutation/judged.jsonl", results):
        if file.is_file():
            known |= {entry["key"]: entry for entry in map(json.loads, file.read_text().splitlines())}
    tests = tests_digest(tree)

    def tried(mutant, by_all):
        """The entry of a mutant, known or new."""
        entry = known.get(mutant.key)
        # What was not killed is tried again once there are other tests.
        if entry and entry["verdict"] in (PASSED, "survived") and entry["tests"] != tests:
            entry = None
        if entry is None or (by_all and entry["verdict"] == PASSED):
            start = time.monotonic()
            verdict, by = shop.judge(mutant, by_all)
            entry = {"key": mutant.key, "mutant": mutant.text(), "verdict": verdict, "by": by, "tests": tests,
                     "seconds": round(time.monotonic() - start)}
            known[mutant.key] = entry
            with results.open("a") as stream:
                stream.write(json.dumps(entry, ensure_ascii=False) + "\n")
        by = " by " + ", ".join(entry["by"][:3]) if entry["by"] else ""
        print(f"{entry['mutant']}\n    {entry['verdict']}{by} ({entry['seconds']} s)", flush=True)
        return entry["verdict"]

    counts = {"killed": 0, "survived": 0, "does not compile": 0, PASSED: 0}
    passed = []
    for mutant in queue:
        if sum(counts.values()) - counts["does not compile"] == options.count:
            break
        verdict = tried(mutant, by_all=False)
        counts[verdict] += 1
        if verdict == PASSED:
            passed.append(mutant)
    print(f"{len(passed)} that the tests of their folders let pass, against all tests:", flush=True)
    survivors = []
    for mutant in passed:
        verdict = tried(mutant, by_all=True)
        counts[verdict] += 1
        if verdict == "survived":
            survivors.append(mutant.text())
    judged = counts["killed"] + counts["survived"]
    if judged == 0:
        sys.exit("mutants: none of the drawn places is in a file that this build compiles by itself")
    print(f"{judged} mutants, {counts['killed']} killed, {counts['survived']} survived; "
          f"{counts['does not compile']} more did not compile; seed {options.seed}")
    for survivor in survivors:
        print("survived:", survivor)
    return 0 if 10 * counts["killed"] >= 9 * judged else 1


def interrupted(*_):
    raise KeyboardInterrupt


if __name__ == "__main__":
    for number in (signal.SIGINT, signal.SIGTERM):  # the first is ignored by what a shell starts in the background
        signal.signal(number, interrupted)
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
