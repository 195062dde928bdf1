// A small closed loop without scene files, for tests of responses over time. It has a pinned sheet, a tool or second
// tissue, brute-force detection, the response with its default contact generator, and the tissue integrator.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "method/registry.hpp"
#include "scene/tissue_materials.hpp"
#include "scene/world.hpp"
#include "simulate/rupture.hpp"
#include "support/materials.hpp"
#include "support/shapes.hpp"
#include "support/shown_force.hpp"
#include "tissue/mass_spring.hpp"

namespace trocar::test {

/// n×n squares of edge `edge` around the origin in the plane z = 0, normal +z, alternating diagonals.
inline Shape make_sheet(int n, double edge) {
    Shape mesh;
    for (int i = 0; i <= n; ++i) {
        for (int j = 0; j <= n; ++j) mesh.vertices.emplace_back(edge * (i - 0.5 * n), edge * (j - 0.5 * n), 0.0);
    }
    const auto at = [n](int i, int j) { return static_cast<Index>(i * (n + 1) + j); };
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            if ((i + j) % 2 == 0) {
                mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
                mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
            } else {
                mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
                mesh.triangles.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
            }
        }
    }
    return mesh;
}

/// Closed box centred at the origin, outward normals.
inline Shape make_box(const Vector3& size) { return box_of(-0.5 * size, size); }

/// Closed shaft along z from the origin (pointed or flat end) to `length`, outward normals. Vertex 0 is at the origin.
inline Shape make_shaft(double radius, double length, int sides, double point_length) {
    const int rings = 12;
    Shape mesh = shaft(radius, length - point_length, sides, rings).move({0.0, 0.0, point_length});
    const auto bottom = static_cast<Index>(sides * (rings + 1));
    mesh.vertices[static_cast<std::size_t>(bottom)] = mesh.vertices[0];
    mesh.vertices[0] = Vector3::Zero();
    for (auto& triangle : mesh.triangles) {
        for (Index& v : triangle) v = v == 0 ? bottom : (v == bottom ? 0 : v);
    }
    return mesh;
}

struct LoopBody {
    std::string name;
    BodyKind kind = BodyKind::rigid;
    bool closed = true;
    Shape mesh;
    bool pin_rim = true;                         ///< tissue: pin vertices with the largest rest |x| or |y|
    std::function<Vector3(double)> offset = {};  ///< translation over time, m; absent: fixed
    std::string instrument = {};
};

/// Defaults: sheet of 5 mm edges, 3 mm thick (METHODS §12).
class ClosedLoop {
public:
    double dt = 1e-3;
    Topology topology;
    Materials materials;
    Frame frame;
    ContactSet contacts;
    ResponseOutput output;
    std::vector<Wrench> reaction;
    Outcome outcome;
    std::int64_t ruptures = 0;  ///< in the last tick

    ClosedLoop(std::vector<LoopBody> bodies, const std::string& method) : bodies_(std::move(bodies)) {
        std::vector<Body> list;
        Index total = 0;
        for (const LoopBody& body : bodies_) {
            list.push_back({.name = body.name,
                            .kind = body.kind,
                            .closed = body.closed,
                            .instrument = body.instrument,
                            .vertex_count = static_cast<Index>(body.mesh.vertices.size()),
                            .triangles = matrix_of(body.mesh.triangles)});
            total += static_cast<Index>(body.mesh.vertices.size());
        }
        topology = make_topology(list);
        frame.position.resize(3, total);
        for (std::size_t b = 0; b < bodies_.size(); ++b) place(b, 0.0);
        frame.previous = frame.position;
        frame.velocity = Matrix3X::Zero(3, total);
        frame.pose.assign(bodies_.size(), {});
        make_materials();
        response_ = make_response(method);
        response_->prepare(topology, materials);
        detector_ = make_detector("brute_force");
        detector_->prepare(topology, frame);
        const ContactGeneratorEntry& source =
            registry().contact_generator(default_contact_generator(parse_method(method)));
        wants_query_distance_ = source.wants_query_distance;
        source_ = make_contact_generator(source.name);
        source_->prepare(topology, frame);
        tissue_ = std::make_unique<MassSpring>(topology, materials);
        rupture_.prepare(topology, materials);
        output.resize(total, topology.body_count());
        reaction.assign(bodies_.size(), {});
    }

