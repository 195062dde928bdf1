#include "tissue/implicit_system.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar {
namespace {

void take(const SymmetricBlock& block, SystemEdge& edge) {
    const auto xx = static_cast<float>(block[0]);
    const auto xy = static_cast<float>(block[1]);
    const auto xz = static_cast<float>(block[2]);
    const auto yy = static_cast<float>(block[3]);
    const auto yz = static_cast<float>(block[4]);
    const auto zz = static_cast<float>(block[5]);
    edge.block = {xx, xy, xz, 0.0F, xy, yy, yz, 0.0F, xz, yz, zz, 0.0F};
}

void add_inertia(double inertia, SymmetricBlock& to) {
    for (const std::size_t n : {0U, 3U, 5U}) to[n] += inertia;
}

}  // namespace

ImplicitSystem::ImplicitSystem(MovingTissue& tissue, std::vector<NodeLevel>& levels)
    : tissue_(&tissue), levels_(&levels), kernels_(&system_kernels().front()) {
    std::size_t nodes = 1;
    std::size_t coarse_edges = 0;
    for (const NodeLevel& level : levels) {
        number_.emplace_back(level.size(), -1);
        nodes += level.size();
        coarse_edges += level.stiffness.size();
    }
    const std::size_t springs = levels.front().i.size();
    nodes_.reserve(nodes);
    ghosts_.reserve(nodes);
    edges_.reserve(springs + coarse_edges);
    springs_.reserve(springs);
    stiff_edges_.reserve(coarse_edges);
    pulled_ghosts_.reserve(nodes);
    pulled_nodes_.reserve(nodes);
    is_pulled_.reserve(nodes);
    inertia_.reserve(nodes);
    block_.assign(nodes, {});
    far_block_.assign(nodes, {});
    inverse_.assign(12 * nodes, 0.0);
    for (Matrix4X* vector : {&right_side_, &whole_right_side_, &change_, &residual_, &preconditioned_, &direction_,
                             &image_, &place_, &speed_, &start_change_, &start_residual_}) {
        vector->setZero(4, eigen_index(nodes));
    }
    const Index pieces = levels.front().pieces();
    left_.setZero(3, pieces);
    piece_inertia_.assign(at(pieces), 0.0);
    constexpr std::size_t usual_contacts = 512;
    rows_.reserve(usual_contacts);
    moved_.reserve(usual_contacts);
    pressed_.reserve(usual_contacts);
    coupled_.reserve(usual_contacts);
    coupling_.setZero(eigen_index(most_coupled), eigen_index(most_coupled));
    coupled_push_.setZero(eigen_index(most_coupled));
    start_.reserve(levels.front().size());
    near_block_.reserve(levels.front().size());
    loose_inverse_.reserve(levels.front().size());
}

Index ImplicitSystem::number_of(std::size_t level, Index node) {
    Index& known = number_[level][at(node)];
    if (known < 0) {
        known = static_cast<Index>(nodes_.size());
        nodes_.push_back({static_cast<std::uint32_t>(level), node});
    }
    return known;
}

