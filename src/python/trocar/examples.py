"""A detector and two responses written in Python, to copy.

Boxes and Springs are baselines/example.cpp and example_response.cpp with NumPy.

    trocar.register_detector("boxes", trocar.examples.Boxes)
    python3 -m trocar.contract --method boxes=trocar.examples:Boxes --method springs=trocar.examples:Springs
"""

from __future__ import annotations

from typing import Any, Tuple

import numpy as np
import numpy.typing as npt

import trocar


class Boxes(trocar.Detector):
    """Triangle pairs whose boxes overlap, decided by the exact triangle test."""

    claims_exact = True

    def prepare(self, topology: trocar.Topology, frame: trocar.Frame) -> None:
        self.topology = topology

    def update(self, frame: trocar.Frame, query_distance: float) -> None:
        corners = frame.positions[self.topology.triangles]  # (T, 3, 3)
        self.corners, self.low, self.high = corners, corners.min(axis=1), corners.max(axis=1)

    def detect(self, frame: trocar.Frame) -> npt.NDArray[np.int64]:
        found = [np.empty((0, 2), dtype=np.int64)]
        bodies = self.topology.bodies
        for first, second in self.topology.body_pairs:
            a, b = bodies[first]["triangles"], bodies[second]["triangles"]
            overlap = np.ones((a.stop - a.start, b.stop - b.start), dtype=bool)
            for axis in range(3):
                overlap &= self.low[a, axis, None] <= self.high[None, b, axis]
                overlap &= self.low[None, b, axis] <= self.high[a, axis, None]
            pairs = np.argwhere(overlap) + (a.start, b.start)
            meet = trocar.triangles_intersect(self.corners[pairs[:, 0]], self.corners[pairs[:, 1]])
            found.append(pairs[meet])
        return np.concatenate(found)


class Springs(trocar.Response):
    """A spring and a damper for every contact, closed or open."""

    parameters = {"k": (1000.0, "N/m", "contact stiffness where the scene has none"),
                  "relaxation_time": (0.003, "s", "mu / k where k is not the scene's")}

    def __init__(self, k: float, relaxation_time: float) -> None:
        self.k, self.relaxation_time = k, relaxation_time

    def prepare(self, topology: trocar.Topology, materials: trocar.Materials) -> None:
        self.kind = np.array([body["kind"] for body in topology.bodies])
        count = len(self.kind)
        self.law_of_bodies = np.full((count, count), -1)
        self.law_of_bodies[tuple(topology.body_pairs.T)] = np.arange(len(topology.body_pairs))
        self.laws = materials.contact_laws.copy()  # (body pairs, 2): k, mu

    def respond(self, frame: trocar.Frame, dt: float, contacts: npt.NDArray[Any],
                contact_forces: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return self.laws_of(frame, contacts)[0]

    def laws_of(self, frame: trocar.Frame,
                contacts: npt.NDArray[Any]) -> Tuple[npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any]]:
        """Laws of the contacts with geometry, the kind of body that each pushes, and the other surface's velocity."""
        # What a generator could not determine is NaN.
        contacts = contacts[np.isfinite(contacts["gap"]) & np.isfinite(contacts["normal"]).all(axis=1)]
        laws = trocar.force_laws(len(contacts))
        # Bodies are sorted (instrument, rigid, tissue): b is the softer one and is pushed along the normal.
        kind_a, kind_b = self.kind[contacts["body_a"]], self.kind[contacts["body_b"]]
        push_b = kind_b != "rigid"

        def chosen(of_b: npt.NDArray[np.bool_]) -> Tuple[npt.NDArray[Any], npt.NDArray[Any]]:
            return tuple(np.where(of_b[:, None], contacts[f"{part}_on_b"], contacts[f"{part}_on_a"])
                         for part in ("vertices", "weights"))  # type: ignore[return-value]

        vertices, weights = chosen(push_b)
        others, other_weights = chosen(~push_b)
        normal = np.where(push_b[:, None], contacts["normal"], -contacts["normal"])
        point = (frame.positions[vertices] * weights[:, :, None]).sum(axis=1)
        laws["source_id"], laws["gap"] = contacts["id"], contacts["gap"]
        laws["vertices"], laws["weights"], laws["normal"] = vertices, weights, normal
        # Tissue takes the reaction with its vertices, a tool on the line of the force; bone needs nobody.
        on_tissue = push_b & (kind_a == "tissue")
        laws["reaction_vertices"][on_tissue] = others[on_tissue]
        laws["reaction_weights"][on_tissue] = other_weights[on_tissue]
        on_tool = push_b & (kind_a == "instrument")
        laws["reaction_body"][on_tool] = contacts["body_a"][on_tool]
        laws["reaction_point"][on_tool] = (point - contacts["gap"][:, None] * normal)[on_tool]
        of_scene = self.laws[self.law_of_bodies[contacts["body_a"], contacts["body_b"]]]
        laws["k"] = np.where(np.isnan(of_scene[:, 0]), self.k, of_scene[:, 0])
        laws["mu"] = np.where(np.isnan(of_scene[:, 1]), laws["k"] * self.relaxation_time, of_scene[:, 1])
        surface_velocity = (frame.velocities[others] * other_weights[:, :, None]).sum(axis=1)
        laws["face_velocity"] = (surface_velocity * normal).sum(axis=1)
        return laws, np.where(push_b, kind_b, kind_a), surface_velocity


class Impulses(Springs):
    """On tissue, impulses by projected Gauss-Seidel (Catto, GDC 2005); elsewhere Springs."""

    parameters = {**Springs.parameters, "bias": (0.2, "1", "fraction of the depth removed in a sub-step"),
                  "sweeps": (10.0, "1", "over all contacts")}

    def __init__(self, k: float, relaxation_time: float, bias: float, sweeps: float) -> None:
        super().__init__(k, relaxation_time)
        self.bias, self.sweeps = bias, int(sweeps)

    def respond(self, frame: trocar.Frame, dt: float, contacts: npt.NDArray[Any],
                contact_forces: npt.NDArray[Any]) -> npt.NDArray[Any]:
        # Gauss-Seidel depends on the order.
        order = np.lexsort((*contacts["normal"].T, *contacts["point"].T))
        laws, pushed, surface_velocity = self.laws_of(frame, contacts[order])
        solved = pushed == "tissue"
        laws["role"][solved] = 4
        laws["k"][solved] = laws["mu"][solved] = 0.0
        scripted = solved & (laws["reaction_vertices"][:, 0] < 0)
        laws["surface_velocity"][scripted] = surface_velocity[scripted]
        return laws

    def solve(self, step: trocar.PredictedStep) -> None:
        contacts, total = step.contacts, np.zeros(len(step.contacts))
        depth = contacts["depth"]
        target = np.where(depth > 0.0, self.bias * depth, depth) / step.time
        for _ in range(self.sweeps):
            for i, contact in enumerate(contacts):
                # The sum is clamped, not each correction.
                after = max(0.0, total[i] + (target[i] - step.rate(i)) / contact["mobility"])
                step.push(i, (after - total[i]) * contact["normal"])
                total[i] = after
