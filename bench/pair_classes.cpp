#include "pair_classes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

#include "geometry/crossing.hpp"
#include "measure/pair_truth.hpp"
#include "method/registry.hpp"
#include "scene/shapes.hpp"

namespace trocar::bench {
namespace {

/// Nine balls in a square, each a little deeper than the last, over a sheet that is not flat.
std::array<Surface, 2> balls_in_a_sheet() {
    ShapeValues ball;
    ball.numbers = {{"radius", {0.006}}, {"edge", {0.0025}}};
    const Surface one = find_shape("sphere")->make(ball);
    Surface balls;
    balls.vertices.resize(3, 9 * one.vertices.cols());
    balls.triangles.resize(3, 9 * one.triangles.cols());
    for (Index i = 0; i < 9; ++i) {
        const Vector3 place(0.016 * (i % 3 - 1) + 0.0007, 0.016 * (i / 3 - 1) + 0.0004, 0.0054 - 0.0001 * i);
        const Eigen::AngleAxisd turn(0.3 * i, Vector3(1.0, 2.0, 0.5).normalized());
        balls.vertices.middleCols(i * one.vertices.cols(), one.vertices.cols()) =
            (turn.toRotationMatrix() * one.vertices).colwise() + place;
        balls.triangles.middleCols(i * one.triangles.cols(), one.triangles.cols()) =
            one.triangles.array() + static_cast<Index>(i * one.vertices.cols());
    }
    ShapeValues values;
    values.numbers = {{"size", {0.06, 0.06}}, {"edge", {0.003}}};
    Surface sheet = find_shape("sheet")->make(values);
    for (Eigen::Index v = 0; v < sheet.vertices.cols(); ++v) {
        sheet.vertices(2, v) = 0.0003 * std::sin(300.0 * sheet.vertices(0, v)) * std::cos(420.0 * sheet.vertices(1, v));
    }
    return {balls, sheet};
}

/// Springs along the edges, masses and areas as METHODS §12 gives them on average.
void make_tissue(const Topology& topology, const Frame& frame, const BodyRange& body, Materials& materials) {
    for (Index v = body.vertices.first; v < body.vertices.end(); ++v) {
        materials.mass[at(v)] = 2.5e-5;
        materials.area[at(v)] = 8e-6;
        materials.mean_stiffness[at(v)] = 100.0;
        materials.drag[at(v)] = 1e-4;
    }
    std::vector<std::pair<Index, Index>> edges;
    for (Index t = body.triangles.first; t < body.triangles.end(); ++t) {
        materials.triangle_stiffness[at(t)] = 100.0;
        for (int i = 0; i < 3; ++i) {
            const auto [low, high] = std::minmax(topology.triangles(i, t), topology.triangles((i + 1) % 3, t));
            edges.emplace_back(low, high);
        }
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    for (const auto& [i, j] : edges) {
        const double rest = (frame.position.col(j) - frame.position.col(i)).norm();
        materials.springs.push_back(
            {.i = i, .j = j, .rest = rest, .k = 100.0, .preload = 20.0 * rest, .damping = 0.02});
    }
}

PairClass make_class(std::string name, BodyKind kind_a, BodyKind kind_b, std::vector<ContactCase> cases,
                     const std::array<Surface, 2>& surfaces) {
    PairClass result;
    result.name = std::move(name);
    std::vector<Body> bodies;
    for (std::size_t i = 0; i < 2; ++i) {
        bodies.push_back({.name = i == 0 ? "a" : "b",
                          .kind = i == 0 ? kind_a : kind_b,
                          .closed = i == 0,
                          .vertex_count = static_cast<Index>(surfaces[i].vertices.cols()),
                          .triangles = surfaces[i].triangles});
    }
    Topology& topology = result.topology;
    topology = make_topology(bodies);
    Frame& frame = result.frame;
    frame.position.resize(3, topology.vertex_count);
    frame.position << surfaces[0].vertices, surfaces[1].vertices;
    frame.previous = frame.position;
    frame.velocity = Matrix3X::Zero(3, topology.vertex_count);
    frame.pose.assign(2, {});
    // The first body comes down, and a tissue yields a little, so that paths and dampers have work to do.
    const Vector3 down(0.01, 0.0, -0.05);
    const Range a = topology.bodies[0].vertices;
    frame.velocity.middleCols(a.first, a.count).colwise() = down;
    const Range b = topology.bodies[1].vertices;
    if (kind_b == BodyKind::tissue) frame.velocity.middleCols(b.first, b.count).colwise() = 0.3 * down;
    frame.previous -= PairClass::dt * frame.velocity;

    Materials& materials = result.materials;
    materials.rest_bias = Matrix3X::Zero(3, topology.vertex_count);
    for (std::vector<double>* list : {&materials.mass, &materials.area, &materials.mean_stiffness, &materials.drag}) {
        list->assign(at(topology.vertex_count), 0.0);
    }
    materials.pinned.assign(at(topology.vertex_count), 0);
    materials.triangle_stiffness.assign(at(topology.triangle_count()), 0.0);
    for (const BodyRange& body : topology.bodies) {
        if (body.kind == BodyKind::tissue) make_tissue(topology, frame, body, materials);
    }
    materials.contact_laws.resize(topology.body_pairs.size());
    materials.trocar_point.resize(2);
    materials.tip.assign(2, Vector3(0.0, 0.0, 0.1));

    true_pairs(topology, frame, result.contacts.pairs);
    const std::unique_ptr<ContactGenerator> generator = make_contact_generator("intersection");
    generator->prepare(topology, frame);
    generator->gather(frame, result.contacts);
    ContactSet& set = result.contacts;
    std::vector<Contact> kept;
    std::vector<TrianglePair> pairs;
    for (const Contact& contact : set.contacts) {
        if (std::find(cases.begin(), cases.end(), contact.kind) == cases.end()) continue;
        kept.push_back(contact);
        pairs.push_back({contact.a, contact.b});
    }
    if (kept.size() < 8) throw std::logic_error(result.name + ": the scene gives too few pairs of this class");
    set.contacts = std::move(kept);
    set.pairs = std::move(pairs);
    return result;
}

}  // namespace

std::vector<PairClass> pair_classes() {
    using enum BodyKind;
    using enum ContactCase;
    const std::array<Surface, 2> surfaces = balls_in_a_sheet();
    std::vector<PairClass> list;
    const auto add = [&](const char* name, BodyKind a, BodyKind b, std::vector<ContactCase> cases) {
        list.push_back(make_class(name, a, b, std::move(cases), surfaces));
    };
    add("I2I vertex in face", instrument, instrument, {a_enters_b, b_enters_a});
    add("I2I edges", instrument, instrument, {edges_cross});
    add("I2R vertex in face", instrument, rigid, {a_enters_b, b_enters_a});
    add("I2R edges", instrument, rigid, {edges_cross});
    add("I2T instrument vertex in tissue face", instrument, tissue, {a_enters_b});
    add("I2T tissue vertex in instrument face", instrument, tissue, {b_enters_a});
    add("I2T edges", instrument, tissue, {edges_cross});
    add("R2T tissue vertex in bone face", rigid, tissue, {b_enters_a});
    add("T2T", tissue, tissue, {a_enters_b, b_enters_a, edges_cross});
    return list;
}

}  // namespace trocar::bench