/// Lists the active nodes, their ghosts, and the edges with an active end.
void ImplicitSystem::list(double h) {
    const std::vector<NodeLevel>& levels = *levels_;
    for (const Node& entry : nodes_) number_[entry.level][at(entry.node)] = -1;
    nodes_.clear();
    ghosts_.clear();
    edges_.clear();
    springs_.clear();
    stiff_edges_.clear();
    inertia_.clear();
    for (std::size_t level = 0; level < levels.size(); ++level) {
        for (const Index node : levels[level].active_nodes) {
            if (level == 0 || levels[level].has_a_say(node)) number_of(level, node);
        }
    }
    active_ = nodes_.size();
    std::size_t first = active_;
    for (std::size_t level = 0; level < levels.size(); ++level) {
        const NodeLevel& here = levels[level];
        for (std::size_t n = 0; n < active_; ++n) {
            if (nodes_[n].level != level) continue;
            const Index node = nodes_[n].node;
            for (const std::uint32_t edge : here.edges.of(node)) {
                const Index other = here.other_end(edge, node);
                if (here.active[at(other)] == 0 && here.fixed[at(other)] == 0) number_of(level, other);
            }
        }
        const std::size_t end = nodes_.size();
        for (std::size_t n = first; n < end; ++n) {
            if (nodes_[n].level != level) continue;
            for (std::size_t p = 0; p < 3; ++p) {
                const Index parent = here.parent[at(nodes_[n].node)][p];
                if (here.weight[at(nodes_[n].node)][p] == 0.0 || levels[level + 1].fixed[at(parent)] != 0) continue;
                if (levels[level + 1].active[at(parent)] == 0) number_of(level + 1, parent);
            }
        }
    }
    const std::size_t still = nodes_.size();
    for (std::size_t level = 0; level < levels.size(); ++level) {
        for (std::size_t n = active_; n < still; ++n) {
            if (nodes_[n].level != level) continue;
            Ghost ghost{.number = n, .parent = {still, still, still}};
            for (std::size_t p = 0; p < 3; ++p) {
                const Index parent = levels[level].parent[at(nodes_[n].node)][p];
                // An active parent without a number has only rounding for mass; it and its force are ignored.
                if (levels[level + 1].fixed[at(parent)] != 0 || number_[level + 1][at(parent)] < 0) continue;
                ghost.weight[p] = levels[level].weight[at(nodes_[n].node)][p];
                if (ghost.weight[p] != 0.0) ghost.parent[p] = at(number_[level + 1][at(parent)]);
            }
            ghosts_.push_back(ghost);
        }
    }
    for (std::size_t n = 0; n < active_; ++n) {
        const NodeLevel& here = levels[nodes_[n].level];
        const Index node = nodes_[n].node;
        inertia_.push_back(here.mass[at(node)] + h * here.drag[at(node)]);
    }
    std::fill_n(far_block_.begin(), still + 1, SymmetricBlock{});
    for (std::size_t n = 0; n < active_; ++n) {
        const std::size_t level = nodes_[n].level;
        const NodeLevel& here = levels[level];
        const Index node = nodes_[n].node;
        for (const std::uint32_t edge : here.edges.of(node)) {
            const Index other = here.other_end(edge, node);
            const bool no_part = here.fixed[at(other)] != 0 || number_[level][at(other)] < 0;
            const std::size_t to = no_part ? still : at(number_[level][at(other)]);
            if (to < n) continue;  // listed with the other end
            SystemEdge& entry = edges_.emplace_back();
            entry.own = static_cast<Index>(n);
            entry.other = static_cast<Index>(to);
            if (level == 0) {
                const SpringArrays& all = tissue_->spring_arrays();
                springs_.push_back({.i = all.i[edge],
                                    .j = all.j[edge],
                                    .k = all.k[edge],
                                    .offset = all.offset[edge],
                                    .damping = all.damping[edge],
                                    .inverse_rest = all.inverse_rest[edge],
                                    .sense = all.i[edge] == node ? 1.0 : -1.0});
            } else {
                SymmetricBlock stiffness{};
                SymmetricBlock block{};
                add_scaled(h, here.stiffness[edge], stiffness);
                add_scaled(h, here.damping[edge], block);
                add_scaled(h, stiffness, block);
                SystemEdge& stiff = stiff_edges_.emplace_back();
                stiff.own = entry.own;
                stiff.other = entry.other;
                take(stiffness, stiff);
                take(block, entry);
                add(block, far_block_[n]);
                add(block, far_block_[to]);
            }
        }
    }
    for (Matrix4X* vector : {&change_, &direction_, &place_, &speed_}) vector->col(eigen_index(still)).setZero();
    const auto is_vertex = [](const Node& node) { return node.level == 0; };
    const auto end = nodes_.begin() + static_cast<std::ptrdiff_t>(active_);
    vertices_ = {static_cast<std::size_t>(std::count_if(nodes_.begin(), end, is_vertex)), springs_.size()};
    everything_ = {active_, edges_.size()};
    sort_blocks();
    listed_for_ = h;
}

/// Separates the blocks with springs, direct or through ghosts, from the others, which stay constant.
void ImplicitSystem::sort_blocks() {
    is_pulled_.assign(nodes_.size() + 1, 0);
    for (std::size_t n = 0; n < nodes_.size(); ++n) is_pulled_[n] = nodes_[n].level == 0 ? 1 : 0;
    pulled_ghosts_.clear();
    for (const Ghost& ghost : ghosts_) {
        const bool pulled = is_pulled_[ghost.number] != 0;
        if (pulled) pulled_ghosts_.push_back(ghost);
        for (std::size_t p = 0; p < 3; ++p) {
            if (ghost.weight[p] == 0.0) continue;
            if (pulled) {
                is_pulled_[ghost.parent[p]] = 1;
            } else {
                add_scaled(ghost.weight[p] * ghost.weight[p], far_block_[ghost.number], far_block_[ghost.parent[p]]);
            }
        }
    }
    pulled_nodes_.clear();
    for (std::size_t n = 0; n < active_; ++n) {
        if (is_pulled_[n] != 0) {
            pulled_nodes_.push_back(n);
        } else {
            SymmetricBlock block = far_block_[n];
            add_inertia(inertia_[n], block);
            invert(n, full(block));
        }
    }
}

