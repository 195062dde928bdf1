#include "tissue/region_levels.hpp"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace trocar {
namespace {

Eigen::Vector4d multiply(const SymmetricBlock& block, const Eigen::Vector4d& by) {
    return {block[0] * by[0] + block[1] * by[1] + block[2] * by[2],
            block[1] * by[0] + block[3] * by[1] + block[4] * by[2],
            block[2] * by[0] + block[4] * by[1] + block[5] * by[2], 0.0};
}

std::uint32_t edge_between(const NodeLevel& level, Index a, Index b) {
    const std::span<const std::uint32_t> edges = level.edges.of(a);
    return *std::find_if(edges.begin(), edges.end(), [&](std::uint32_t edge) { return level.other_end(edge, a) == b; });
}

}  // namespace

/// Interpolates the motion of a node from the next level, which it updates first.
RegionTissue::Carried RegionTissue::carried(std::size_t level, Index node) {
    const NodeLevel& fine = levels_[level];
    Carried sum;
    for (std::size_t n = 0; n < 3; ++n) {
        const double weight = fine.weight[at(node)][n];
        if (weight == 0.0) continue;
        const Index parent = fine.parent[at(node)][n];
        refresh(level + 1, parent);
        sum.displacement += weight * levels_[level + 1].displacement.col(parent);
        sum.velocity += weight * levels_[level + 1].velocity.col(parent);
    }
    return sum;
}

void RegionTissue::refresh(std::size_t level, Index node) {
    NodeLevel& fine = levels_[level];
    if (fine.active[at(node)] != 0 || fine.fixed[at(node)] != 0 || fine.stamp[at(node)] == moment_) return;
    fine.stamp[at(node)] = moment_;
    const auto [displacement, velocity] = carried(level, node);
    if (level > 0) {
        fine.displacement.col(node) = displacement + fine.offset.col(node);
        fine.velocity.col(node) = velocity;
        return;
    }
    fine.displacement.col(node) = displacement;
    auto place = tissue_->state().position.col(node);
    const Vector3 before = place.head<3>();
    place = anchor_.col(node) + displacement;
    furthest_ = further(node, before, furthest_);
    written_->mark(node);
    ++put_;
    tissue_->state().velocity.col(node) = velocity;
}

void RegionTissue::complete(Frame& frame) const {
    Matrix4X displacement = levels_.back().displacement;
    Matrix4X velocity = levels_.back().velocity;
    for (std::size_t level = levels_.size() - 1; level-- > 0;) {
        const NodeLevel& fine = levels_[level];
        Matrix4X fine_displacement = fine.displacement;
        Matrix4X fine_velocity = level > 0 ? fine.velocity : tissue_->state().velocity;
        for (std::size_t node = 0; node < fine.size(); ++node) {
            if (fine.active[node] != 0 || fine.fixed[node] != 0) continue;
            const auto to = static_cast<Eigen::Index>(node);
            fine_displacement.col(to).setZero();
            if (level > 0) fine_displacement.col(to) = fine.offset.col(to);
            fine_velocity.col(to).setZero();
            for (std::size_t n = 0; n < 3; ++n) {
                const double weight = fine.weight[node][n];
                if (weight == 0.0) continue;
                fine_displacement.col(to) += weight * displacement.col(fine.parent[node][n]);
                fine_velocity.col(to) += weight * velocity.col(fine.parent[node][n]);
            }
        }
        displacement.swap(fine_displacement);
        velocity.swap(fine_velocity);
    }
    const TissueState& state = tissue_->state();
    for (std::size_t v = 0; v < state.size(); ++v) {
        if (levels_[0].active[v] != 0 || levels_[0].fixed[v] != 0) continue;
        const auto local = static_cast<Eigen::Index>(v);
        frame.position.col(state.vertex[v]) = (anchor_.col(local) + displacement.col(local)).head<3>();
        frame.velocity.col(state.vertex[v]) = velocity.col(local).head<3>();
    }
}

