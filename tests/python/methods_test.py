"""Methods written in Python: what they answer, how they fail, a study with one, and the contract tests."""

import os
import subprocess
import sys
import tempfile
import unittest

import leaky
import numpy as np
import trocar
import trocar.examples
from support import Case, python


class Detectors(Case):
    def test_the_example_is_exact(self):
        found = trocar.detect("i2t_deep_start", detector=trocar.examples.Boxes, truth=True)
        self.assertEqual((found.outcome, found.message), ("ok", ""))
        self.assertGreater(len(found.pairs), 10)
        self.assertEqual((found.false_negatives, found.false_positives), (0, 0))

    def test_a_run_with_it_is_the_run_with_another_exact_one(self):
        mine = trocar.run("i2t_stab", detector=trocar.examples.Boxes, response="penalty", contacts="intersection",
                          ticks=400)
        other = trocar.run("i2t_stab", detector="brute_force", response="penalty", contacts="intersection", ticks=400)
        self.assertEqual(mine.outcome, "ok")
        self.assertGreater(max(mine.columns["pairs"]), 0)
        self.assertEqual(mine.state_hash, other.state_hash)
        self.assertEqual(mine.columns["false_negatives"].tolist(), [0] * 400)

    def test_lost_pairs_are_counted(self):
        exact = trocar.detect("i2t_deep_start", detector="brute_force").pairs
        lost = sum((7919 * a + 104729 * b) % 10007 % 3 == 0 for a, b in exact.tolist())
        trocar.register_detector("leaky", leaky.Leaky)
        found = trocar.detect("i2t_deep_start", detector="leaky:one_of=3", truth=True)
        self.assertGreater(lost, 0)
        self.assertEqual(found.false_negatives, lost)
        self.assertEqual(len(found.pairs), len(exact) - lost)

    def test_failures_are_outcomes_with_the_line(self):
        for cls, expected in ((leaky.Raises, ("ValueError: no answer today", "leaky.py, line ")),
                              (leaky.WrongNumbers, ("pairs: row 0", "got 1000000"))):
            found = trocar.detect("i2t_deep_start", detector=cls)
            self.assertEqual(found.outcome, "threw")
            self.assertEqual(len(found.pairs), 0)
            for part in expected:
                self.assertIn(part, found.message)
        result = trocar.run("i2t_stab", detector=leaky.Raises, contacts="intersection", response="penalty", ticks=3)
        self.assertEqual(result.outcome, "threw")
        self.assertIn("no answer today", result.message)

    def test_no_query_distance_is_unsupported(self):
        result = trocar.run("i2t_stab", detector=trocar.examples.Boxes, ticks=3)
        self.assertEqual(result.outcome, "unsupported")

    def test_an_interruption_within_ends_the_run(self):
        class Interrupts(trocar.Detector):
            def detect(self, frame):
                raise KeyboardInterrupt
        with self.assertRaises(KeyboardInterrupt):
            trocar.run("i2t_stab", detector=Interrupts, contacts="intersection", response="penalty", ticks=100)

    def test_names_and_classes_are_checked(self):
        self.refuses(lambda: trocar.register_detector("ohc", leaky.Leaky), "ohc")
        self.refuses(lambda: trocar.register_detector("Leaky", leaky.Leaky), "lower-case")
        self.refuses(lambda: trocar.register_detector("a,b", leaky.Leaky), "lower-case")
        self.refuses(lambda: trocar.register_detector("one", leaky.Leaky(2)), "class")
        self.refuses(lambda: trocar.register_detector("one", leaky.WrongType), "method detect")
        self.refuses(lambda: trocar.register_response("one", leaky.Leaky), "method respond")

        class Odd(trocar.Detector):
            parameters = {"k": 3}

            def detect(self, frame):
                return []
        self.refuses(lambda: trocar.register_detector("odd", Odd), "odd", "attributes")
        self.refuses(lambda: trocar.detect("i2t_deep_start", detector="odd"), "odd")

        class NoBase:
            def __init__(self):
                pass

            def prepare(self, topology, frame):
                pass

            def update(self, frame, query_distance):
                pass

            def detect(self, frame):
                return []
        self.assertEqual(trocar.detect("i2t_deep_start", detector=NoBase).outcome, "ok")

    def test_a_detector_and_a_response_may_share_a_name(self):
        trocar.register_detector("shared", trocar.examples.Boxes)
        trocar.register_response("shared", trocar.examples.Springs)
        result = trocar.run("i2t_deep_start", detector="shared", response="none", contacts="intersection", ticks=3)
        self.assertEqual(result.outcome, "ok")
        result = trocar.run("i2t_deep_start", response="shared:k=2000", ticks=3)
        self.assertEqual((result.outcome, result.facts["spec"]["response"]), ("ok", "shared:k=2000"))
        self.refuses(lambda: trocar.run("i2t_deep_start", response="shared:kk=1"), "kk")

    def test_the_same_name_again_replaces_the_class(self):
        class Again(trocar.Detector):
            def detect(self, frame):
                return []
        trocar.register_detector("again", Again)
        self.assertEqual(len(trocar.detect("i2t_deep_start", detector="again").pairs), 0)
        trocar.register_detector("again", trocar.examples.Boxes)
        self.assertGreater(len(trocar.detect("i2t_deep_start", detector="again").pairs), 0)


