#include "tissue/far_field.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {

FarField::FarField(RegionTissue& region) : region_(&region) {
    const std::vector<NodeLevel>& levels = region.levels();
    const std::size_t last = levels.size() - 1;
    owner_.resize(last);
    holding_.resize(levels.size());
    for (std::size_t level = 1; level <= last; ++level) holding_[level].resize(levels[level].size());
    for (std::size_t level = 0; level < last; ++level) {
        const NodeLevel& fine = levels[level];
        for (std::size_t node = 0; node < fine.size(); ++node) {
            // A free parent takes precedence over a fixed one, because fixed nodes move no others.
            Index owner = fine.parent[node][0];
            double best = -1.0;
            for (std::size_t n = 0; n < 3; ++n) {
                const double weight = fine.weight[node][n];
                const Index parent = fine.parent[node][n];
                const double worth = weight + (weight > 0.0 && levels[level + 1].fixed[at(parent)] == 0 ? 1.0 : 0.0);
                if (worth <= best) continue;
                best = worth;
                owner = parent;
            }
            owner_[level].push_back(owner);
        }
    }
    // Sorted by the owner at the last level, then by that at the level below, and so on.
    std::vector<std::vector<Index>> owner_of(levels.size());  // per level and vertex
    for (std::size_t v = 0; v < levels[0].size(); ++v) {
        owner_of[0].push_back(static_cast<Index>(v));
        if (levels[0].fixed[v] == 0) order_.push_back(static_cast<Index>(v));
    }
    for (std::size_t level = 1; level <= last; ++level) {
        for (const Index below : owner_of[level - 1]) owner_of[level].push_back(owner_[level - 1][at(below)]);
        const std::vector<Index>& key = owner_of[level];
        std::stable_sort(order_.begin(), order_.end(), [&key](Index a, Index b) { return key[at(a)] < key[at(b)]; });
    }
    for (std::size_t level = 1; level <= last; ++level) {
        for (std::size_t n = 0; n < order_.size(); ++n) {
            Holding& holding = holding_[level][at(owner_of[level][at(order_[n])])];
            if (holding.end == 0) holding.first = static_cast<std::uint32_t>(n);
            holding.end = static_cast<std::uint32_t>(n + 1);
        }
    }
    std::size_t nodes = 0;
    for (std::size_t level = 1; level <= last; ++level) nodes += levels[level].size();
    late_.reserve(nodes);
    beside_.reserve(levels[0].size());
    double spacing = 0.0;
    for (const double one : levels[0].spacing) spacing += one;
    constexpr double part = 1e-6;
    least_ = part * spacing / static_cast<double>(levels[0].size());
}

void FarField::start() {
    for (std::size_t level = 1; level < holding_.size(); ++level) {
        for (std::size_t node = 0; node < holding_[level].size(); ++node) {
            Holding& holding = holding_[level][node];
            holding.next = holding.first;
            holding.passed = holding.beginning = region_->levels()[level].displacement.col(eigen_index(node));
            holding.seen = turn_;
        }
    }
    late_.clear();
    beside_.clear();
    stretch_ = last_stretch_ = 0.0;
    around_ = 0;
    tick_ = 0;
}

void FarField::follow(std::size_t most, std::size_t most_beside) {
    most_ = most;
    constexpr std::int64_t round = 4;
    const std::int64_t turn = tick_++ % round;
    if (turn == 0) find_beside(most_beside);
    for (const Index vertex : beside_) region_->refresh(0, vertex);
    put_before_ = region_->put();  // updates beside active nodes or other bodies
    if (turn + 1 == round) {
        go_around();
    } else {
        if (turn == 0) find_late();
        while (!late_.empty() && pass_over(late_.front())) {
            std::pop_heap(late_.begin(), late_.end());
            late_.pop_back();
        }
    }
    region_->report_pulls();
}