SymmetricBlock RegionTissue::stiffness_of(std::size_t level, std::uint32_t edge) const {
    const NodeLevel& fine = levels_[level];
    if (level > 0) return fine.stiffness[edge];
    const NearSpring& spring = springs_[edge];
    const Vector3 path = fine.rest[at(spring.j)] - fine.rest[at(spring.i)];
    const double length = path.norm();
    if (length == 0.0) return {};
    const double tension = spring.k * length + spring.offset;
    return block_of(path / length, spring.k, std::max(0.0, tension / length));
}

SymmetricBlock RegionTissue::damping_of(std::size_t level, std::uint32_t edge) const {
    const NodeLevel& fine = levels_[level];
    if (level > 0) return fine.damping[edge];
    const Vector3 path = fine.rest[at(fine.j[edge])] - fine.rest[at(fine.i[edge])];
    const double length = path.norm();
    return length == 0.0 ? SymmetricBlock{} : block_of(path / length, tissue_->spring_arrays().damping[edge], 0.0);
}

/// Force of a spring on its i at the current state.
Eigen::Vector4d RegionTissue::pull(std::uint32_t edge) const {
    const NearSpring& spring = springs_[edge];
    const Matrix4X& position = tissue_->state().position;
    const Eigen::Vector4d path = position.col(spring.j) - position.col(spring.i);
    const double length = path.norm();
    if (length == 0.0) return Eigen::Vector4d::Zero();
    return (spring.k + spring.offset / length) * path;
}

/// Adds an edge with two interpolated ends to the levels above; `sign` -1 removes it. Above level 0 the force by the
/// offsets of its ends is added as well.
void RegionTissue::add_edge(std::size_t level, std::uint32_t edge, const SymmetricBlock& stiffness,
                            const SymmetricBlock& damping, double sign) {
    const NodeLevel& fine = levels_[level];
    NodeLevel& coarse = levels_[level + 1];
    if (level > 0) {
        const Index i = fine.i[edge];
        const Index j = fine.j[edge];
        const Eigen::Vector4d force = sign * multiply(stiffness, fine.offset.col(j) - fine.offset.col(i));
        add_force(level, i, force);
        add_force(level, j, -force);
    }
    const EdgeShares weights(fine, edge);
    for (std::size_t a = 0; a < weights.count; ++a) {
        for (std::size_t b = a + 1; b < weights.count; ++b) {
            const double factor = -sign * weights.factor[a] * weights.factor[b];
            const std::uint32_t into = edge_between(coarse, weights.node[a], weights.node[b]);
            SymmetricBlock more{};
            SymmetricBlock damped{};
            add_scaled(factor, stiffness, more);
            add_scaled(factor, damping, damped);
            add(more, coarse.stiffness[into]);
            add(damped, coarse.damping[into]);
            if (coarse.active[at(weights.node[a])] == 0 && coarse.active[at(weights.node[b])] == 0) {
                add_edge(level + 1, into, more, damped, 1.0);
            }
        }
    }
}

void RegionTissue::add_mass(std::size_t level, Index node, double mass, double drag) {
    NodeLevel& here = levels_[level];
    here.mass[at(node)] += mass;
    here.drag[at(node)] += drag;
    if (here.active[at(node)] != 0) return;
    for (std::size_t n = 0; n < 3; ++n) {
        const double weight = here.weight[at(node)][n];
        if (weight != 0.0) add_mass(level + 1, here.parent[at(node)][n], weight * mass, weight * drag);
    }
}

void RegionTissue::add_force(std::size_t level, Index node, const Eigen::Vector4d& force) {
    NodeLevel& here = levels_[level];
    if (level > 0) here.force.col(node) += force;
    if (level > 0 && here.active[at(node)] != 0) return;
    for (std::size_t n = 0; n < 3; ++n) {
        const double weight = here.weight[at(node)][n];
        if (weight != 0.0) add_force(level + 1, here.parent[at(node)][n], weight * force);
    }
}