def middle_of(mass, frame):
    """The vertex of i2t_stab's sheet that is nearest its middle; the rim is pinned."""
    return int(np.argmin(np.where(mass > 0, np.linalg.norm(frame.positions, axis=1), np.inf)))


class Responses(Case):
    def test_the_example_holds_like_its_copy_in_the_program(self):
        # penalty is another law from the same contacts: no equality, but neither gives way.
        result = trocar.run("i2t_stab", response=trocar.examples.Springs, ticks=500)
        self.assertEqual((result.outcome, result.message), ("ok", ""))
        none = trocar.run("i2t_stab", response="none", ticks=500)
        self.assertGreater(np.abs(result.columns["tool_force_z"]).max(), 0.0)
        self.assertLess(result.summary["residual_penetration_max_m"], none.summary["residual_penetration_max_m"])

    def test_impulses_of_a_python_solver_are_those_of_the_program(self):
        # Projected Gauss-Seidel over the same contacts, written twice; converged, since their orders differ.
        trocar.register_response("impulses", trocar.examples.Impulses)
        for scene, ticks in (("i2t_drag", 200), ("r2t_bone", 250)):
            mine = trocar.run(scene, response="impulses:sweeps=1000", ticks=ticks)
            other = trocar.run(scene, response="impulse:e=0,bias=0.2,sweeps=1000,reduction=pair",
                               contacts="tracked_proximity", ticks=ticks)
            self.assertEqual((mine.outcome, mine.message), ("ok", ""))
            self.assertGreater(np.abs(other.columns["tool_force_z"]).max(), 0.05)
            for column, unit in (("residual_penetration", 1e-12), ("tool_force_z", 1e-8)):
                np.testing.assert_allclose(mine.columns[column], other.columns[column], rtol=0, atol=unit)

    def test_forces_and_places_of_an_output_arrive(self):
        class Pushes(trocar.Response):
            def prepare(self, topology, materials):
                self.mass = materials.mass.copy()

            def respond(self, frame, dt, contacts, contact_forces):
                self.vertex = middle_of(self.mass, frame)
                answer = {"held_force": np.zeros_like(frame.positions)}
                answer["held_force"][self.vertex, 2] = 1e-3
                if frame.tick == 3:
                    moved = np.zeros(1, trocar.POSITION_CORRECTION)
                    moved["vertex"], moved["held"] = self.vertex, True
                    moved["position"] = frame.positions[self.vertex] + [0.0, 0.0, 0.002]
                    answer["position_corrections"] = moved
                    placed.append((self.vertex, moved["position"][0]))
                return answer
        placed = []
        trocar.register_response("pushes", Pushes)
        pushed, rest = trocar.Simulation("i2t_stab", response="pushes"), trocar.Simulation("i2t_stab", response="none")
        for tick in range(5):
            pushed.step()
            rest.step()
            self.assertEqual((pushed.outcome, pushed.message), ("ok", ""))
            if tick == 1:
                moved = pushed.positions - rest.positions
            if placed:
                break
        (vertex, place), = placed
        self.assertEqual(np.argmax(np.abs(moved).sum(axis=1)), vertex)
        self.assertGreater(moved[vertex, 2], 0.0)
        np.testing.assert_allclose(pushed.positions[vertex], place, atol=1e-12)

    def test_the_wrench_of_a_response_is_felt(self):
        class Wrench(trocar.Response):
            parameters = {"moment": (0.0, "N m", "about x")}

            def __init__(self, moment):
                self.moment = moment

            def respond(self, frame, dt, contacts, contact_forces):
                return {"wrench": [[0.0, 0.0, 0.25, self.moment, 0.0, 0.0]] * 2}
        mine = trocar.run("i2t_stab", response=Wrench, ticks=3)
        self.assertEqual((mine.outcome, mine.message), ("ok", ""))
        np.testing.assert_allclose(mine.columns["tool_force_z"], 0.25)
        turned = trocar.run("i2t_stab", response="wrench:moment=0.1", ticks=3)
        np.testing.assert_allclose(turned.columns["tool_force_z"], 0.25)
        self.assertNotEqual(turned.state_hash + str(turned.columns["tip_force_y"]),
                            mine.state_hash + str(mine.columns["tip_force_y"]))

    def test_timings_are_those_of_their_words(self):
        asked = []

        class Timed(trocar.examples.Impulses):
            def respond(self, frame, dt, contacts, contact_forces):
                asked.append([])
                return {"contacts": super().respond(frame, dt, contacts, contact_forces), "solver_timing": timing}

            def solve(self, step):
                asked[-1].append(step.time)
                super().solve(step)
        for timing in ("substep", "held"):
            asked.clear()
            self.assertEqual(trocar.run("i2t_drag", response=Timed, ticks=160).outcome, "ok")
            times = [one for one in asked if one]
            self.assertGreater(len(times), 3)
            for one in times:
                self.assertAlmostEqual(sum(one), 0.001, delta=1e-12)
            self.assertEqual({len(one) == 1 for one in times}, {timing == "held"})

        class Laws(trocar.examples.Springs):
            def respond(self, frame, dt, contacts, contact_forces):
                laws = super().respond(frame, dt, contacts, contact_forces)
                laws["k"] *= 0.02  # so soft that explicit contact forces are stable
                laws["mu"] *= 0.02
                return {"contacts": laws, "contact_timing": timing} if timing else laws
        states = []
        for timing in ("implicit", "at_tick_start", "at_substep_start", None):
            run = trocar.run("i2t_drag", response=Laws, ticks=160)
            self.assertEqual((run.outcome, run.message), ("ok", ""))
            states.append(run.state_hash)
        self.assertEqual(len(set(states)), 3)
        self.assertEqual(states[0], states[3])

    def test_a_step_ends_with_its_call(self):
        kept = []

        class Keeps(trocar.examples.Impulses):
            def solve(self, step):
                kept.append(step)
                with_contact = len(step.contacts)
                for call, part in ((lambda: step.push(with_contact, [0, 0, 1]), "below"),
                                   (lambda: step.push(0, [0, 1]), "(3,)"), (lambda: step.rate(-1), "from 0")):
                    try:
                        call()
                    except trocar.InputError as error:
                        assert part in str(error), error
                    else:
                        raise AssertionError(part)
                assert step.velocities.shape == (len(step.inverse_masses), 3)
                before = step.rate(0)
                normal = step.contacts["normal"][0]
                step.push(0, 1e-9 * normal)
                assert abs(step.rate(0) - before - 1e-9 * step.contacts["mobility"][0]) < 1e-12
                depth = step.depth_after(0)
                step.shift(0, 1e-9 * normal)
                assert abs(depth - step.depth_after(0) - 1e-9 * step.contacts["mobility"][0]) < 1e-12
                assert abs(step.velocity(0) @ normal - step.rate(0)) < 1e-12
        result = trocar.run("i2t_stab", response=Keeps, ticks=120)
        self.assertEqual((result.outcome, result.message), ("ok", ""))
        self.assertGreater(len(kept), 0)
        self.refuses(lambda: kept[0].time, "within the call of solve")

    def test_what_is_wrong_is_an_outcome(self):
        class Answers(trocar.Response):
            answer = None

            def respond(self, frame, dt, contacts, contact_forces):
                return self.answer

        class NoSolver(trocar.Response):
            def prepare(self, topology, materials):
                self.mass = materials.mass.copy()

            def respond(self, frame, dt, contacts, contact_forces):
                laws = trocar.force_laws(1)
                vertex = middle_of(self.mass, frame)
                laws["role"], laws["vertices"], laws["weights"] = 4, [[vertex, -1, -1]], [[1, 0, 0]]
                laws["normal"], laws["gap"] = [0, 0, 1], -0.001
                return laws
        result = trocar.run("i2t_stab", response=NoSolver, ticks=3)
        self.assertEqual(result.outcome, "threw")
        self.assertIn("NotImplementedError", result.message)
        for answer, part in (({"held_force": np.zeros((2, 3))}, "held_force"), ({"wrench": np.zeros((1, 5))}, "wrench"),
                             ({"contact_timing": "now"}, "contact_timing"), ({"laws": 3}, "laws"),
                             ({"position_corrections": [3]}, "POSITION_CORRECTION"),
                             ({"solver_timing": 3}, "solver_timing"), ({"contacts": 3}, "FORCE_LAW")):
            Answers.answer = answer
            result = trocar.run("i2t_stab", response=Answers, ticks=3)
            self.assertEqual(result.outcome, "threw", answer)
            self.assertIn(part, result.message)
        for cls, part in ((leaky.WrongType, "FORCE_LAW"), (leaky.WrongRole, "role")):
            result = trocar.run("i2t_stab", response=cls, ticks=3)
            self.assertEqual(result.outcome, "threw")
            self.assertIn(part, result.message)
        self.refuses(lambda: trocar.force_laws(-1), "count")


