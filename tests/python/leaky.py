"""A detector that loses one pair of a hundred, and methods that break what they promise."""

import trocar


def lost(pairs, tick, one_of):
    """Others in every tick, spread over the meshes."""
    return (7919 * pairs[:, 0].astype(int) + 104729 * pairs[:, 1] + 31 * tick) % 10007 % one_of == 0


class Leaky(trocar.Detector):
    parameters = {"one_of": (100.0, "1", "one pair of so many is lost")}

    def __init__(self, one_of):
        self.one_of = int(one_of)
        self.inner = trocar.make_detector("brute_force")

    def prepare(self, topology, frame):
        self.inner.prepare(topology, frame)

    def update(self, frame, query_distance):
        self.inner.update(frame, query_distance)

    def detect(self, frame):
        pairs, _ = self.inner.detect(frame)
        return pairs[~lost(pairs, frame.tick, self.one_of)]


class Raises(trocar.Detector):
    def detect(self, frame):
        raise ValueError("no answer today")


class WrongNumbers(trocar.Detector):
    def detect(self, frame):
        return [[0, 1_000_000]]


class WrongType(trocar.Response):
    def respond(self, frame, dt, contacts, contact_forces):
        return None


class WrongRole(trocar.Response):
    def respond(self, frame, dt, contacts, contact_forces):
        laws = trocar.force_laws(1)
        laws["role"] = 9
        return laws
