"""trocar.detect against known tetrahedra, exact pairs of files, and the program's own answers."""

import os
import tempfile
import unittest

import numpy as np
import trocar
from support import Case, data, json_of, source

FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
# The tetrahedra of docs/LIBRARY.md: the tip of the second dips into the first.
FIRST = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
SECOND = np.array([[0.2, 0.2, 1.4], [0.2, 1.2, 1.4], [1.2, 0.2, 1.4], [0.2, 0.2, 0.4]])


def write_meshes(folder, *names):
    files = []
    for name, points in zip(names, (FIRST, SECOND)):
        files.append(os.path.join(folder, name))
        with open(files[-1], "w") as file:
            file.writelines("v {} {} {}\n".format(*point) for point in points)
            file.writelines("f {} {} {}\n".format(*face) for face in FACES + 1)
    return files


class Tetrahedra(Case):
    def test_pairs_are_those_of_the_library_page(self):
        for detector in ("ohc", "ohc_clustered", "brute_force"):
            found = trocar.detect(FIRST, FACES, SECOND, FACES, detector=detector, truth=True)
            self.assertEqual(found.outcome, "ok")
            # Numbers of the topology there, of each mesh here: 5, 6, 7 less 4.
            self.assertEqual(found.pairs.tolist(), [[3, 1], [3, 2], [3, 3]])
            self.assertEqual(found.touches.tolist(), [False] * 3)
            self.assertEqual((found.false_negatives, found.false_positives), (0, 0))
            self.assertEqual(sorted(found.counters), ["box_tests", "cells_visited", "triangle_tests", "vertices_read"])
            self.assertGreaterEqual(found.counters["triangle_tests"], 3)

    def test_a_tip_that_rests_on_a_face_touches(self):
        # Moved up so that the tip lies in the plane x + y + z = 1, in dyadic numbers.
        resting = np.array([[0.25, 0.25, 1.5], [0.25, 1.25, 1.5], [1.25, 0.25, 1.5], [0.25, 0.25, 0.5]])
        found = trocar.detect(FIRST, FACES, resting, FACES)
        self.assertEqual(found.pairs.tolist(), [[3, 1], [3, 2], [3, 3]])
        self.assertTrue(found.touches.all())

    def test_apart_there_is_no_pair(self):
        found = trocar.detect(FIRST, FACES, SECOND + 5.0, FACES)
        self.assertEqual((found.pairs.shape, found.touches.shape), ((0, 2), (0,)))
        self.assertIsNone(found.false_negatives)

    def test_views_copy_nothing_and_outlive_the_answer(self):
        found = trocar.detect(FIRST, FACES, SECOND, FACES)
        pairs = found.pairs
        self.assertEqual(pairs.ctypes.data, found.pairs.ctypes.data)
        self.assertFalse(pairs.flags.writeable)
        del found
        self.assertEqual(pairs.tolist(), [[3, 1], [3, 2], [3, 3]])

    def test_types_and_layouts_are_converted(self):
        expected = trocar.detect(FIRST, FACES, SECOND, FACES).pairs.tolist()
        wide = np.zeros((8, 6))
        wide[::2, ::2] = SECOND
        for second in (SECOND.astype(np.longdouble), np.asfortranarray(SECOND), wide[::2, ::2], SECOND.tolist(),
                       SECOND.astype(">f8")):
            for faces in (FACES.astype(np.int32), FACES.astype(np.uint8), np.asfortranarray(FACES), FACES.tolist()):
                self.assertEqual(trocar.detect(FIRST, FACES, second, faces).pairs.tolist(), expected)


class Programs(Case):
    def test_files_have_the_answer_of_the_program(self):
        with tempfile.TemporaryDirectory() as folder:
            files = write_meshes(folder, "a.obj", "b.obj")
            expected = json_of("detect", *files, "--truth")["detectors"][0]
            found = trocar.detect(*files, detector="ohc", truth=True)
            self.assertEqual(found.pairs.tolist(), expected["pairs"])
            self.assertEqual(np.flatnonzero(found.touches).tolist(), expected["touch"])
            self.assertEqual(found.false_negatives, expected["false_negatives"])

    def test_a_scene_is_its_first_frame(self):
        found = trocar.detect("i2t_deep_start", truth=True)
        # The exact oracle, by numbers of each body.
        explained = json_of("explain", "i2t_deep_start", "--tick", "0")["truth"]["pairs"]
        simulation = trocar.Simulation("i2t_deep_start")
        first = {body["name"]: body["triangles"].start for body in simulation.topology.bodies}
        expected = [[first[body] + triangle for body, triangle in zip(pair["bodies"], pair["triangles"])]
                    for pair in explained]
        self.assertEqual(found.pairs.tolist(), sorted(expected))
        self.assertEqual((found.false_negatives, found.false_positives), (0, 0))

    def test_exact_pairs_of_the_data(self):
        folder = os.path.join(data or "", "tritri")
        if not data or not os.path.isdir(folder):
            self.skipTest("no data: tritri")
        import glob
        checked = 0
        for name in sorted(glob.glob(os.path.join(folder, "*.txt"))):
            a, b, truth = [], [], []
            with open(name) as file:
                for line in file:
                    words = line.split("#")[0].split()
                    if len(words) < 19:
                        continue
                    numbers = np.array(words[:18], dtype=float).reshape(2, 3, 3)
                    a.append(numbers[0])
                    b.append(numbers[1])
                    truth.append(int(words[18]) != 0)
            if truth:
                answer = trocar.triangles_intersect(np.array(a), np.array(b))
                self.assertEqual(answer.tolist(), truth, name)
                checked += len(truth)
        if checked == 0:
            self.skipTest("no data: pairs with truth")