void ImplicitSystem::linearise() {
    const double h = listed_for_;
    const std::vector<NodeLevel>& levels = *levels_;
    TissueState& state = tissue_->state();
    Matrix4X& right = whole_right_side_;
    const auto columns = eigen_index(nodes_.size() + 1);
    right.leftCols(columns).setZero();
    image_.leftCols(columns).setZero();
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        const auto number = eigen_index(n);
        const NodeLevel& here = levels[nodes_[n].level];
        const Index node = nodes_[n].node;
        if (nodes_[n].level == 0) {
            if (n >= active_) continue;
            right.col(number) = h * (state.constant.col(node) - here.drag[at(node)] * state.velocity.col(node));
            continue;
        }
        place_.col(number) = here.displacement.col(node);
        speed_.col(number) = here.velocity.col(node);
        if (n < active_) right.col(number) = h * (here.force.col(node) - here.drag[at(node)] * speed_.col(number));
    }
    kernels_->multiply(stiff_edges_, place_.data(), image_.data());
    kernels_->multiply(std::span(edges_).subspan(springs_.size()), speed_.data(), image_.data());
    right.leftCols(columns) -= image_.leftCols(columns);
    for (const std::size_t n : pulled_nodes_) block_[n] = far_block_[n];
    for (const Ghost& ghost : pulled_ghosts_) block_[ghost.number] = far_block_[ghost.number];
    block_[nodes_.size()] = {};
    for (std::size_t s = 0; s < springs_.size(); ++s) {
        const SystemSpring& spring = springs_[s];
        const Index i = spring.i;
        const Index j = spring.j;
        const Vector3 path = (state.position.col(j) - state.position.col(i)).head<3>();
        const double length = path.norm();
        const double inverse = length == 0.0 ? 0.0 : 1.0 / length;
        const Vector3 u = inverse * path;
        const double tension = length == 0.0 ? 0.0 : spring.k * length + spring.offset;
        const double beta = std::max(0.0, h * h * tension * inverse);
        const double alpha = length == 0.0 ? 0.0 : h * (spring.damping + h * spring.k) - beta;
        const Vector3 still = Vector3::Zero();
        // A vertex that is held in the step keeps its position, whatever its velocity.
        const Vector3 vi = state.velocity.col(i).head<3>();
        const Vector3 vj = state.velocity.col(j).head<3>();
        const Vector3 opening = (state.moves(j) ? vj : still) - (state.moves(i) ? vi : still);
        const double closing = (vj - vi).dot(u);
        const Vector3 push =
            (h * (tension + spring.damping * closing) + (h * h * spring.k - beta) * opening.dot(u)) * u +
            beta * opening;
        SystemEdge& edge = edges_[s];
        right.col(edge.own).head<3>() += spring.sense * push;
        right.col(edge.other).head<3>() -= spring.sense * push;
        const SymmetricBlock block = block_of(u, alpha + beta, beta);
        take(block, edge);
        add(block, block_[at(edge.own)]);
        add(block, block_[at(edge.other)]);
    }
    restrict_to_coarse(right);
    take_enclosures(right);
    for (const Ghost& ghost : pulled_ghosts_) {
        for (std::size_t p = 0; p < 3; ++p) {
            add_scaled(ghost.weight[p] * ghost.weight[p], block_[ghost.number], block_[ghost.parent[p]]);
        }
    }
    for (const std::size_t n : pulled_nodes_) {
        if (nodes_[n].level == 0 && !state.moves(nodes_[n].node)) {
            std::fill_n(inverse_.begin() + static_cast<std::ptrdiff_t>(12 * n), 12, 0.0);
            right.col(eigen_index(n)).setZero();
            continue;
        }
        add_inertia(inertia_[n], block_[n]);
        invert(n, full(block_[n]));
    }
    change_.leftCols(eigen_index(nodes_.size() + 1)).setZero();
}

