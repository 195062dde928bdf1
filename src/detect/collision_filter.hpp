// Table of the bodies that may collide, one bit per pair, for the innermost loops of a detector.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "scene/world.hpp"

namespace trocar {

class CollisionFilter {
public:
    /// Allows the body pairs of the topology.
    void prepare(const Topology& topology) {
        words_ = (topology.bodies.size() + 63) / 64;
        bits_.assign(topology.bodies.size() * words_, 0);
        for (const auto& [a, b] : topology.body_pairs) {
            for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, a}}) {
                bits_[at(from) * words_ + at(to) / 64] |= std::uint64_t{1} << (at(to) % 64);
            }
        }
    }
    [[nodiscard]] bool may_hit(Index body_a, Index body_b) const {
        return ((bits_[at(body_a) * words_ + at(body_b) / 64] >> (at(body_b) % 64)) & 1U) != 0;
    }
    /// Bits of all bodies that this one may hit.
    [[nodiscard]] std::span<const std::uint64_t> mask(Index body) const {
        return {bits_.data() + at(body) * words_, words_};
    }

private:
    std::vector<std::uint64_t> bits_;
    std::size_t words_ = 1;
};

}  // namespace trocar
