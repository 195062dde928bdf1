// Detection on two meshes or on the first frame of a scene, and detectors one call at a time.
#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <memory>
#include <stdexcept>

#include "app/detector_answers.hpp"
#include "app/shipped.hpp"
#include "geometry/exact.hpp"
#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "python/arrays.hpp"
#include "python/parts.hpp"
#include "scene/mesh_pair.hpp"
#include "scene/scene.hpp"

namespace trocar::python {
namespace {

/// Answer of one detector on one frame.
struct Detection {
    app::FrameAnswer answer;
    WorkCounters work;
    std::vector<std::uint8_t> touches;  ///< one per pair
};

/// `first_of_b`: triangles from here on get numbers from 0 on.
Detection detection_of(const Topology& topology, const Frame& frame, const std::string& detector, bool with_truth,
                       Index first_of_b) {
    Detection detection;
    ContactSet contacts;
    const std::unique_ptr<Detector> one = make_detector(detector);
    try {
        one->prepare(topology, frame);
        detection.answer = app::answer_here(*one, frame, contacts);
    } catch (const std::exception& error) {
        detection.answer.outcome = {OutcomeKind::threw, error.what()};
    }
    detection.work = contacts.work;
    std::optional<TickTruth> truth;
    if (with_truth) truth = truth_of(topology, frame);
    app::judge(
        topology, frame, truth ? &*truth : nullptr,
        [first_of_b](Index triangle) { return triangle < first_of_b ? triangle : triangle - first_of_b; },
        detection.answer);
    detection.touches.assign(detection.answer.pairs.size(), 0);
    for (const Index k : detection.answer.touch) detection.touches[at(k)] = 1;
    return detection;
}

Detection detect_meshes(const Mesh& a, const Mesh& b, const std::string& detector, bool with_truth) {
    const Computing computing;
    const MeshPair pair = make_mesh_pair(a, b);
    return detection_of(pair.topology, pair.frame, detector, with_truth, pair.topology.bodies[1].triangles.first);
}

Mesh mesh_from(const py::object& vertices, const py::object& faces, const std::string& letter) {
    Mesh mesh;
    mesh.vertices = points_from(vertices, "vertices_" + letter);
    mesh.triangles = triangles_from(faces, "faces_" + letter, mesh.vertices.cols());
    return mesh;
}

Detection detect_arrays(const py::object& vertices_a, const py::object& faces_a, const py::object& vertices_b,
                        const py::object& faces_b, const std::string& detector, bool with_truth) {
    const Mesh a = mesh_from(vertices_a, faces_a, "a");
    const Mesh b = mesh_from(vertices_b, faces_b, "b");
    return detect_meshes(a, b, detector, with_truth);
}

Detection detect_files(const std::filesystem::path& a, const std::filesystem::path& b, const std::string& detector,
                       bool with_truth) {
    const Mesh mesh_a = read_mesh(a);
    const Mesh mesh_b = read_mesh(b);
    return detect_meshes(mesh_a, mesh_b, detector, with_truth);
}

Detection detect_scene(const std::filesystem::path& file, const std::string& detector, bool with_truth,
                       const std::optional<std::filesystem::path>& data) {
    const Computing computing;
    const Scene scene = read_scene(app::find_scene(file), data_folder(data));
    return detection_of(scene.topology, scene.first, detector, with_truth, scene.topology.triangle_count());
}

py::dict counters_of(const Detection& detection) {
    using namespace py::literals;
    const WorkCounters& work = detection.work;
    return py::dict("vertices_read"_a = work.vertices_read, "cells_visited"_a = work.cells_visited,
                    "box_tests"_a = work.box_tests, "triangle_tests"_a = work.triangle_tests);
}

/// (n, 3, 3) corners each.
py::array intersecting(const py::array_t<double, py::array::c_style | py::array::forcecast>& a,
                       const py::array_t<double, py::array::c_style | py::array::forcecast>& b) {
    for (const auto* array : {&a, &b}) {
        if (array->ndim() == 3 && array->shape(1) == 3 && array->shape(2) == 3 && array->shape(0) == a.shape(0))
            continue;
        throw InputError("corners", "", "two arrays of shape (n, 3, 3)",
                         "shape " + std::string(py::str(array->attr("shape"))));
    }
    const auto corners = [](const double* at) {
        return Corners{Vector3(at[0], at[1], at[2]), Vector3(at[3], at[4], at[5]), Vector3(at[6], at[7], at[8])};
    };
    py::array_t<bool> result(a.shape(0));
    for (py::ssize_t k = 0; k < a.shape(0); ++k) {
        result.mutable_data()[k] = triangles_intersect(corners(a.data() + 9 * k), corners(b.data() + 9 * k));
    }
    return result;
}

/// A detector of the registry. The order of calls is checked, since detectors themselves do not.
class OneDetector {
public:
    explicit OneDetector(const std::string& name) : detector_(make_detector(name)) {}

