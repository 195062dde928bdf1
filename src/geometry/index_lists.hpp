// Lists of numbers in one array, each with its start (compressed sparse rows): neighbours of vertices, edges or nodes.
#pragma once

#include <span>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

template <typename Number>
class NumberLists {
public:
    /// visit(act) calls act(list, number) for every entry. It is called twice and must give the same entries. Each list
    /// keeps their order.
    template <typename Visit>
    void fill(Index count, const Visit& visit) {
        first_.assign(at(count) + 1, 0);
        visit([this](Index list, Number /*number*/) { ++first_[at(list) + 1]; });
        for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
        number_.resize(at(first_.back()));
        std::vector<Index> next(first_.begin(), first_.end() - 1);
        visit([&](Index list, Number number) { number_[at(next[at(list)]++)] = number; });
    }
    [[nodiscard]] std::span<const Number> of(Index list) const {
        return {number_.data() + first_[at(list)], at(first_[at(list) + 1] - first_[at(list)])};
    }

private:
    std::vector<Index> first_;  ///< lists + 1
    std::vector<Number> number_;
};

using IndexLists = NumberLists<Index>;

}  // namespace trocar
