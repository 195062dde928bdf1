#include "reference/hard_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace trocar {
namespace {

struct Barrier {
    double value = 0.0;
    double slope = 0.0;
    double curvature = 0.0;
};
/// b(d) = -(kappa) (g - d)² ln(d / g) for d < g, else 0.
Barrier barrier(double d, double g) {
    Barrier result;
    if (d >= g) return result;
    const double kappa = typical_contact / g;
    const double log = std::log(d / g);
    const double rest = g - d;
    result.value = -kappa * rest * rest * log;
    result.slope = kappa * (2.0 * rest * log - rest * rest / d);
    result.curvature = kappa * (-2.0 * log + 4.0 * rest / d + rest * rest / (d * d));
    return result;
}

std::array<Vector3, 4> points_of(const FeaturePair& pair, const Matrix3X& positions) {
    std::array<Vector3, 4> points;
    for (std::size_t i = 0; i < 4; ++i) points[i] = positions.col(pair.vertex[i]);
    return points;
}

}  // namespace

HardContact::HardContact(const Topology& topology, std::vector<std::array<Index, 2>> contact_bodies,
                         std::vector<std::uint8_t> moves, double rest_gap)
    : topology_(topology), contact_bodies_(std::move(contact_bodies)), moves_(std::move(moves)), rest_gap_(rest_gap) {
    find_features();
}

void HardContact::find_features() {
    first_triangle_of_vertex_.assign(at(topology_.vertex_count), -1);
    std::map<std::array<Index, 2>, Index> known;
    for (Index t = 0; t < topology_.triangle_count(); ++t) {
        edges_of_triangle_.emplace_back();
        for (int corner = 0; corner < 3; ++corner) {
            const Index a = topology_.triangles(corner, t);
            const Index b = topology_.triangles((corner + 1) % 3, t);
            if (first_triangle_of_vertex_[at(a)] < 0) first_triangle_of_vertex_[at(a)] = t;
            const auto [found, added] =
                known.emplace(std::array{std::min(a, b), std::max(a, b)}, static_cast<Index>(edges_.size()));
            if (added) {
                edges_.push_back(found->first);
                first_triangle_of_edge_.push_back(t);
            }
            edges_of_triangle_.back()[static_cast<std::size_t>(corner)] = found->second;
        }
    }
}

void HardContact::find_candidates(const Matrix3X& x, const Matrix3X& motion) {
    candidates_.clear();
    candidate_weight_.clear();
    boxes_.resize(at(topology_.triangle_count()));
    for (Index t = 0; t < topology_.triangle_count(); ++t) {
        Box box;
        for (int i = 0; i < 3; ++i) {
            const Index v = topology_.triangles(i, t);
            box.add(x.col(v));
            box.add(x.col(v) + motion.col(v));
        }
        boxes_[at(t)] = box.grown(rest_gap_);
    }
    for (const auto& [a, b] : contact_bodies_) {
        overlapping_boxes(boxes_, topology_.bodies[at(a)].triangles, topology_.bodies[at(b)].triangles, box_pairs_);
        for (const IndexPair& pair : box_pairs_) add_features(pair.first, pair.second);
    }
}

void HardContact::add_features(Index t, Index u) {
    const auto face = [&](Index triangle) { return topology_.triangles.col(triangle); };
    const auto add = [&](const FeaturePair& pair, double weight) {
        bool any_moves = false;
        for (const Index v : pair.vertex) any_moves = any_moves || moves_[at(v)] != 0;
        if (!any_moves) return;
        candidates_.push_back(pair);
        candidate_weight_.push_back(weight);
    };
    // All triangles of a feature near a face are near that face too: the first one stands for them.
    for (const auto& [from, to] : {std::pair{t, u}, std::pair{u, t}}) {
        for (int i = 0; i < 3; ++i) {
            const Index v = face(from)[i];
            if (first_triangle_of_vertex_[at(v)] != from) continue;
            add({FeaturePair::Kind::vertex_face, {v, face(to)[0], face(to)[1], face(to)[2]}}, 1.0);
        }
    }
    for (const Index e : edges_of_triangle_[at(t)]) {
        if (first_triangle_of_edge_[at(e)] != t) continue;
        for (const Index f : edges_of_triangle_[at(u)]) {
            if (first_triangle_of_edge_[at(f)] != u) continue;
            const FeaturePair pair{FeaturePair::Kind::edge_edge,
                                   {edges_[at(e)][0], edges_[at(e)][1], edges_[at(f)][0], edges_[at(f)][1]}};
            add(pair, edge_weight(pair));
        }
    }
}

/// Closest points of parallel edges are not unique; such pairs fade out (vertex-face pairs carry them), judged at the
/// start of the step so that the potential does not change under the solver.
double HardContact::edge_weight(const FeaturePair& pair) const {
    const auto point = [&](std::size_t i) { return start_.col(pair.vertex[i]); };
    const Vector3 a = point(1) - point(0);
    const Vector3 b = point(3) - point(2);
    const double square = a.cross(b).squaredNorm();
    const double limit = 1e-3 * a.squaredNorm() * b.squaredNorm();
    if (square >= limit) return 1.0;
    const double r = square / limit;
    return r * (2.0 - r);
}

double HardContact::energy(const Matrix3X& x, std::vector<ContactTerm>* terms, double& smallest_gap) const {
    double value = 0.0;
    if (terms != nullptr) smallest_gap = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
        const FeaturePair& pair = candidates_[c];
        const FeatureDistance near = distance_of(pair, points_of(pair, x));
        if (terms != nullptr) smallest_gap = std::min(smallest_gap, near.distance);
        if (near.distance >= rest_gap_ || candidate_weight_[c] == 0.0) continue;
        if (near.distance == 0.0) return std::numeric_limits<double>::infinity();
        const Barrier b = barrier(near.distance, rest_gap_);
        value += candidate_weight_[c] * b.value;
        if (terms == nullptr) continue;
        ContactTerm term;
        term.slope = candidate_weight_[c] * b.slope;
        term.curvature = candidate_weight_[c] * b.curvature;
        for (std::size_t i = 0; i < 4; ++i) {
            if (near.weight[i] == 0.0) continue;
            term.vertex.at(static_cast<std::size_t>(term.count)) = pair.vertex[i];
            term.gradient.at(static_cast<std::size_t>(term.count++)) = near.weight[i] * near.normal;
        }
        terms->push_back(term);
    }
    return value;
}

double HardContact::safe_part(const Matrix3X& x, const Matrix3X& motion) const {
    double part = 1.0;
    for (const FeaturePair& pair : candidates_) {
        part = std::min(part, safe_part_of_motion(pair, points_of(pair, x), points_of(pair, motion)));
    }
    return part;
}

}  // namespace trocar
