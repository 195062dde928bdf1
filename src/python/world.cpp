// Topology, frames and materials as Python sees them. Python gets copies, so that a class may keep them.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>

#include "geometry/input_error.hpp"
#include "python/arrays.hpp"
#include "python/parts.hpp"
#include "scene/world.hpp"

namespace trocar::python {
namespace {

using SharedTopology = std::shared_ptr<Topology>;
using SharedFrame = std::shared_ptr<Frame>;
using SharedMaterials = std::shared_ptr<Materials>;

py::list bodies_of(const Topology& topology) {
    py::list bodies;
    for (const BodyRange& body : topology.bodies) {
        py::dict one;
        one["name"] = body.name;
        one["kind"] = body_kind_words.at(static_cast<std::size_t>(body.kind));
        one["closed"] = body.closed;
        one["vertices"] = py::slice(body.vertices.first, body.vertices.end(), 1);
        one["triangles"] = py::slice(body.triangles.first, body.triangles.end(), 1);
        bodies.append(one);
    }
    return bodies;
}

/// Read-only property: an array on a member, which the Python object keeps alive.
template <typename Class, typename Member>
void add_view(Class& of, const char* name, Member Class::type::*member) {
    of.def_property_readonly(name, [member](const py::object& self) {
        return view_of(self.cast<const typename Class::type&>().*member, self);
    });
}

SharedFrame make_frame(const py::object& positions, const py::object& previous, std::int64_t tick, double time) {
    auto frame = std::make_shared<Frame>();
    frame->position = points_from(positions, "positions");
    frame->previous = previous.is_none() ? frame->position : points_from(previous, "previous");
    if (frame->previous.cols() != frame->position.cols()) {
        throw InputError("previous", "", "as many points as positions", std::to_string(frame->previous.cols()));
    }
    frame->velocity.setZero(3, frame->position.cols());
    frame->tick = tick;
    frame->time = time;
    return frame;
}

}  // namespace

void add_world(py::module_& module) {
    py::class_<Topology, SharedTopology> topology(module, "Topology",
                                                  R"(Triangles and bodies of a run, which stay the same.

vertex_count. triangles: (T, 3) int32, vertex numbers, counter-clockwise seen from outside. body_of_triangle: (T,)
int32. body_pairs: (n, 2) int32, the bodies that are tested against each other. bodies: a dict each with name, kind
(instrument, rigid or tissue), closed, and vertices and triangles as slices. Arrays are read-only views.)");
    topology.def_readonly("vertex_count", &Topology::vertex_count);
    topology.def_property_readonly("bodies", &bodies_of);
    add_view(topology, "triangles", &Topology::triangles);
    topology.def_property_readonly("body_of_triangle", [](const py::object& self) {
        const auto& bodies = self.cast<const Topology&>().body_of_triangle;
        return view_of(py::dtype::of<Index>(), {static_cast<py::ssize_t>(bodies.size())}, {}, bodies.data(), self);
    });
    topology.def_property_readonly("body_pairs", [](const py::object& self) {
        const auto& pairs = self.cast<const Topology&>().body_pairs;
        return view_of(py::dtype::of<Index>(), {static_cast<py::ssize_t>(pairs.size()), 2}, {}, pairs.data(), self);
    });

    py::class_<Frame, SharedFrame> frame(module, "Frame", R"(Positions at one tick.

positions: (N, 3) float64, m, world; previous: the same a tick before; velocities: m/s. tick; time: s. moved: slices
of the vertices that may have changed since the last tick; None: unknown. Arrays are read-only views. Frame(positions,
previous) copies; without previous nothing has moved.)");
    frame.def(py::init(&make_frame), py::arg("positions"), py::arg("previous") = py::none(), py::arg("tick") = 0,
              py::arg("time") = 0.0);
    add_view(frame, "positions", &Frame::position);
    add_view(frame, "previous", &Frame::previous);
    add_view(frame, "velocities", &Frame::velocity);
    frame.def_readonly("tick", &Frame::tick);
    frame.def_readonly("time", &Frame::time);
    frame.def_property_readonly("moved", [](const Frame& self) -> py::object {
        if (!self.moved) return py::none();
        py::list ranges;
        for (const Range& range : *self.moved) ranges.append(py::slice(range.first, range.end(), 1));
        return ranges;
    });

    py::class_<Materials, SharedMaterials> materials(module, "Materials",
                                                     R"(Material data that a response may use.

Per vertex, (N,) float64, 0 where there is no tissue: mass, kg; area, m2; mean_stiffness, N/m. Of a scene without
tissue they are empty. contact_laws: (body pairs, 2) float64, the scene's k (N/m) and mu (N s/m), NaN where it has
none. Arrays are read-only views.)");
    add_view(materials, "mass", &Materials::mass);
    add_view(materials, "area", &Materials::area);
    add_view(materials, "mean_stiffness", &Materials::mean_stiffness);
    materials.def_property_readonly("contact_laws", [](const py::object& self) {
        static_assert(sizeof(ContactLaw) == 2 * sizeof(double));
        const auto& laws = self.cast<const Materials&>().contact_laws;
        return view_of(py::dtype::of<double>(), {static_cast<py::ssize_t>(laws.size()), 2}, {}, laws.data(), self);
    });
}

}  // namespace trocar::python