class Study(Case):
    study = {"name": "with_python", "time_limit_s": 100, "reference": "brute_force",
             "experiments": [{"frames": "replay", "scenes": ["i2t_deep_start", "i2i_cross"],
                              "detectors": ["brute_force", leaky.Leaky]}]}

    def test_a_leaky_detector_is_found_out(self):
        with tempfile.TemporaryDirectory() as folder:
            report = trocar.study(self.study, os.path.join(folder, "report"))
            results = report.results.set_index(["detector", "scene"])
            self.assertEqual(set(results["outcome"]), {"ok"})
            for scene in ("i2t_deep_start", "i2i_cross"):
                exact, lost = results.loc["brute_force", scene], results.loc["leaky", scene]
                self.assertEqual(exact["false_negatives"], 0)
                if scene == "i2i_cross":  # of many pairs about one of a hundred
                    self.assertLess(abs(lost["false_negatives"] / lost["true_pairs"] - 0.01), 0.005)
                self.assertEqual(lost["false_positives"], 0)
                self.assertEqual(exact["frames_hash"], lost["frames_hash"])
            units = report.results.attrs["units"]
            self.assertEqual((units["false_negatives"], units["detect_median_ns"]), ("1", "ns"))
            ticks = report.ticks
            self.assertEqual(ticks.attrs["units"]["depth_error"], "m")
            of_leaky = ticks[(ticks["detector"] == "leaky") & (ticks["scene"] == "i2i_cross")]
            self.assertEqual(of_leaky["false_negatives"].sum(), results.loc["leaky", "i2i_cross"]["false_negatives"])
            with open(os.path.join(folder, "report", "report.md")) as text:
                self.assertIn("leaky", text.read())

    def test_an_edited_class_is_run_again(self):
        with tempfile.TemporaryDirectory() as folder:
            module = os.path.join(folder, "edited.py")
            study = {**self.study, "experiments": [{"frames": "replay", "scenes": ["i2t_deep_start"],
                                                    "detectors": [{"method": "edited"}]}], "reference": "edited"}
            made = []
            for answer in ("[]", "[]", "[[0, 1]][:0]"):
                with open(module, "w") as file:
                    file.write(f"import trocar\nclass Edited(trocar.Detector):\n"
                               f"    def detect(self, frame):\n        return {answer}\n")
                file = os.path.join(folder, "study.json")
                import json
                with open(file, "w") as text:
                    json.dump({"format": "trocar-study-3", **study}, text)
                done = python("-m", "trocar", "--method", "edited=edited:Edited", "study", file, "--output",
                              os.path.join(folder, "out"), "--json", cwd=folder)
                self.assertEqual(done.returncode, 0, done.stderr)
                made.append(json.loads(done.stdout)["made"])
            self.assertEqual(made, [1, 0, 1])

    def test_bad_studies_are_one_line_and_leave_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            output = os.path.join(folder, "a", "b")
            self.refuses(lambda: trocar.study({**self.study, "experiments": 3}, output), "experiments")
            self.refuses(lambda: trocar.study({**self.study, "no_such_key": 3}, output), "no_such_key")
            self.refuses(lambda: trocar.study({"experiments": [{1, 2}]}, output), "JSON")
            self.refuses(lambda: trocar.study("no_such_study", output), "no_such_study")
            self.assertEqual(os.listdir(folder), [])
            self.refuses(lambda: trocar.read_report(folder), "results.csv")
            with open(os.path.join(folder, "results.csv"), "w"):
                pass
            self.refuses(lambda: trocar.read_report(folder), "results.csv", "table")

    main = ("import sys\nimport trocar\nimport numpy as np\n"
            "def kept(pairs):\n    return pairs[(pairs[:, 0] + pairs[:, 1]) % 3 != 0]\n"
            "class Local(trocar.Detector):\n"
            "    def prepare(self, topology, frame):\n"
            "        self.exact = trocar.make_detector('brute_force')\n"
            "        self.exact.prepare(topology, frame)\n"
            "    def update(self, frame, query_distance):\n        self.exact.update(frame, query_distance)\n"
            "    def detect(self, frame):\n        return kept(self.exact.detect(frame)[0])\n"
            "class Nothing(trocar.Response):\n"
            "    contact_generators = ('intersection',)\n"
            "    def respond(self, frame, dt, contacts, forces):\n        return trocar.force_laws(0)\n"
            "trocar.register_response('local', Nothing)\n"
            "study = {'name': 'x', 'time_limit_s': 100, 'reference': 'brute_force', 'experiments': [{'frames': 'replay',"
            " 'scenes': ['i2t_deep_start'], 'detectors': ['brute_force', Local]},"
            " {'frames': 'closed_loop', 'scenes': ['i2t_deep_start'], 'detectors': ['brute_force'], 'responses': ['local'],"
            " 'contacts': ['intersection'], 'ticks': 3}]}\n")

    def test_a_class_of_main_joins_a_study(self):
        self.needs_cloudpickle()
        code = self.main + ("results = trocar.study(study, 'out').results.set_index('detector')\n"
                            "assert set(results['outcome']) == {'ok'} and 'local' in set(results['response'])\n"
                            "lost = results.loc['local', 'false_negatives'] / results.loc['local', 'true_pairs']\n"
                            "assert 0.05 < lost < 0.5, lost\n")
        with tempfile.TemporaryDirectory() as folder:
            times = []
            for text in (code, code, code.replace("% 3 != 0", "% 3 != 1")):
                done = python("-c", text, cwd=folder)
                self.assertEqual(done.returncode, 0, done.stderr)
                runs = os.path.join(folder, "out", "runs")
                times.append({file.name: file.stat().st_mtime_ns for binary in os.scandir(runs)
                              for file in os.scandir(binary.path)})
            self.assertEqual(times[0], times[1], "another process finds the runs")
            self.assertEqual(times[1].keys(), times[2].keys())
            self.assertFalse(set(times[1].values()) & set(times[2].values()), "another helper is another version")

    def test_a_class_that_cannot_be_copied_is_refused(self):
        self.needs_cloudpickle()
        code = self.main + ("Local.open = open('open.txt', 'w')\nLocal.lock = __import__('threading').Lock()\n"
                            "try:\n    trocar.study(study, 'never')\n"
                            "except trocar.InputError as error:\n    print(error)\n")
        with tempfile.TemporaryDirectory() as folder:
            done = python("-c", code, cwd=folder)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("method local: expected a class that can be copied", done.stdout)
            self.assertIn("__main__.Local", done.stdout)
            self.assertEqual(done.stdout.count("\n"), 1)
            self.assertEqual(os.listdir(folder), ["open.txt"])

    def test_without_cloudpickle_the_line_names_it(self):
        code = self.main + ("sys.modules['cloudpickle'] = None\n"
                            "try:\n    trocar.study(study, 'never')\n"
                            "except trocar.InputError as error:\n    print(error)\n")
        with tempfile.TemporaryDirectory() as folder:
            done = python("-c", code, cwd=folder)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("python3-cloudpickle", done.stdout)
            self.assertEqual(os.listdir(folder), [])

    def needs_cloudpickle(self):
        try:
            import cloudpickle  # noqa: F401
        except ImportError:
            self.skipTest("python3-cloudpickle is not installed")

    def test_methods_on_the_command_line_are_checked(self):
        for words in (("--method",), ("--method", "x"), ("--method", "x=no_such_module:X"),
                      ("--method", "x=leaky:NoSuchClass"), ("--method", "ohc=leaky:Leaky")):
            done = python("-m", "trocar", *words)
            self.assertEqual(done.returncode, 2, words)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        done = python("-m", "trocar", "--method=leaky=leaky:Leaky", "list")
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stdout, "\n  leaky +Python slow prototype, source [0-9a-f]{12}\n")


