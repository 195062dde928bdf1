// Box and cells of a triangle, shared by all parts of ohc. Large triangles are cut into pieces, since they miss most
// cells of their boxes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "detect/lattice.hpp"
#include "detect/tick_part.hpp"
#include "geometry/types.hpp"
#include "scene/world.hpp"

namespace trocar {

/// A triangle that may lie in a shared cell.
struct Primitive {
    CellRange range;             ///< cells of its box
    std::array<double, 3> low;   ///< box, m
    std::array<double, 3> high;  ///< m
    Index triangle;
    Index body;
    bool cut;  ///< in pieces: its cells are not a full range, so the one-cell rule does not hold for it
};

inline bool boxes_overlap(const Primitive& p, const Primitive& q) {
    // Without branches, since the separating axis is unpredictable.
    unsigned overlap = 1;
    for (std::size_t k = 0; k < 3; ++k) {
        overlap &= static_cast<unsigned>(p.low[k] <= q.high[k]) & static_cast<unsigned>(q.low[k] <= p.high[k]);
    }
    return overlap != 0;
}

class TriangleCells {
public:
    static constexpr double most_cells = 343.0;    ///< a triangle that covers more is cut into pieces
    static constexpr double most_pieces = 4096.0;  ///< a triangle that needs more is tested against everything

    void prepare(const Topology& topology) {
        topology_ = &topology;
        around_.assign(topology.bodies.size(), 0.0);
    }
    /// Sets the margin of a body's triangles (m, >= 0).
    void grow(Index body, double margin) { around_[static_cast<std::size_t>(body)] = margin; }
    /// Margin around a body's triangles, m.
    [[nodiscard]] double around(Index body) const { return around_[static_cast<std::size_t>(body)]; }
    /// `path`: triangles cover all places between the frame before and this one. Large ones cover only their body's
    /// part of the tick; `parts` must outlive its use.
    void set_path(bool path, std::span<const TickPart> parts = {}) {
        path_ = path;
        parts_ = parts;
    }
    [[nodiscard]] bool path() const { return path_; }
    [[nodiscard]] Lattice& lattice() { return lattice_; }
    [[nodiscard]] const Lattice& lattice() const { return lattice_; }

    [[nodiscard]] Primitive primitive(const Frame& frame, Index triangle) const {
        Primitive p;
        p.triangle = triangle;
        p.body = topology_->body_of_triangle[static_cast<std::size_t>(triangle)];
        const Index* const v = topology_->triangles.data() + 3 * static_cast<std::size_t>(triangle);
        const auto corner = [v](const Matrix3X& position, std::size_t k) {
            return position.data() + 3 * static_cast<std::size_t>(v[k]);
        };
        const double* const a = corner(frame.position, 0);
        const double* const b = corner(frame.position, 1);
        const double* const c = corner(frame.position, 2);
        const auto least = [](auto x, auto y) { return y < x ? y : x; };
        const auto most = [](auto x, auto y) { return x < y ? y : x; };
        Two low = least(least(two(a), two(b)), two(c));
        Two high = most(most(two(a), two(b)), two(c));
        Two z{least(least(a[2], b[2]), c[2]), most(most(a[2], b[2]), c[2])};
        if (path_) {
            for (std::size_t k = 0; k < 3; ++k) {
                const double* const before = corner(frame.previous, k);
                low = least(low, two(before));
                high = most(high, two(before));
                z = Two{least(z[0], before[2]), most(z[1], before[2])};
            }
        }
        const double around = around_[static_cast<std::size_t>(p.body)];
        low -= around;
        high += around;
        z += Two{-around, around};
        p.low = {low[0], low[1], z[0]};
        p.high = {high[0], high[1], z[1]};
        p.range = lattice_.range(low, high, z);
        p.cut = p.range.cell_count() > most_cells;
        return p;
    }

