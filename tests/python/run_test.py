"""trocar.run and trocar.Simulation: against the program, views by address, the interpreter's lock, interruption."""

import os
import signal
import threading
import time
import unittest

import numpy as np
import trocar
from support import Case, json_of, python


class Run(Case):
    def test_methods_cannot_join_during_a_run(self):
        from leaky import Leaky
        thread = threading.Thread(target=trocar.run, args=("t2t_press",), kwargs={"ticks": 300})
        thread.start()
        refused = 0
        while thread.is_alive() and not refused:
            try:
                trocar.register_detector(f"late_{time.monotonic_ns()}", Leaky)
            except trocar.InputError as error:
                refused += "under way" in str(error)
        thread.join()
        self.assertEqual(refused, 1)
        trocar.register_detector("late", Leaky)

    def test_is_the_run_of_the_program(self):
        expected = json_of("run", "i2t_stab", "--ticks", "120", "--response", "penalty", "--detector", "ohc")
        result = trocar.run("i2t_stab", ticks=120, response="penalty", detector="ohc")
        self.assertEqual(result.outcome, "ok")
        self.assertEqual(result.state_hash, expected["summary"]["state_hash"])
        self.assertEqual(len(result.columns["tick"]), 120)
        compared = 0
        for name, values in result.columns.items():
            if name not in expected["rows"][0] or name == "query_distance":
                continue
            for mine, row in zip(values.tolist(), expected["rows"]):
                compared += 1
                self.assertEqual(mine, -1 if row[name] is None else row[name], name)
        self.assertGreater(compared, 500)
        for axis, name in enumerate(("x", "y", "z")):
            self.assertEqual(result.columns[f"device_force_{name}"].tolist(),
                             [row["device_force"][axis] for row in expected["rows"]])
        for name, value in expected["summary"].items():
            if name != "state_hash" and not name.endswith("_ns") and value is not None and name in result.summary \
                    and not any(word in name for word in ("alloc", "memory", "burst", "deadline", "rss")):
                self.assertEqual(result.summary[name], value, name)

    def test_the_data_frame_has_units_and_unknown_counts(self):
        result = trocar.run("i2t_stab", ticks=30, truth_stride=10)
        frame = result.frame()
        units = frame.attrs["units"]
        self.assertEqual(set(units), set(frame.columns))
        self.assertEqual((units["residual_penetration"], units["detect_ns"], units["pairs"]), ("m", "ns", "1"))
        judged = frame["true_pairs"].notna()
        self.assertEqual(frame["tick"][judged].tolist(), [0, 10, 20, 29])
        self.assertEqual(frame["residual_penetration"].notna().tolist(), judged.tolist())
        self.assertEqual((result.columns["true_pairs"] == -1).tolist(), (~judged).tolist())
        self.assertEqual(frame["time"].tolist(), [tick * 0.001 for tick in range(30)])
        self.assertEqual(set(frame["outcome"]), {"ok"})

    def test_columns_are_views(self):
        result = trocar.run("i2t_stab", ticks=3)
        self.assertTrue(np.shares_memory(result.columns["pairs"], result._record.columns()["pairs"]))
        self.assertFalse(result.columns["pairs"].flags.writeable)
        kept = result.columns["time"]
        del result
        self.assertEqual(kept.tolist(), [0.0, 0.001, 0.002])

    def test_a_failed_method_is_an_outcome(self):
        result = trocar.run("i2t_stab", ticks=5, detector="ode_trimesh", response="unilateral")
        self.assertEqual(result.outcome, "unsupported")
        self.assertIn("ode_trimesh", result.message)
        self.assertEqual(len(result.columns["tick"]), 0)
        self.assertEqual(result.frame().shape[0], 0)

    def test_bad_input(self):
        self.refuses(lambda: trocar.run("no_such"), "no_such")
        self.refuses(lambda: trocar.run("i2t_stab", ticks=0), "--ticks")
        self.refuses(lambda: trocar.run("i2t_stab", response="penalty:kk=1"), "kk")
        self.refuses(lambda: trocar.run("i2t_stab", stepper="explicit"), "stepper")
        self.refuses(lambda: trocar.run("i2t_stab", contacts="tracked"), "tracked")
        self.refuses(lambda: trocar.run("i2t_stab", truth_stride=-1), "truth_stride")
        self.refuses(lambda: trocar.Simulation("i2t_stab", detector="ode_trimesh"), "ode_trimesh")