class Contract(Case):
    def contract(self, *words):
        done = subprocess.run([sys.executable, "-m", "trocar.contract", *words], capture_output=True, text=True,
                              env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}, timeout=280)
        if "a build without it" in done.stderr:
            self.skipTest("no contract tests in this build")
        return done

    def test_the_example_detector_passes(self):
        done = self.contract("--method", "boxes=trocar.examples:Boxes")
        self.assertEqual(done.returncode, 0, done.stdout[-3000:] + done.stderr[-1000:])
        self.assertRegex(done.stdout, r"\[  PASSED  \] [1-9][0-9]+ tests")

    def test_the_example_responses_pass(self):
        for method in ("springs=trocar.examples:Springs", "impulses=trocar.examples:Impulses"):
            done = self.contract("--method", method)
            self.assertEqual(done.returncode, 0, done.stdout[-3000:] + done.stderr[-1000:])
            self.assertRegex(done.stdout, r"\[  PASSED  \] [1-9][0-9]* tests")

    def test_a_leaky_detector_fails(self):
        done = self.contract("--method", "leaky=leaky:Leaky", "--gtest_filter=*leaky_SamePairsAsTheOracle")
        self.assertEqual(done.returncode, 1, done.stdout[-3000:])
        self.assertIn("pairs missing", done.stdout)


if __name__ == "__main__":
    unittest.main()
