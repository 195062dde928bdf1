// Construction of the levels of RegionTissue. A greedy choice in balls selects the nodes of the next level. Each node
// is interpolated in the Delaunay triangle that contains it. Projection gives the stiffness.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "tissue/region_levels.hpp"

namespace trocar {
namespace {

constexpr double coarsening = 3.2;  // spacing of a level relative to the previous one
constexpr std::size_t most_candidates = 10;

/// Nodes connected to the centre of a ball by edges within the ball.
class Walk {
public:
    explicit Walk(const NodeLevel& level) : level_(&level), seen_(level.size(), 0) {}

    std::span<const Index> ball(Index from, double radius) {
        ++walk_;
        reached_.assign(1, from);
        seen_[at(from)] = walk_;
        for (std::size_t n = 0; n < reached_.size(); ++n) {
            const Index node = reached_[n];
            for (const std::uint32_t edge : level_->edges.of(node)) {
                const Index other = level_->other_end(edge, node);
                if (seen_[at(other)] == walk_) continue;
                seen_[at(other)] = walk_;
                if ((level_->rest[at(other)] - level_->rest[at(from)]).squaredNorm() < radius * radius) {
                    reached_.push_back(other);
                }
            }
        }
        return reached_;
    }

private:
    const NodeLevel* level_;
    std::vector<std::int64_t> seen_;
    std::vector<Index> reached_;
    std::int64_t walk_ = 0;
};

/// Chooses three of the candidates (squared distance, node) with weights of sum 1 that reproduce linear fields. They
/// form the triangle around the node, seen along the candidates' normal, of least weighted squared distance (Delaunay).
/// Without a triangle, takes the nearest point of an edge between two candidates.
void share_out(const NodeLevel& coarse, const Vector3& place, std::span<const std::pair<double, Index>> candidates,
               std::array<Index, 3>& parent, std::array<double, 3>& weight) {
    parent.fill(candidates.front().second);
    weight = {1.0, 0.0, 0.0};
    if (candidates.size() == 1 || candidates.front().first == 0.0) return;
    const std::size_t count = candidates.size();
    Matrix3 spread = Matrix3::Zero();
    for (const auto& [square, node] : candidates) {
        const Vector3 path = coarse.rest[at(node)] - place;
        spread += path * path.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Matrix3> axes(spread);
    const Vector3 first = axes.eigenvectors().col(2);
    const Vector3 second = axes.eigenvectors().col(1);
    std::array<Eigen::Vector2d, most_candidates> flat;
    for (std::size_t n = 0; n < count; ++n) {
        const Vector3 path = coarse.rest[at(candidates[n].second)] - place;
        flat[n] = {path.dot(first), path.dot(second)};
    }
    const auto cross = [&](std::size_t a, std::size_t b) {
        return flat[a].x() * flat[b].y() - flat[a].y() * flat[b].x();
    };
    constexpr double rounding = 1e-9;
    const double least_area = 1e-3 * candidates.back().first;
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < count; ++a) {
        for (std::size_t b = a + 1; b < count; ++b) {
            for (std::size_t c = b + 1; c < count; ++c) {
                const double area = cross(b, c) + cross(c, a) + cross(a, b);
                if (std::abs(area) < least_area) continue;
                const std::array<double, 3> part{cross(b, c) / area, cross(c, a) / area, cross(a, b) / area};
                if (std::min({part[0], part[1], part[2]}) < -rounding) continue;
                const double cost =
                    part[0] * candidates[a].first + part[1] * candidates[b].first + part[2] * candidates[c].first;
                if (cost >= best * (1.0 - rounding)) continue;
                best = cost;
                parent = {candidates[a].second, candidates[b].second, candidates[c].second};
                weight = part;
            }
        }
    }
    if (best < std::numeric_limits<double>::infinity()) return;
    for (std::size_t a = 0; a < count; ++a) {
        for (std::size_t b = a + 1; b < count; ++b) {
            const Vector3 along = coarse.rest[at(candidates[b].second)] - coarse.rest[at(candidates[a].second)];
            if (along.isZero(0.0)) continue;  // tissue folded onto itself
            const Vector3 path = place - coarse.rest[at(candidates[a].second)];
            const double part = std::clamp(path.dot(along) / along.squaredNorm(), 0.0, 1.0);
            const double cost = (path - part * along).squaredNorm();
            if (cost >= best * (1.0 - rounding)) continue;
            best = cost;
            parent = {candidates[a].second, candidates[b].second, candidates[a].second};
            weight = {1.0 - part, part, 0.0};
        }
    }
}

}  // namespace

RegionTissue::RegionTissue(MovingTissue& tissue, WrittenVertices& written, BodyBoxes& boxes, const Topology& topology,
                           const Matrix3X& rest, std::size_t fewest)
    : tissue_(&tissue), written_(&written), boxes_(&boxes) {
    build_vertices(rest);
    for (const Index vertex : tissue.state().vertex) body_of_.push_back(topology.body_of_vertex(vertex));
    std::size_t before = 0;
    while (levels_.size() < 2 || (levels_.back().size() > fewest && levels_.back().size() != before)) {
        before = levels_.back().size();
        build_next();
    }
    for (NodeLevel& level : levels_) {
        const bool last = &level == &levels_.back();
        const auto columns = static_cast<Eigen::Index>(level.size());
        level.whole_mass = level.mass;
        level.set_active(last);
        level.stamp.assign(level.size(), -1);
        level.displacement.setZero(4, columns);
        level.offset.setZero(4, &level == &levels_.front() ? 0 : columns);
        level.velocity.setZero(4, &level == &levels_.front() ? 0 : columns);
        level.force.setZero(4, columns);
    }
    std::size_t most_springs = 0;
    for (Index v = 0; at(v) < levels_.front().size(); ++v) {
        most_springs = std::max(most_springs, levels_.front().edges.of(v).size());
    }
    around_.reserve(most_springs);
    const std::size_t nodes = levels_.size() > 1 ? levels_[1].size() : 0;
    pulled_by_.setZero(4, eigen_index(nodes));
    is_pulled_.assign(nodes, 0);
    pulled_.reserve(nodes);
}

void RegionTissue::build_vertices(const Matrix3X& rest) {
    NodeLevel& vertices = levels_.emplace_back(level_of_vertices(*tissue_));
    const TissueState& state = tissue_->state();
    const SpringArrays& springs = tissue_->spring_arrays();
    springs_.resize(springs.size());
    for (std::size_t s = 0; s < springs.size(); ++s) {
        springs_[s].i = springs.i[s];
        springs_[s].j = springs.j[s];
        springs_[s].k = springs.k[s];
        springs_[s].offset = springs.offset[s];
        springs_[s].inverse_rest = springs.inverse_rest[s];
    }
    longest_edge_.assign(state.size(), 0.0);
    std::vector<double> lengths(state.size(), 0.0);
    std::vector<int> counts(state.size(), 0);
    vertices.rest.reserve(state.size());
    for (const Index vertex : state.vertex) vertices.rest.push_back(rest.col(vertex));
    for (std::size_t s = 0; s < springs.size(); ++s) {
        const double length = (vertices.rest[at(springs.i[s])] - vertices.rest[at(springs.j[s])]).norm();
        for (const Index end : {springs.i[s], springs.j[s]}) {
            longest_edge_[at(end)] = std::max(longest_edge_[at(end)], length);
            lengths[at(end)] += length;
            ++counts[at(end)];
        }
    }
    for (std::size_t v = 0; v < state.size(); ++v)
        vertices.spacing.push_back(counts[v] > 0 ? lengths[v] / counts[v] : 0.0);
}

void RegionTissue::build_next() {
    NodeLevel coarse;
    NodeLevel& fine = levels_.back();
    const std::vector<Index> chosen = choose(fine);
    for (const Index node : chosen) {
        coarse.rest.push_back(fine.rest[at(node)]);
        coarse.spacing.push_back(coarsening * fine.spacing[at(node)]);
        coarse.fixed.push_back(fine.fixed[at(node)]);
        coarse.piece.push_back(fine.piece[at(node)]);
    }
    find_parents(fine, coarse, chosen);
    project(fine, coarse);
    levels_.push_back(std::move(coarse));
}

/// Selects nodes at the spacing of the next level. Fixed nodes come first, so that a fixed border stays fixed.
std::vector<Index> RegionTissue::choose(const NodeLevel& fine) const {
    std::vector<Index> chosen;
    std::vector<std::uint8_t> near(fine.size(), 0);
    Walk walk(fine);
    for (const int fixed : {1, 0}) {
        for (Index node = 0; at(node) < fine.size(); ++node) {
            if (fine.fixed[at(node)] != fixed || near[at(node)] != 0) continue;
            chosen.push_back(node);
            constexpr double overlap = 0.93;
            for (const Index other : walk.ball(node, overlap * coarsening * fine.spacing[at(node)]))
                near[at(other)] = 1;
        }
    }
    return chosen;
}

void RegionTissue::find_parents(NodeLevel& fine, const NodeLevel& coarse, const std::vector<Index>& chosen) const {
    std::vector<Index> number(fine.size(), -1);
    for (std::size_t n = 0; n < chosen.size(); ++n) number[at(chosen[n])] = static_cast<Index>(n);
    fine.parent.resize(fine.size());
    fine.weight.resize(fine.size());
    Walk walk(fine);
    std::vector<std::pair<double, Index>> candidates;
    for (Index node = 0; at(node) < fine.size(); ++node) {
        const bool fixed = fine.fixed[at(node)] != 0;
        candidates.clear();
        for (double radius = 2.0 * coarsening * fine.spacing[at(node)]; candidates.empty(); radius *= 2.0) {
            for (const Index other : walk.ball(node, radius)) {
                const Index near = number[at(other)];
                if (near < 0 || (fixed && coarse.fixed[at(near)] == 0)) continue;
                candidates.emplace_back((fine.rest[at(other)] - fine.rest[at(node)]).squaredNorm(), near);
            }
            if (radius == 0.0) radius = std::numeric_limits<double>::min();
        }
        std::sort(candidates.begin(), candidates.end());
        candidates.resize(fixed ? 1 : std::min(candidates.size(), most_candidates));
        share_out(coarse, fine.rest[at(node)], candidates, fine.parent[at(node)], fine.weight[at(node)]);
        // Weights at the level of rounding would couple a node to nodes without effect on it.
        constexpr double least = 1e-4;
        double sum = 0.0;
        for (double& weight : fine.weight[at(node)]) sum += weight = weight < least ? 0.0 : weight;
        for (double& weight : fine.weight[at(node)]) weight /= sum;
    }
}

/// Projects mass, drag and the blocks of the edges on the next level.
void RegionTissue::project(const NodeLevel& fine, NodeLevel& coarse) const {
    const std::size_t count = coarse.rest.size();
    const std::size_t level = levels_.size() - 1;
    coarse.mass.assign(count, 0.0);
    coarse.drag.assign(count, 0.0);
    for (Index node = 0; at(node) < fine.size(); ++node) {
        for (std::size_t n = 0; n < 3; ++n) {
            const double weight = fine.weight[at(node)][n];
            if (weight == 0.0) continue;
            coarse.mass[at(fine.parent[at(node)][n])] += weight * fine.mass[at(node)];
            coarse.drag[at(fine.parent[at(node)][n])] += weight * fine.drag[at(node)];
        }
    }

    std::vector<std::vector<std::pair<Index, std::uint32_t>>> rows(count);  // edges by their first end
    for (std::uint32_t edge = 0; edge < fine.i.size(); ++edge) {
        const SymmetricBlock stiffness = stiffness_of(level, edge);
        const SymmetricBlock damping = damping_of(level, edge);
        const EdgeShares weights(fine, edge);
        for (std::size_t a = 0; a < weights.count; ++a) {
            for (std::size_t b = a + 1; b < weights.count; ++b) {
                const Index low = std::min(weights.node[a], weights.node[b]);
                const Index high = std::max(weights.node[a], weights.node[b]);
                auto& row = rows[at(low)];
                auto known =
                    std::find_if(row.begin(), row.end(), [&](const auto& entry) { return entry.first == high; });
                if (known == row.end()) {
                    row.emplace_back(high, static_cast<std::uint32_t>(coarse.i.size()));
                    known = row.end() - 1;
                    coarse.i.push_back(low);
                    coarse.j.push_back(high);
                    coarse.stiffness.emplace_back();
                    coarse.damping.emplace_back();
                }
                const double factor = -weights.factor[a] * weights.factor[b];
                add_scaled(factor, stiffness, coarse.stiffness[known->second]);
                add_scaled(factor, damping, coarse.damping[known->second]);
            }
        }
    }
    coarse.list_edges();
}

}  // namespace trocar