    void prepare(std::shared_ptr<Topology> topology, const Frame& frame) {
        check(*topology, frame);
        topology_ = std::move(topology);
        const Computing computing;
        detector_->prepare(*topology_, frame);
    }
    void update(const Frame& frame, double query_distance) {
        check_prepared(frame);
        if (!(query_distance >= 0.0 && query_distance < std::numeric_limits<double>::infinity())) {
            throw InputError("query_distance", "", "a finite number >= 0", fmt::format("{}", query_distance));
        }
        const Computing computing;
        detector_->update(frame, query_distance);
    }
    /// (pairs, near).
    py::tuple detect(const Frame& frame) {
        check_prepared(frame);
        contacts_.clear();
        {
            const Computing computing;
            detector_->detect(frame, contacts_);
        }
        if (!contacts_.outcome.ok()) {
            throw std::runtime_error(fmt::format("{}: {}", name_of(contacts_.outcome.kind), contacts_.outcome.message));
        }
        return py::make_tuple(array_of(std::move(contacts_.pairs)), array_of(std::move(contacts_.near)));
    }

private:
    static void check(const Topology& topology, const Frame& frame) {
        if (frame.position.cols() == topology.vertex_count) return;
        throw InputError("frame", "", fmt::format("{} vertices", topology.vertex_count),
                         fmt::format("{}", frame.position.cols()));
    }
    void check_prepared(const Frame& frame) const {
        if (topology_ == nullptr) throw InputError("detector", "", "a call of prepare first", "none");
        check(*topology_, frame);
    }

    std::unique_ptr<Detector> detector_;
    std::shared_ptr<Topology> topology_;
    ContactSet contacts_;
};

}  // namespace

void add_detection(py::module_& module) {
    py::class_<Detection> detection(module, "Detection", R"(Answer of a detector on one frame.

pairs: (n, 2) int32, sorted. touches: (n,) bool, True where two triangles only touch. counters: dict of deterministic
work. outcome: ok, or how the detector failed; message: one sentence on it. truncated: a limit cut the list.
update_ns, detect_ns: of this one call. false_negatives, false_positives: against the exact pairs; None without truth.
Arrays are read-only views, which keep the answer alive.)");
    detection.def_property_readonly(
        "pairs", [](const py::object& self) { return view_of(self.cast<const Detection&>().answer.pairs, self); });
    detection.def_property_readonly("touches", [](const py::object& self) {
        const auto& touches = self.cast<const Detection&>().touches;
        return view_of(py::dtype::of<bool>(), {static_cast<py::ssize_t>(touches.size())}, {}, touches.data(), self);
    });
    detection.def_property_readonly("counters", &counters_of);
    detection.def_property_readonly("outcome", [](const Detection& one) { return name_of(one.answer.outcome.kind); });
    detection.def_property_readonly("message", [](const Detection& one) { return one.answer.outcome.message; });
    detection.def_property_readonly("truncated", [](const Detection& one) { return one.answer.truncated; });
    detection.def_property_readonly("update_ns", [](const Detection& one) { return one.answer.update_ns; });
    detection.def_property_readonly("detect_ns", [](const Detection& one) { return one.answer.detect_ns; });
    const auto error = [](std::int64_t PairErrors::*count) {
        return [count](const Detection& one) {
            return one.answer.errors ? std::optional((*one.answer.errors).*count) : std::nullopt;
        };
    };
    detection.def_property_readonly("false_negatives", error(&PairErrors::false_negatives));
    detection.def_property_readonly("false_positives", error(&PairErrors::false_positives));

    module.def("detect_arrays", &detect_arrays);
    module.def("detect_files", &detect_files);
    module.def("detect_scene", &detect_scene);
    module.def("triangles_intersect", &intersecting, py::arg("corners_a"), py::arg("corners_b"),
               "Exact test of pairs of closed triangles: (n, 3, 3) float64 corners each, finite; returns (n,) bool.");

    py::class_<OneDetector> one(module, "OneDetector",
                                R"(A detector, a call at a time; trocar.make_detector.

prepare once, then update and detect for every frame. query_distance: m. detect returns (pairs, near), (n, 2) int32
arrays that own their memory; near is empty at query distance 0. A failure raises RuntimeError with the outcome.)");
    one.def(py::init<const std::string&>(), py::arg("name"));
    one.def("prepare", &OneDetector::prepare, py::arg("topology"), py::arg("frame"));
    one.def("update", &OneDetector::update, py::arg("frame"), py::arg("query_distance") = 0.0);
    one.def("detect", &OneDetector::detect, py::arg("frame"));
}

}  // namespace trocar::python