/// Adds a force change of a spring with two interpolated ends; `report_pulls` restricts it from level 1.
void RegionTissue::add_pull(std::uint32_t spring, const Eigen::Vector4d& pull) {
    add_pull_at(levels_[0].i[spring], pull);
    add_pull_at(levels_[0].j[spring], -pull);
}

void RegionTissue::add_pull_at(Index vertex, const Eigen::Vector4d& force) {
    const NodeLevel& vertices = levels_[0];
    for (std::size_t n = 0; n < 3; ++n) {
        const double weight = vertices.weight[at(vertex)][n];
        if (weight == 0.0) continue;
        const Index node = vertices.parent[at(vertex)][n];
        if (is_pulled_[at(node)] == 0) {
            is_pulled_[at(node)] = 1;
            pulled_.push_back(node);
        }
        pulled_by_.col(node) += weight * force;
    }
}

void RegionTissue::report_pulls() {
    for (const Index node : pulled_) {
        add_force(1, node, pulled_by_.col(node));
        pulled_by_.col(node).setZero();
        is_pulled_[at(node)] = 0;
    }
    pulled_.clear();
}

void RegionTissue::add_momentum(std::size_t level, Index node, const Eigen::Vector4d& momentum) {
    NodeLevel& here = levels_[level];
    if (here.fixed[at(node)] != 0) return;
    if (here.active[at(node)] != 0) {
        here.velocity.col(node) += momentum / here.mass[at(node)];
        return;
    }
    for (std::size_t n = 0; n < 3; ++n) {
        const double weight = here.weight[at(node)][n];
        if (weight != 0.0) add_momentum(level + 1, here.parent[at(node)][n], weight * momentum);
    }
}

/// Linearises an interpolated spring at the current state.
void RegionTissue::take_pull(std::uint32_t spring, const SymmetricBlock& stiffness) {
    const NodeLevel& vertices = levels_[0];
    const Eigen::Vector4d apart =
        vertices.displacement.col(vertices.j[spring]) - vertices.displacement.col(vertices.i[spring]);
    const Eigen::Vector4d now = pull(spring) - multiply(stiffness, apart);
    add_pull(spring, now - springs_[spring].pull);
    springs_[spring].pull = now;
}

void RegionTissue::activate(std::size_t level, Index node) {
    NodeLevel& fine = levels_[level];
    if (fine.active[at(node)] != 0 || fine.fixed[at(node)] != 0) return;
    refresh(level, node);
    for (const std::uint32_t edge : fine.edges.of(node)) {
        if (fine.active[at(fine.other_end(edge, node))] != 0) continue;
        add_edge(level, edge, stiffness_of(level, edge), damping_of(level, edge), -1.0);
        if (level > 0) continue;
        add_pull(edge, -springs_[edge].pull);
        springs_[edge].pull.setZero();
    }
    for (std::size_t n = 0; n < 3; ++n) {
        const double weight = fine.weight[at(node)][n];
        if (weight == 0.0) continue;
        const Index parent = fine.parent[at(node)][n];
        add_mass(level + 1, parent, -weight * fine.mass[at(node)], -weight * fine.drag[at(node)]);
        add_force(level + 1, parent, -weight * fine.force.col(node));
    }
    fine.active[at(node)] = 1;
    fine.active_at[at(node)] = static_cast<Index>(fine.active_nodes.size());
    fine.active_nodes.push_back(node);
    report_pulls();
    changed_ = true;
}