class Simulation(Case):
    def test_steps_are_those_of_a_run(self):
        result = trocar.run("i2t_stab", ticks=250)
        simulation = trocar.Simulation("i2t_stab")
        for tick in range(250):
            row = simulation.step()
            self.assertEqual(row["pairs"], result.columns["pairs"][tick])
            self.assertEqual(len(simulation.pairs), row["pairs"])
            self.assertEqual(len(simulation.contacts), row["contacts_offered"])
            force = [row[f"tool_force_{axis}"] for axis in "xyz"]
            self.assertEqual(force, [result.columns[f"tool_force_{axis}"][tick] for axis in "xyz"])
        self.assertGreater(max(result.columns["contacts_offered"]), 0)
        self.assertEqual(simulation.positions.tolist(), result.positions.tolist())
        self.assertEqual(dict(row)["tick"], 249)
        self.assertEqual(row["outcome"], "ok")
        with self.assertRaises(KeyError):
            row["no_such_column"]

    def test_views_copy_nothing(self):
        simulation = trocar.Simulation("i2t_deep_start", response="none", contacts="intersection")
        simulation.step()
        for name in ("positions", "velocities", "detected_positions", "pairs", "contacts"):
            first, second = getattr(simulation, name), getattr(simulation, name)
            self.assertGreater(len(first), 0)
            self.assertEqual(first.ctypes.data, second.ctypes.data, name)
            self.assertFalse(first.flags.owndata or first.flags.writeable, name)
            with self.assertRaises(ValueError):
                first[0] = second[0]
        # The frames take turns: no memory is new.
        addresses = set()
        for _ in range(12):
            simulation.step()
            addresses.add(simulation.positions.ctypes.data)
        self.assertLessEqual(len(addresses), 3)

    def test_views_keep_their_memory(self):
        simulation = trocar.Simulation("i2t_deep_start", response="none", contacts="intersection")
        simulation.step()
        pairs, contacts, positions = simulation.pairs, simulation.contacts, simulation.positions
        kept = pairs.copy(), contacts["depth"].copy()
        for _ in range(20):
            simulation.step()
        # Nothing was written there: the simulation left the memory to the views.
        self.assertEqual(pairs.tolist(), kept[0].tolist())
        np.testing.assert_array_equal(contacts["depth"], kept[1])
        self.assertFalse(np.shares_memory(pairs, simulation.pairs))
        del simulation
        self.assertTrue(np.isfinite(positions).all())
        self.assertEqual(pairs.tolist(), kept[0].tolist())

    def test_contacts_have_their_members_by_name(self):
        simulation = trocar.Simulation("i2t_deep_start", response="none", contacts="intersection")
        simulation.step()
        contacts, pairs = simulation.contacts, simulation.pairs
        self.assertEqual(contacts.dtype, trocar.CONTACT)
        self.assertLessEqual(set(map(tuple, np.stack([contacts["a"], contacts["b"]], 1).tolist())),
                             set(map(tuple, pairs.tolist())))
        bodies = simulation.topology.body_of_triangle
        self.assertEqual(contacts["body_a"].tolist(), bodies[contacts["a"]].tolist())
        with_normal = np.isfinite(contacts["normal"]).all(axis=1)
        self.assertTrue(with_normal.any())
        np.testing.assert_allclose(np.linalg.norm(contacts["normal"][with_normal], axis=1), 1.0, atol=1e-12)
        tissue = next(body["vertices"] for body in simulation.topology.bodies if body["kind"] == "tissue")
        corners = simulation.topology.triangles
        self.assertEqual(corners.shape[1], 3)
        self.assertLess(tissue.stop, len(simulation.positions) + 1)

    def test_the_lock_is_released_during_a_step(self):
        simulation = trocar.Simulation("t2t_press")
        counted, stop = [0], threading.Event()

        def count():
            while not stop.is_set():
                counted[0] += 1
        simulation.step()
        thread = threading.Thread(target=count)
        thread.start()
        try:
            # A call that keeps the lock lets nobody count between its begin and its end.
            grown = 0
            for _ in range(300):
                before = counted[0]
                simulation.step()
                grown += counted[0] > before
        finally:
            stop.set()
            thread.join()
        self.assertGreater(grown, 0)

    def test_a_subclass_that_forgets_its_base_is_refused(self):
        class Forgets(trocar.Simulation):
            def __init__(self):
                pass
        with self.assertRaises(TypeError):
            Forgets()

    def test_two_threads_cannot_step_at_once(self):
        simulation = trocar.Simulation("t2t_press")
        failures = []

        def step():
            for _ in range(200):
                try:
                    simulation.step()
                except RuntimeError as error:
                    failures.append(str(error))
        threads = [threading.Thread(target=step) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(simulation.outcome, "ok")
        self.assertEqual(simulation.ticks + len(failures), 400)


class Interruption(Case):
    def interrupted(self, seconds, call):
        timer = threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        started = time.monotonic()
        try:
            with self.assertRaises(KeyboardInterrupt):
                call()
        finally:
            timer.join()
        return time.monotonic() - started

    def test_ends_a_run(self):
        # Without an end by interruption this takes minutes.
        took = self.interrupted(0.3, lambda: trocar.run("t2t_press", ticks=1_000_000))
        self.assertLess(took, 60)
        self.assertEqual(trocar.run("i2t_stab", ticks=2).outcome, "ok")

    def test_ends_a_loop_of_steps(self):
        simulation = trocar.Simulation("i2t_stab")

        def loop():
            while True:
                simulation.step()
        self.interrupted(0.2, loop)

    def test_ends_the_program_in_python(self):
        import subprocess
        import sys
        child = subprocess.Popen([sys.executable, "-m", "trocar", "run", "t2t_press", "--ticks", "1000000"],
                                 env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}, stderr=subprocess.PIPE,
                                 stdout=subprocess.DEVNULL)
        held = 0
        while not held & 1 << (signal.SIGINT - 1):  # the run holds it
            with open(f"/proc/{child.pid}/status") as status:
                held = next(int(line.split()[1], 16) for line in status if line.startswith("SigBlk"))
            time.sleep(0.01)
        child.send_signal(signal.SIGINT)
        _, errors = child.communicate(timeout=100)
        self.assertEqual(child.returncode, 130, errors)
        self.assertIn(b"interrupted after", errors)


class Program(Case):
    def test_the_module_is_the_program(self):
        done = python("-m", "trocar", "--version")
        self.assertEqual((done.returncode, done.stdout.strip()), (0, trocar.__version__))
        done = python("-m", "trocar", "run", "no_such")
        self.assertEqual(done.returncode, 2)
        self.assertEqual(done.stderr.count("\n"), 1)


if __name__ == "__main__":
    unittest.main()