class BadInput(Case):
    def test_arrays(self):
        def call(first=FIRST, faces=FACES, **more):
            return lambda: trocar.detect(first, faces, SECOND, FACES, **more)
        self.refuses(call(FIRST.astype(complex)), "vertices_a", "float64", "complex128")
        self.refuses(call(FIRST.astype(str)), "vertices_a", "float64", "<U")
        self.refuses(call(FIRST.astype(object)), "vertices_a", "object")
        self.refuses(call(FIRST > 0), "vertices_a", "bool")
        self.refuses(call(FIRST[:, :2]), "vertices_a", "(n, 3)", "(4, 2)")
        self.refuses(call(FIRST.ravel()), "vertices_a", "(12,)")
        self.refuses(call(None), "vertices_a", "shape ()")
        self.refuses(call({}), "vertices_a", "shape ()")
        self.refuses(call([[1, 2, 3], [4, 5]]), "vertices_a")
        self.refuses(call(faces=FACES.astype(float)), "faces_a", "integers", "float64")
        self.refuses(call(faces=FACES[:, :2]), "faces_a", "(4, 2)")
        self.refuses(call(faces=FACES + 1), "faces_a", "row 1", "below 4", "got 4")
        self.refuses(call(faces=-FACES), "faces_a", "got -")
        self.refuses(call(faces=np.array([[0, 1, 2**63]], dtype=np.uint64)), "faces_a", "row 0")
        for bad in (np.nan, np.inf, -np.inf):
            points = FIRST.copy()
            points[2, 1] = bad
            self.refuses(call(points), "vertices_a", "row 2", "finite")
        self.refuses(call(detector="ohx"), "detector", "'ohx'")
        self.refuses(call(detector="ohc:cells=9"), "ohc")
        self.refuses(lambda: trocar.detect(FIRST, FACES), "four arrays")
        self.refuses(lambda: trocar.detect(FIRST, FACES, SECOND), "four arrays")
        self.refuses(lambda: trocar.detect("a.obj", FACES, SECOND, FACES), "vertices_a", "shape ()")
        self.refuses(lambda: trocar.detect("a.obj", FACES), "four arrays", "str, ndarray")

    def test_files(self):
        self.refuses(lambda: trocar.detect("no_such.obj", "no_such.stl"), "no_such.obj")
        self.refuses(lambda: trocar.detect("no_such_scene"), "no_such_scene")
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "half.obj")
            with open(file, "w") as text:
                text.write("v 0 0 0\nf 1 2 3\n")
            with self.assertRaises(trocar.InputError) as caught:
                trocar.detect(file, file)
            import subprocess
            from support import program
            done = subprocess.run([program, "detect", file, file], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2)
            self.assertEqual(done.stderr, f"trocar: {caught.exception}\n")

    def test_is_a_value_error(self):
        self.assertTrue(issubclass(trocar.InputError, ValueError))


class OneDetector(Case):
    def test_calls_one_at_a_time_agree_with_the_simulation(self):
        simulation = trocar.Simulation("i2t_deep_start", response="none", contacts="intersection")
        simulation.step()
        detector = trocar.make_detector("brute_force")
        frame = trocar.Frame(simulation.detected_positions)
        detector.prepare(simulation.topology, frame)
        detector.update(frame)
        pairs, near = detector.detect(frame)
        self.assertGreater(len(pairs), 0)
        self.assertEqual(pairs.tolist(), simulation.pairs.tolist())
        self.assertEqual(near.shape, (0, 2))

    def test_order_and_sizes_are_checked(self):
        detector = trocar.make_detector("ohc")
        topology = trocar.Simulation("i2t_deep_start").topology
        frame = trocar.Frame(np.zeros((3, 3)))
        self.refuses(lambda: detector.update(frame), "prepare")
        self.refuses(lambda: detector.prepare(topology, frame), "vertices")
        self.refuses(lambda: trocar.Frame(np.zeros((3, 3)), previous=np.zeros((2, 3))), "previous")


if __name__ == "__main__":
    unittest.main()