    bool step() {
        ++frame.tick;
        frame.time = dt * static_cast<double>(frame.tick);
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            if (bodies_[b].kind == BodyKind::tissue) continue;
            const Range range = topology.bodies[b].vertices;
            frame.previous.middleCols(range.first, range.count) = frame.position.middleCols(range.first, range.count);
            place(b, frame.time);
            frame.velocity.middleCols(range.first, range.count) =
                (frame.position.middleCols(range.first, range.count) -
                 frame.previous.middleCols(range.first, range.count)) /
                dt;
            if (bodies_[b].offset) frame.pose[b].translation = bodies_[b].offset(frame.time);
        }
        contacts.clear();
        detector_->update(frame, wants_query_distance_ ? query_distance() : 0.0);
        detector_->detect(frame, contacts);
        source_->gather(frame, contacts);
        response_->respond(frame, dt, contacts, tissue_->contact_forces(), output);
        reaction.assign(bodies_.size(), {});
        outcome = tissue_->advance(output, dt, frame, reaction);
        ruptures = rupture_.judge(frame, output, tissue_->contact_forces(), dt);
        return outcome.ok();
    }

    /// Mean force on a body over the last tick, N: integrated contact force laws plus the output's wrenches.
    [[nodiscard]] Vector3 tool_force(std::size_t body) const {
        return reaction[body].force + output.wrench[body].force;
    }
    /// N, on an instrument at the response's last frame, with the present tissue.
    [[nodiscard]] Vector3 shown_force(Index body) const { return test::shown_force(topology, frame, dt, output, body); }
    [[nodiscard]] const MassSpring& tissue() const { return *tissue_; }
    [[nodiscard]] Response& response() { return *response_; }
    void set_jaw(std::size_t body, double jaw) { frame.pose[body].jaw = jaw; }

private:
    /// Query distance, m: margin plus the largest displacement of the tick. Runs use a more elaborate rule.
    [[nodiscard]] double query_distance() const {
        constexpr double margin = 0.5e-3;  // m, a tenth of the 5 mm edges
        return margin + std::sqrt((frame.position - frame.previous).colwise().squaredNorm().maxCoeff());
    }

    void place(std::size_t b, double time) {
        const Range range = topology.bodies[b].vertices;
        const Vector3 offset = bodies_[b].offset ? bodies_[b].offset(time) : Vector3::Zero();
        for (Index v = 0; v < range.count; ++v) {
            frame.position.col(range.first + v) = bodies_[b].mesh.vertices[static_cast<std::size_t>(v)] + offset;
        }
    }

    /// Numbers of the vertices that are furthest from the middle along x or y.
    [[nodiscard]] std::vector<Index> rim_of(Range vertices) const {
        const Matrix3X start = frame.position.middleCols(vertices.first, vertices.count);
        const Matrix3X from_middle = start.colwise() - start.rowwise().mean();
        const auto distance = from_middle.topRows<2>().cwiseAbs().colwise().maxCoeff().eval();
        std::vector<Index> rim;
        for (Index v = 0; v < vertices.count; ++v) {
            if (distance(v) > distance.maxCoeff() - 1e-9) rim.push_back(v);
        }
        return rim;
    }

    void make_materials() {
        materials = empty_materials(topology);
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            if (bodies_[b].kind != BodyKind::tissue) continue;
            TissueSettings settings;
            settings.rim_pinned = false;
            if (bodies_[b].pin_rim) settings.pinned = rim_of(topology.bodies[b].vertices);
            add_tissue_body(settings, topology, topology.bodies[b], frame.position, dt, materials);
        }
        materials.substeps = stable_substeps(materials, frame.position, dt);
    }

    std::vector<LoopBody> bodies_;
    std::unique_ptr<Response> response_;
    std::unique_ptr<Detector> detector_;
    std::unique_ptr<ContactGenerator> source_;
    bool wants_query_distance_ = false;
    std::unique_ptr<MassSpring> tissue_;
    Rupture rupture_;
};

/// An instrument, body 0, over one tissue, body 1.
inline ClosedLoop tool_on_tissue(const Shape& tool, std::function<Vector3(double)> offset, const Shape& tissue,
                                 const std::string& method, bool closed = false) {
    return ClosedLoop(
        {LoopBody{.name = "tool", .kind = BodyKind::instrument, .mesh = tool, .offset = std::move(offset)},
         LoopBody{.name = "tissue", .kind = BodyKind::tissue, .closed = closed, .mesh = tissue}},
        method);
}

/// Heights (m) of triangles on the vertical line through a place, of those that it meets.
inline std::vector<double> heights_at(const ClosedLoop& loop, Range triangles, const Vector3& place) {
    std::vector<double> heights;
    for (Index t = triangles.first; t < triangles.end(); ++t) {
        const auto corner = loop.topology.triangles.col(t);
        const Vector3 a = loop.frame.position.col(corner[0]);
        const Vector3 ab = loop.frame.position.col(corner[1]) - a;
        const Vector3 ac = loop.frame.position.col(corner[2]) - a;
        const Vector3 x = place - a;
        const double whole = ab.x() * ac.y() - ab.y() * ac.x();
        const double b = (x.x() * ac.y() - x.y() * ac.x()) / whole;
        const double c = (ab.x() * x.y() - ab.y() * x.x()) / whole;
        constexpr double rounding = 1e-9;
        if (b >= -rounding && c >= -rounding && b + c <= 1.0 + rounding) {
            heights.push_back(a.z() + b * ab.z() + c * ac.z());
        }
    }
    return heights;
}

/// m, of the lowest surface of the last body over the tool's tip (vertex 0): positive = the tip is through.
inline double depth_at_tip(const ClosedLoop& loop) {
    const Vector3 tip = loop.frame.position.col(0);
    double lowest = std::numeric_limits<double>::infinity();
    for (const double height : heights_at(loop, loop.topology.bodies.back().triangles, tip)) {
        lowest = std::min(lowest, height);
    }
    return lowest - tip.z();
}

}  // namespace trocar::test
