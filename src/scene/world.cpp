#include "scene/world.hpp"

#include <algorithm>
#include <bit>
#include <set>
#include <string>

#include "geometry/fnv_hash.hpp"
#include "geometry/input_error.hpp"

namespace trocar {

BodyKind body_kind_of(const std::string& word) {
    const auto found = std::find(body_kind_words.begin(), body_kind_words.end(), word);
    return static_cast<BodyKind>(found - body_kind_words.begin());
}

Index Topology::body_of_vertex(Index vertex) const {
    for (Index body = 0; body < body_count(); ++body) {
        if (bodies[static_cast<std::size_t>(body)].vertices.contains(vertex)) return body;
    }
    return -1;
}

Index Topology::body_pair(Index body_a, Index body_b) const {
    const std::array<Index, 2> wanted{std::min(body_a, body_b), std::max(body_a, body_b)};
    const auto found = std::lower_bound(body_pairs.begin(), body_pairs.end(), wanted);
    if (found == body_pairs.end() || *found != wanted) return -1;
    return static_cast<Index>(found - body_pairs.begin());
}

Topology make_topology(const std::vector<Body>& bodies) {
    std::vector<std::array<Index, 2>> pairs;
    for (std::size_t a = 0; a < bodies.size(); ++a) {
        for (std::size_t b = a + 1; b < bodies.size(); ++b) {
            const bool both_rigid = bodies[a].kind == BodyKind::rigid && bodies[b].kind == BodyKind::rigid;
            const bool same_instrument = !bodies[a].instrument.empty() && bodies[a].instrument == bodies[b].instrument;
            if (!both_rigid && !same_instrument) pairs.push_back({static_cast<Index>(a), static_cast<Index>(b)});
        }
    }
    return make_topology(bodies, pairs);
}

Topology make_topology(const std::vector<Body>& bodies, const std::vector<std::array<Index, 2>>& body_pairs) {
    Topology topology;
    std::int64_t vertex_total = 0;
    std::int64_t triangle_total = 0;
    std::set<std::string> names;
    for (const Body& body : bodies) {
        if (body.vertex_count < 0) {
            throw InputError("body '" + body.name + "'", "", "a vertex count >= 0", std::to_string(body.vertex_count));
        }
        if (!names.insert(body.name).second) {
            throw InputError("body '" + body.name + "'", "", "a name of its own", "a second body of that name");
        }
        vertex_total += body.vertex_count;
        triangle_total += body.triangles.cols();
    }
    constexpr std::int64_t limit = std::numeric_limits<Index>::max();
    if (vertex_total > limit || triangle_total > limit) {
        throw InputError("bodies", "", "at most 2147483647 vertices and triangles",
                         std::to_string(std::max(vertex_total, triangle_total)));
    }
    topology.triangles.resize(3, triangle_total);
    topology.body_of_triangle.reserve(static_cast<std::size_t>(triangle_total));
    Index first_vertex = 0;
    Index first_triangle = 0;
    for (const Body& body : bodies) {
        const auto count = static_cast<Index>(body.triangles.cols());
        for (Index t = 0; t < count; ++t) {
            for (int corner = 0; corner < 3; ++corner) {
                const Index v = body.triangles(corner, t);
                if (v < 0 || v >= body.vertex_count) {
                    throw InputError("body '" + body.name + "'", "triangle " + std::to_string(t),
                                     "vertex numbers 0 to " + std::to_string(body.vertex_count - 1), std::to_string(v));
                }
                topology.triangles(corner, first_triangle + t) = first_vertex + v;
            }
        }
        topology.body_of_triangle.insert(topology.body_of_triangle.end(), static_cast<std::size_t>(count),
                                         static_cast<Index>(topology.bodies.size()));
        topology.bodies.push_back({.name = body.name,
                                   .kind = body.kind,
                                   .closed = body.closed,
                                   .instrument = body.instrument,
                                   .vertices = {first_vertex, body.vertex_count},
                                   .triangles = {first_triangle, count},
                                   .start_side = body.start_side});
        first_vertex += body.vertex_count;
        first_triangle += count;
    }
    topology.vertex_count = first_vertex;
    for (auto [a, b] : body_pairs) {
        const auto body_count = static_cast<Index>(bodies.size());
        if (a < 0 || b < 0 || a >= body_count || b >= body_count || a == b) {
            throw InputError("body pairs", "", "two different body numbers below " + std::to_string(body_count),
                             std::to_string(a) + " and " + std::to_string(b));
        }
        topology.body_pairs.push_back({std::min(a, b), std::max(a, b)});
    }
    std::sort(topology.body_pairs.begin(), topology.body_pairs.end());
    topology.body_pairs.erase(std::unique(topology.body_pairs.begin(), topology.body_pairs.end()),
                              topology.body_pairs.end());
    return topology;
}

std::uint64_t Frame::hash() const {
    FnvHash hash;
    hash.add_word(static_cast<std::uint64_t>(tick));
    const double* const numbers = position.data();
    for (Eigen::Index i = 0; i < position.size(); ++i) hash.add_word(std::bit_cast<std::uint64_t>(numbers[i]));
    return hash.value();
}

}  // namespace trocar