/// Linearises the enclosures and subtracts h² K v from a right side. Their forces are in the state's constant forces.
void ImplicitSystem::take_enclosures(Matrix4X& right) {
    VolumeForces& volumes = tissue_->volumes();
    if (volumes.none()) return;
    const TissueState& state = tissue_->state();
    volumes.linearise(state.position.topRows<3>());
    const auto columns = eigen_index(nodes_.size() + 1);
    image_.leftCols(columns).setZero();
    for (std::size_t n = 0; n < vertices_.nodes; ++n) {
        const Index vertex = nodes_[n].node;
        speed_.col(eigen_index(n)).setZero();
        if (state.moves(vertex)) speed_.col(eigen_index(n)) = state.velocity.col(vertex);
    }
    add_enclosures(speed_, image_);
    right.leftCols(columns) -= image_.leftCols(columns);
}

/// product += h² K vector for the enclosures, of rank one each.
void ImplicitSystem::add_enclosures(const Matrix4X& vector, Matrix4X& product) const {
    for (const VolumeForces::LinearEnclosure& enclosure : tissue_->volumes().linear()) {
        const auto each_vertex = [&](const auto& act) {
            for (std::size_t n = 0; n < enclosure.vertex.size(); ++n) {
                const Index number = number_[0][at(enclosure.vertex[n])];
                if (number >= 0) act(number, enclosure.gradient.col(eigen_index(n)));
            }
        };
        double flow = 0.0;
        each_vertex([&](Index n, const auto& gradient) { flow += gradient.dot(vector.col(n).template head<3>()); });
        const double pressure = listed_for_ * listed_for_ * enclosure.stiffness * flow;
        each_vertex([&](Index n, const auto& gradient) { product.col(n).template head<3>() += pressure * gradient; });
    }
}

void ImplicitSystem::invert(std::size_t node, const Matrix3& block) {
    const Matrix3 inverse = block.inverse();
    double* const to = inverse_.data() + 12 * node;
    for (Eigen::Index c = 0; c < 3; ++c) {
        for (Eigen::Index r = 0; r < 3; ++r) to[4 * c + r] = inverse(r, c);
    }
}

/// Interpolates ghosts from their parents.
void ImplicitSystem::prolongate(Matrix4X& vector) const {
    for (std::size_t n = ghosts_.size(); n-- > 0;) {
        const Ghost& ghost = ghosts_[n];
        vector.col(eigen_index(ghost.number)) = ghost.weight[0] * vector.col(eigen_index(ghost.parent[0])) +
                                                ghost.weight[1] * vector.col(eigen_index(ghost.parent[1])) +
                                                ghost.weight[2] * vector.col(eigen_index(ghost.parent[2]));
    }
}

/// Restricts ghosts to their parents, the transpose of prolongate.
void ImplicitSystem::restrict_to_coarse(Matrix4X& vector) const {
    for (const Ghost& ghost : ghosts_) {
        for (std::size_t p = 0; p < 3; ++p) {
            vector.col(eigen_index(ghost.parent[p])) += ghost.weight[p] * vector.col(eigen_index(ghost.number));
        }
    }
}

/// image_ = A direction_ for a part, without pressing contacts. On entry image_ holds the product with the inertia.
void ImplicitSystem::multiply(const Part& part, const TickContacts& contacts) {
    const bool with_ghosts = part.nodes == active_;  // ghosts move with coarser nodes
    if (with_ghosts) prolongate(direction_);
    for (std::size_t n = active_; n <= nodes_.size(); ++n) image_.col(eigen_index(n)).setZero();
    kernels_->multiply(std::span(edges_).first(part.edges), direction_.data(), image_.data());
    if (with_ghosts) restrict_to_coarse(image_);
    add_enclosures(direction_, image_);
    for (std::size_t c = 0; c < rows_.size(); ++c) {
        const Row& row = rows_[c];
        if (!row.has_friction) continue;
        const TickContact& contact = contacts.all()[c];
        Vector3 rate = Vector3::Zero();
        each_end(contact, [&](Eigen::Index n, double weight) { rate += weight * direction_.col(n).head<3>(); });
        const Vector3 push = listed_for_ * row.slope * row.held(rate, contact);
        each_end(contact, [&](Eigen::Index n, double weight) { image_.col(n).head<3>() += weight * push; });
    }
}

}  // namespace trocar