/// Examines the vertices in turn, for motion that no node has and for residual deformation.
void FarField::go_around() {
    for (std::size_t n = 0; n < std::min(most_, order_.size()) && examine(order_[around_]); ++n) {
        if (++around_ < order_.size()) continue;
        around_ = 0;
        last_stretch_ = stretch_;
        stretch_ = 0.0;
    }
}

/// Returns false if the limit of the tick is reached. Relaxation updates the neighbours as well. A vertex with more
/// neighbours than the limit is only updated.
bool FarField::examine(Index vertex) {
    const NodeLevel& vertices = region_->levels()[0];
    const std::size_t put = region_->put() - put_before_;
    const std::size_t examined_count = 1 + vertices.edges.of(vertex).size();
    if (put + std::min(examined_count, most_) > most_ || put == most_) return false;
    if (examined_count > most_) {
        region_->refresh(0, vertex);
    } else {
        stretch_ = std::max(stretch_, region_->relax(vertex));
    }
    return true;
}

void FarField::find_late() {
    ++turn_;
    late_.clear();
    const std::vector<NodeLevel>& levels = region_->levels();
    for (std::size_t level = levels.size() - 1; level > 0; --level) {
        for (const Index node : levels[level].active_nodes) {
            Holding& holding = holding_[level][at(node)];
            const Eigen::Vector4d displacement = levels[level].displacement.col(node);
            if (holding.seen < turn_ - 1) {
                // The node was interpolated until now, so its vertices are as late as its owner.
                const Index owner = owner_[level][at(node)];
                holding.passed = displacement;
                if (levels[level + 1].active[at(owner)] != 0) {
                    holding.passed -= levels[level + 1].displacement.col(owner) - holding_[level + 1][at(owner)].passed;
                }
                holding.next = holding.first;
            }
            holding.seen = turn_;
            const double square = (displacement - holding.passed).squaredNorm();
            if (holding.end > holding.first && square > least_ * least_) {
                late_.push_back({square, static_cast<std::uint32_t>(level), node});
            }
        }
    }
    std::make_heap(late_.begin(), late_.end());
}

/// Lists interpolated vertices beside other bodies, only under active nodes of level 1: elsewhere nothing moves much.
void FarField::find_beside(std::size_t most) {
    beside_.clear();
    if (holding_.size() < 2) return;
    const std::vector<NodeLevel>& levels = region_->levels();
    for (const Index node : levels[1].active_nodes) {
        const Holding& holding = holding_[1][at(node)];
        if (holding.first == holding.end) continue;
        const double across = 2.0 * levels[1].spacing[at(node)];
        if (!region_->is_beside_others(order_[holding.first], across)) continue;
        for (std::uint32_t n = holding.first; n < holding.end; ++n) {
            const Index vertex = order_[n];
            if (levels[0].active[at(vertex)] != 0) continue;
            if (!region_->is_beside_others(vertex, 0.0)) continue;
            if (beside_.size() == most) return;
            beside_.push_back(vertex);
        }
    }
}

bool FarField::pass_over(const Late& late) {
    const std::vector<NodeLevel>& levels = region_->levels();
    if (levels[late.level].active[at(late.node)] == 0) return true;  // interpolated since the search
    Holding& holding = holding_[late.level][at(late.node)];
    if (holding.next == holding.first) holding.beginning = levels[late.level].displacement.col(late.node);
    while (holding.next < holding.end) {
        const Index vertex = order_[holding.next];
        // Vertices under an active node of a lower level belong to that node.
        std::uint32_t beyond = 0;
        Index node = vertex;
        for (std::size_t level = 1; level < late.level; ++level) {
            node = owner_[level - 1][at(node)];
            if (levels[level].active[at(node)] != 0) beyond = holding_[level][at(node)].end;
        }
        if (beyond > 0) {
            holding.next = beyond;
            continue;
        }
        if (!examine(vertex)) return false;
        ++holding.next;
    }
    holding.passed = holding.beginning;
    holding.next = holding.first;
    return true;
}

}  // namespace trocar