    /// Calls use(range) once for an ordinary triangle and once per piece for a large one. Returns false, without a
    /// call, for one that is cheaper to test against everything.
    template <typename Use>
    bool for_each_range(const Frame& frame, const Primitive& p, const Use& use) const {
        if (!p.cut) {
            use(p.range);
            return true;
        }
        const Cut cut = cut_of(frame, p);
        // Cutting does not help when the margin spans many cells.
        const double across = 3.0 + 2.0 * around(p.body) / lattice_.edge();  // cells of a piece along an axis
        if (cut.pieces() > std::min(most_pieces, 0.05 * topology_->triangle_count() + 16.0) ||
            across * across * across > 4.0 * most_cells) {
            return false;
        }
        for_each_piece(frame, p, cut, use);
        return true;
    }

private:
    static Two two(const double* xy) {
        Two result;
        std::memcpy(&result, xy, sizeof result);
        return result;
    }
    /// Cut of a large triangle: `slabs` across its two long edges, each into `columns` along the third.
    struct Cut {
        int apex = 0;  ///< corner between the two long edges
        double slabs = 1.0;
        double columns = 1.0;
        double steps = 1.0;  ///< parts of the motion from the frame before, within the body's part of the tick
        [[nodiscard]] double pieces() const { return slabs * columns * steps; }
    };
    [[nodiscard]] TickPart part_of(Index body) const {
        return parts_.empty() ? TickPart{} : parts_[static_cast<std::size_t>(body)];
    }
    [[nodiscard]] Cut cut_of(const Frame& frame, const Primitive& p) const {
        const auto v = topology_->triangles.col(p.triangle);
        std::array<double, 3> opposite{};  // largest extent of the edge opposite to each corner, in cells
        for (int k = 0; k < 3; ++k) {
            opposite[static_cast<std::size_t>(k)] =
                (frame.position.col(v((k + 2) % 3)) - frame.position.col(v((k + 1) % 3))).cwiseAbs().maxCoeff() /
                lattice_.edge();
        }
        Cut cut;
        cut.apex = static_cast<int>(std::min_element(opposite.begin(), opposite.end()) - opposite.begin());
        const double longest = *std::max_element(opposite.begin(), opposite.end());
        cut.slabs = std::max(1.0, std::ceil(longest / 2.0));
        cut.columns = std::max(1.0, std::ceil(opposite[static_cast<std::size_t>(cut.apex)] / 2.0));
        if (path_) {
            double path = 0.0;
            for (int k = 0; k < 3; ++k) {
                path = std::max(path, (frame.position.col(v(k)) - frame.previous.col(v(k))).cwiseAbs().maxCoeff());
            }
            const TickPart part = part_of(p.body);
            cut.steps = std::max(1.0, std::ceil((part.last - part.first) * path / lattice_.edge() / 2.0));
        }
        return cut;
    }
    /// Calls use(range) for cell ranges that together hold every point of the triangle.
    template <typename Use>
    void for_each_piece(const Frame& frame, const Primitive& p, const Cut& cut, const Use& use) const {
        const auto v = topology_->triangles.col(p.triangle);
        struct CutTriangle {
            Vector3 apex;
            Vector3 left;
            Vector3 right;
            [[nodiscard]] Vector3 point(double s, double t) const {
                return (1.0 - s) * apex + s * ((1.0 - t) * left + t * right);
            }
            [[nodiscard]] double size() const {
                return apex.cwiseAbs().maxCoeff() + left.cwiseAbs().maxCoeff() + right.cwiseAbs().maxCoeff();
            }
        };
        const auto corners_in = [&](const Matrix3X& position) -> CutTriangle {
            return {position.col(v(cut.apex)), position.col(v((cut.apex + 1) % 3)),
                    position.col(v((cut.apex + 2) % 3))};
        };
        const CutTriangle here = corners_in(frame.position);
        const CutTriangle before = path_ ? corners_in(frame.previous) : here;
        // The corners of a piece are rounded; a pad of some units in the last place prevents gaps between pieces.
        const double pad =
            around(p.body) + 16.0 * std::numeric_limits<double>::epsilon() * std::max(here.size(), before.size());
        const Vector3 padding = Vector3::Constant(pad);
        // The casts are safe: triangles with many pieces were returned as huge.
        const int slabs = static_cast<int>(cut.slabs);
        const int steps = static_cast<int>(cut.steps);
        const TickPart counts = part_of(p.body);
        for (int i = 0; i < slabs; ++i) {
            // A slab nearer to the apex is narrower and needs fewer columns.
            const int columns = std::max(1, static_cast<int>(std::ceil(cut.columns * (i + 1) / slabs)));
            for (int j = 0; j < columns; ++j) {
                std::array<Vector3, 4> start;  // corners of the piece at the frame before, and their displacements
                std::array<Vector3, 4> path;
                for (std::size_t k = 0; k < 4; ++k) {
                    const double s = static_cast<double>(i + static_cast<int>(k / 2)) / slabs;
                    const double t = static_cast<double>(j + static_cast<int>(k % 2)) / columns;
                    start[k] = before.point(s, t);
                    path[k] = here.point(s, t) - start[k];
                }
                for (int step = 0; step < steps; ++step) {
                    Box box;
                    for (const int end : {step, step + 1}) {
                        const double part = counts.first + (counts.last - counts.first) * end / steps;
                        for (std::size_t k = 0; k < 4; ++k) box.add(start[k] + part * path[k]);
                    }
                    // The triangle lies within the cells between its corners'.
                    use(CellRange{cell_max(p.range.low, lattice_.cell(box.min - padding)),
                                  cell_min(p.range.high, lattice_.cell(box.max + padding))});
                }
            }
        }
    }

    const Topology* topology_ = nullptr;
    std::vector<double> around_;  ///< per body
    bool path_ = false;
    std::span<const TickPart> parts_;
    Lattice lattice_;
};

}  // namespace trocar