void RegionTissue::interpolate(std::size_t level, Index node) {
    NodeLevel& fine = levels_[level];
    if (fine.active[at(node)] == 0 || level + 1 == levels_.size()) return;
    TissueState& state = tissue_->state();
    const auto [displacement, velocity] = carried(level, node);
    fine.active[at(node)] = 0;
    fine.stamp[at(node)] = moment_;
    fine.active_nodes[at(fine.active_at[at(node)])] = fine.active_nodes.back();
    fine.active_at[at(fine.active_nodes.back())] = fine.active_at[at(node)];
    fine.active_nodes.pop_back();
    const Eigen::Vector4d own = level == 0 ? state.velocity.col(node) : fine.velocity.col(node);
    Eigen::Vector4d left = Eigen::Vector4d::Zero();
    if (level == 0 || fine.has_a_say(node)) left = fine.mass[at(node)] * (own - velocity);
    for (std::size_t n = 0; n < 3; ++n) {
        const double weight = fine.weight[at(node)][n];
        if (weight == 0.0) continue;
        const Index parent = fine.parent[at(node)][n];
        add_mass(level + 1, parent, weight * fine.mass[at(node)], weight * fine.drag[at(node)]);
        add_force(level + 1, parent, weight * fine.force.col(node));
    }
    for (std::size_t n = 0; n < 3; ++n) {
        const double weight = fine.weight[at(node)][n];
        if (weight != 0.0) add_momentum(level + 1, fine.parent[at(node)][n], weight * left);
    }
    if (level == 0) {
        anchor_.col(node) = state.position.col(node) - displacement;
        state.velocity.col(node) = velocity;
        fine.displacement.col(node) = displacement;
        written_->mark(node);
    } else {
        fine.velocity.col(node) = velocity;
        fine.offset.col(node) = fine.displacement.col(node) - displacement;
    }
    for (const std::uint32_t edge : fine.edges.of(node)) {
        const Index other = fine.other_end(edge, node);
        if (fine.active[at(other)] != 0) continue;
        const SymmetricBlock stiffness = stiffness_of(level, edge);
        add_edge(level, edge, stiffness, damping_of(level, edge), 1.0);
        if (level > 0) continue;
        refresh(0, other);
        take_pull(edge, stiffness);
    }
    report_pulls();
    ++moment_;  // the momentum changed other nodes, so their interpolated nodes are out of date
    changed_ = true;
}

double RegionTissue::relax(Index vertex) {
    NodeLevel& vertices = levels_[0];
    if (vertices.active[at(vertex)] != 0 || vertices.fixed[at(vertex)] != 0) return 0.0;
    TissueState& state = tissue_->state();
    const std::span<const std::uint32_t> edges = vertices.edges.of(vertex);
    for (const std::uint32_t edge : edges) hwy::Prefetch(&springs_[edge]);
    refresh(0, vertex);
    Eigen::Vector4d force = vertices.force.col(vertex);
    SymmetricBlock block{};
    double stretch = 0.0;
    around_.clear();
    for (const std::uint32_t edge : edges) {
        const NearSpring& spring = springs_[edge];
        const Index other = spring.other_end(vertex);
        refresh(0, other);
        const Eigen::Vector4d path = state.position.col(other) - state.position.col(vertex);
        const double length = path.norm();
        stretch = std::max(stretch, length * spring.inverse_rest);
        const double per_length = length == 0.0 ? 0.0 : spring.k + spring.offset / length;
        const SymmetricBlock now =
            length == 0.0 ? SymmetricBlock{} : block_of(path.head<3>() / length, spring.k, std::max(0.0, per_length));
        around_.push_back({stiffness_of(0, edge), now, per_length * path});
        force += around_.back().pull;
        add(now, block);
    }
    Eigen::Vector4d relaxed = Eigen::Vector4d::Zero();
    constexpr double over = 1.7;  // successive over-relaxation; a factor below 2 removes energy in every step
    const Matrix3 whole = full(block);
    if (whole.determinant() > 0.0) {
        relaxed.head<3>() = over * whole.inverse() * force.head<3>();
        const Vector3 before = state.position.col(vertex).head<3>();
        anchor_.col(vertex) += relaxed;
        state.position.col(vertex) += relaxed;
        written_->mark(vertex);
        relaxed_ = further(vertex, before, relaxed_);
    }
    // New forces of the interpolated springs: the previous ones minus the effect of the vertex's displacement.
    Eigen::Vector4d more = Eigen::Vector4d::Zero();
    for (std::size_t n = 0; n < around_.size(); ++n) {
        NearSpring& spring = springs_[edges[n]];
        const Index other = spring.other_end(vertex);
        if (vertices.active[at(other)] != 0) continue;
        const Eigen::Vector4d apart = vertices.displacement.col(other) - vertices.displacement.col(vertex);
        const double sense = spring.i == vertex ? 1.0 : -1.0;
        const Eigen::Vector4d now =
            sense * (around_[n].pull - multiply(around_[n].now, relaxed) - multiply(around_[n].at_rest, apart));
        const Eigen::Vector4d change = sense * (now - spring.pull);
        spring.pull = now;
        add_pull_at(other, -change);
        more += change;
    }
    add_pull_at(vertex, more);
    return stretch;
}

