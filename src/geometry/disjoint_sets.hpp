// Disjoint sets of the numbers from 0 on (union-find with path halving).
#pragma once

#include <numeric>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

class DisjointSets {
public:
    DisjointSets() = default;
    explicit DisjointSets(Index count) { reset(count); }
    /// Puts every number below `count` in a set of its own.
    void reset(Index count) {
        parent_.resize(at(count));
        std::iota(parent_.begin(), parent_.end(), Index{0});
    }
    /// Representative of the number's set.
    Index find(Index i) {
        while (parent_[at(i)] != i) i = parent_[at(i)] = parent_[at(parent_[at(i)])];
        return i;
    }
    /// The representative of j's set becomes that of the union.
    void merge(Index i, Index j) { parent_[at(find(i))] = find(j); }

private:
    std::vector<Index> parent_;
};

}  // namespace trocar
