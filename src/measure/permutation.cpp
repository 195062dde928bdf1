#include "measure/permutation.hpp"

#include <algorithm>
#include <numeric>
#include <random>

namespace trocar {
namespace {

/// New number of every old one, -1 where it is gone.
std::vector<Index> inverse(const std::vector<Index>& old, Index count) {
    std::vector<Index> result(at(count), -1);
    for (std::size_t k = 0; k < old.size(); ++k) result[at(old[k])] = static_cast<Index>(k);
    return result;
}

Matrix3X columns(const Matrix3X& all, const std::vector<Index>& chosen) {
    Matrix3X result(3, static_cast<Eigen::Index>(chosen.size()));
    for (std::size_t k = 0; k < chosen.size(); ++k) result.col(static_cast<Eigen::Index>(k)) = all.col(chosen[k]);
    return result;
}

/// An array that a scene without tissue leaves empty stays so.
template <typename T>
void choose(std::vector<T>& values, const std::vector<Index>& chosen) {
    if (values.empty()) return;
    std::vector<T> result;
    result.reserve(chosen.size());
    for (const Index k : chosen) result.push_back(values[at(k)]);
    values = std::move(result);
}

}  // namespace

Frame Permutation::permuted(const Frame& frame) const {
    Frame result = frame;
    result.position = columns(frame.position, vertex);
    result.previous = columns(frame.previous, vertex);
    result.velocity = columns(frame.velocity, vertex);
    result.moved.reset();
    choose(result.pose, body);
    return result;
}

std::vector<TrianglePair> Permutation::original(const std::vector<TrianglePair>& pairs) const {
    std::vector<TrianglePair> result;
    result.reserve(pairs.size());
    for (const TrianglePair& pair : pairs) {
        const auto [low, high] = std::minmax(triangle[at(pair.a)], triangle[at(pair.b)]);
        result.push_back({low, high});
    }
    std::sort(result.begin(), result.end());
    return result;
}

Permutation shuffled(const Topology& topology, std::uint32_t seed, Shuffle what) {
    std::mt19937 random(seed);
    Permutation result{.topology = topology, .vertex = {}, .triangle = {}, .body = {}};
    result.vertex.resize(at(topology.vertex_count));
    result.triangle.resize(at(topology.triangle_count()));
    result.body.resize(topology.bodies.size());
    for (std::vector<Index>* list : {&result.vertex, &result.triangle, &result.body}) {
        std::iota(list->begin(), list->end(), 0);
    }
    for (const BodyRange& body : topology.bodies) {
        std::shuffle(result.triangle.begin() + body.triangles.first, result.triangle.begin() + body.triangles.end(),
                     random);
        if (what != Shuffle::triangles_and_vertices) continue;
        std::shuffle(result.vertex.begin() + body.vertices.first, result.vertex.begin() + body.vertices.end(), random);
    }
    const std::vector<Index> new_vertex = inverse(result.vertex, topology.vertex_count);
    for (Index t = 0; t < topology.triangle_count(); ++t) {
        const auto old = topology.triangles.col(result.triangle[at(t)]);
        for (int k = 0; k < 3; ++k) {
            result.topology.triangles(k, t) = new_vertex[at(old((k + static_cast<int>(seed % 3)) % 3))];
        }
    }
    return result;
}

Permutation with_bodies_in_order(const Topology& topology, const std::vector<Index>& order) {
    Permutation result;
    result.body = order;
    std::vector<Body> bodies;
    for (const Index b : order) {
        const BodyRange& range = topology.bodies[at(b)];
        Body body{.name = range.name,
                  .kind = range.kind,
                  .closed = range.closed,
                  .instrument = range.instrument,
                  .vertex_count = range.vertices.count,
                  .triangles = topology.triangles.middleCols(range.triangles.first, range.triangles.count).array() -
                               range.vertices.first,
                  .start_side = range.start_side};
        bodies.push_back(std::move(body));
        for (Index v = range.vertices.first; v < range.vertices.end(); ++v) result.vertex.push_back(v);
        for (Index t = range.triangles.first; t < range.triangles.end(); ++t) result.triangle.push_back(t);
    }
    std::vector<std::array<Index, 2>> pairs;
    const std::vector<Index> new_body = inverse(order, topology.body_count());
    for (const auto& [first, second] : topology.body_pairs) {
        const auto [low, high] = std::minmax(new_body[at(first)], new_body[at(second)]);
        if (low >= 0) pairs.push_back({low, high});
    }
    result.topology = make_topology(bodies, pairs);
    return result;
}

Scene permuted(const Scene& scene, const Permutation& permutation) {
    Scene result = scene;
    result.topology = permutation.topology;
    result.first = permutation.permuted(scene.first);
    Materials& materials = result.materials;
    if (materials.rest_bias.cols() > 0) materials.rest_bias = columns(materials.rest_bias, permutation.vertex);
    choose(materials.pinned, permutation.vertex);
    for (auto* values : {&materials.mass, &materials.area, &materials.mean_stiffness, &materials.drag}) {
        choose(*values, permutation.vertex);
    }
    choose(materials.triangle_stiffness, permutation.triangle);
    const std::vector<Index> new_vertex = inverse(permutation.vertex, scene.topology.vertex_count);
    for (Spring& spring : materials.springs) {
        spring.i = new_vertex[at(spring.i)];
        spring.j = new_vertex[at(spring.j)];
    }
    for (Enclosure& enclosure : materials.enclosures) {
        enclosure.triangles = enclosure.triangles.unaryExpr([&](Index v) { return new_vertex[at(v)]; }).eval();
    }
    std::vector<ContactLaw> laws;
    for (const auto& [first, second] : result.topology.body_pairs) {
        const auto [low, high] = std::minmax(permutation.body[at(first)], permutation.body[at(second)]);
        laws.push_back(scene.materials.contact_laws[at(scene.topology.body_pair(low, high))]);
    }
    materials.contact_laws = std::move(laws);
    choose(materials.trocar_point, permutation.body);
    choose(materials.tip, permutation.body);
    choose(result.bodies, permutation.body);
    for (std::size_t b = 0; b < result.bodies.size(); ++b) {
        const BodyRange& was = scene.topology.bodies[at(permutation.body[b])];
        const BodyRange& is = result.topology.bodies[b];
        for (JawPart& jaw : result.bodies[b].jaws) jaw.vertices.first += is.vertices.first - was.vertices.first;
        if (result.bodies[b].file_triangle.empty()) continue;
        std::vector<Index> file_triangle;
        for (Index t = is.triangles.first; t < is.triangles.end(); ++t) {
            const Index old = permutation.triangle[at(t)] - was.triangles.first;
            file_triangle.push_back(result.bodies[b].file_triangle[at(old)]);
        }
        result.bodies[b].file_triangle = std::move(file_triangle);
    }
    return result;
}

Scene through_millimetres(const Scene& scene) {
    Scene result = scene;
    const auto round = [](auto&& lengths) { lengths = ((lengths * 1000.0) * 0.001).eval(); };
    round(result.first.position);
    round(result.first.previous);
    for (Pose& pose : result.first.pose) round(pose.translation);
    for (SceneBody& body : result.bodies) {
        round(body.local);
        for (JawPart& jaw : body.jaws) round(jaw.hinge);
        if (!body.motion) continue;
        for (MotionKey& key : body.motion->keys) round(key.translation);
    }
    for (Spring& spring : result.materials.springs) spring.rest = (spring.rest * 1000.0) * 0.001;
    for (auto& point : result.materials.trocar_point) {
        if (point) round(*point);
    }
    for (Vector3& tip : result.materials.tip) round(tip);
    return result;
}

Scene moved(const Scene& scene, const Vector3& by) {
    Scene result = scene;
    result.first.position.colwise() += by;
    result.first.previous.colwise() += by;
    for (Pose& pose : result.first.pose) pose.translation += by;
    for (SceneBody& body : result.bodies) {
        if (!body.motion) continue;
        for (MotionKey& key : body.motion->keys) key.translation += by;
    }
    for (auto& point : result.materials.trocar_point) {
        if (point) *point += by;
    }
    return result;
}

Frame on_grid(const Frame& frame) {
    Frame result = frame;
    result.position = (frame.position * 0x1p30).array().round().matrix() * 0x1p-30;
    return placed(result, 1.0, Vector3::Zero());
}

Frame placed(const Frame& frame, double factor, const Vector3& by) {
    Frame result = frame;
    result.position = (frame.position * factor).colwise() + by;
    result.previous = result.position;
    result.velocity.setZero();
    result.moved.reset();
    return result;
}

}  // namespace trocar