double RegionTissue::further(Index vertex, const Vector3& from, double path) {
    const Vector3 now = tissue_->state().position.col(vertex).head<3>();
    const Index body = body_of_[at(vertex)];
    if (boxes_->has_opposite_tissue(body)) boxes_->extend(body, now);
    const double square = (now - from).squaredNorm();
    if (square <= path * path) return path;
    // The surface around a vertex may meet a body that the vertex itself does not come near.
    return boxes_->may_meet(body, from, now, 2.0 * longest_edge_[at(vertex)]) ? std::sqrt(square) : path;
}

bool RegionTissue::is_beside_others(Index vertex, double distance) const {
    constexpr double edges = 3.0;  // one more than in `further`
    const Vector3 place = tissue_->state().position.col(vertex).head<3>();
    return boxes_->may_meet(body_of_[at(vertex)], place, place, distance + edges * longest_edge_[at(vertex)]);
}

double RegionTissue::take_path() {
    const double path = path_ + furthest_ + relaxed_;
    path_ = furthest_ = relaxed_ = 0.0;
    return path;
}

void RegionTissue::start() {
    // Restricts mass, drag and edges of the active nodes. Positions and forces are recomputed below.
    for (NodeLevel& level : levels_) level.offset.setZero();
    for (std::size_t level = 0; level + 1 < levels_.size(); ++level) {
        NodeLevel& here = levels_[level];
        for (const Index node : here.active_nodes) {
            here.active[at(node)] = 0;
            for (std::size_t n = 0; n < 3; ++n) {
                const double weight = here.weight[at(node)][n];
                if (weight == 0.0) continue;
                add_mass(level + 1, here.parent[at(node)][n], weight * here.mass[at(node)],
                         weight * here.drag[at(node)]);
            }
            for (const std::uint32_t edge : here.edges.of(node)) {
                if (here.active[at(here.other_end(edge, node))] != 0) continue;
                add_edge(level, edge, stiffness_of(level, edge), damping_of(level, edge), 1.0);
            }
        }
        here.active_nodes.clear();
    }
    // Vertices take displacement and velocity from the levels above at their next update.
    for (std::size_t level = 1; level < levels_.size(); ++level) {
        NodeLevel& here = levels_[level];
        here.displacement.setZero();
        here.velocity.setZero();
        here.force.setZero();
    }
    ++moment_;
    const TissueState& state = tissue_->state();
    anchor_ = state.position;
    levels_[0].force.setZero();
    const Matrix3X& bias = tissue_->materials().rest_bias;
    for (std::size_t v = 0; v < state.size(); ++v) {
        const auto column = static_cast<Index>(v);
        if (state.vertex[v] < bias.cols()) levels_[0].force.col(column).head<3>() = bias.col(state.vertex[v]);
        add_force(0, column, levels_[0].force.col(column));
    }
    for (std::uint32_t s = 0; s < springs_.size(); ++s) {
        springs_[s].pull = pull(s);
        add_pull(s, springs_[s].pull);
    }
    report_pulls();
    changed_ = true;
}

bool RegionTissue::take_changed() {
    const bool changed = changed_;
    changed_ = false;
    return changed;
}

}  // namespace trocar
