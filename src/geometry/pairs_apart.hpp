// Pairs of triangles of one mesh that may meet and have no common vertex, found by a box tree traversed against itself.
// No list of them is stored.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// Two kinds of subtree pairs are skipped as a whole. The first is triangles that share a vertex (a fan, duplicates).
/// The second is triangles with area that lie exactly in one plane (a flat face cut into many). Boxes along their own
/// axes separate long thin triangles.
class PairsApart {
public:
    /// Both arguments must outlive the object. Precondition: the three vertex numbers of a triangle differ.
    PairsApart(const Matrix3X& vertices, const Triangles& triangles);

    /// Calls use(s, t) for each pair whose boxes overlap; ends early when it returns false. Returns the number of node
    /// pairs visited. `one_plane_too`: includes pairs that lie in one plane.
    template <typename Use>
    std::int64_t for_each(const Use& use, bool one_plane_too = false) const {
        std::int64_t examined = 0;
        if (nodes_.empty()) return examined;
        std::vector<std::array<Index, 2>> open{{0, 0}};
        while (!open.empty()) {
            const auto [a, b] = open.back();
            open.pop_back();
            ++examined;
            const Node& first = node(a);
            const Node& second = node(b);
            if (passed_over(a, b, one_plane_too)) continue;
            const bool first_ends = first.second < 0;
            const bool second_ends = second.second < 0;
            if (a == b) {
                if (first_ends) continue;  // one triangle
                open.insert(open.end(), {{a + 1, a + 1}, {first.second, first.second}, {a + 1, first.second}});
            } else if (first_ends && second_ends) {
                if (!use(order_[static_cast<std::size_t>(first.first)], order_[static_cast<std::size_t>(second.first)]))
                    break;
            } else if (second_ends || (!first_ends && first.count >= second.count)) {
                open.insert(open.end(), {{a + 1, b}, {first.second, b}});
            } else {
                open.insert(open.end(), {{a, b + 1}, {a, second.second}});
            }
        }
        return examined;
    }

private:
    /// Vertices common to all triangles below; -1 fills up to three.
    using Common = std::array<Index, 3>;
    struct Node {
        Box box;
        Common common{-1, -1, -1};
        Index first = 0;  ///< into order_
        Index count = 1;
        Index second = -1;   ///< node of the upper half; the lower half follows this node; -1: one triangle
        Index plane = -1;    ///< a triangle whose plane holds all triangles below, each with area; -1: none
        Index slanted = -1;  ///< into slanted_
    };
    /// An oriented box; axes are unit vectors up to rounding, coordinates are relative to middle_.
    struct Slanted {
        Matrix3 axes;  ///< rows
        Vector3 middle;
        Vector3 half;
    };

    [[nodiscard]] const Node& node(Index i) const { return nodes_[static_cast<std::size_t>(i)]; }
    [[nodiscard]] bool passed_over(Index a, Index b, bool one_plane_too) const;
    [[nodiscard]] bool in_one_plane(Index face, Index other) const;
    [[nodiscard]] bool apart_along_own_axes(const Node& first, const Node& second) const;
    [[nodiscard]] Slanted box_along(const Node& of, Index along) const;
    [[nodiscard]] Slanted own_box(const Node& of) const;
    [[nodiscard]] Vector3 centre(Index triangle) const;
    void find_slanted(Node& made);
    Index build(Index begin, Index end);

    const Matrix3X& vertices_;
    const Triangles& triangles_;
    std::vector<Box> boxes_;  ///< per triangle
    Vector3 middle_ = Vector3::Zero();
    double size_ = 0.0;  ///< size of the whole mesh
    std::vector<Index> order_;
    std::vector<Node> nodes_;
    std::vector<Slanted> slanted_;
};

}  // namespace trocar
