// SIMD kernels of ohc's occupancy level for the CPU's widest vectors. They compute coarse cells of vertices, read a bit
// field there, and compare vertices with boxes.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "detect/vertex_kernels.hpp"
#include "geometry/types.hpp"

namespace trocar {

/// Cells of the lattice (lattice.hpp), merged 2^shift by 2^shift by 2^shift into coarse cells, at most 512 per axis.
/// Cells outside the window count as its outermost ones.
struct CellWindow {
    double inverse = 1.0;                         ///< 1 / edge of a cell, 1/m
    std::array<double, 3> base{0.0, 0.0, 0.0};    ///< q = round(x · inverse − base)
    std::array<double, 3> first{0.0, 0.0, 0.0};   ///< smallest q inside, an integer
    std::array<double, 3> last{0.0, 0.0, 0.0};    ///< largest q inside
    std::array<double, 3> origin{0.0, 0.0, 0.0};  ///< first q of coarse cell 0, at most `first`
    int shift = 0;
    std::uint32_t row = 32;    ///< bits of a row along x in a bit field
    std::uint32_t plane = 32;  ///< bits of a plane of rows
};

/// Code of a vertex's coarse cell: nine bits per axis with a spare bit above each, and a mark on top.
namespace cell_code {
inline constexpr std::uint32_t bits = 10;
inline constexpr std::uint32_t most = 511;
inline constexpr std::uint32_t mark = 1U << 31U;
inline std::uint32_t axis(std::uint32_t code, unsigned k) { return (code >> (bits * k)) & most; }
/// Place of the cell's bit in a bit field over the window.
inline std::uint32_t place(std::uint32_t code, const CellWindow& window) {
    return axis(code, 0) + axis(code, 1) * window.row + axis(code, 2) * window.plane;
}
/// The spare bit of each axis; the lowest one; all others but the lowest two.
inline constexpr std::uint32_t spare = (1U << 9U) | (1U << 19U) | (1U << 29U);
inline constexpr std::uint32_t ones = (1U << 0U) | (1U << 10U) | (1U << 20U);
inline constexpr std::uint32_t upper = 0x3FFFFFFFU & ~(ones | (ones << 1U));
/// Zero exactly when every axis of the two codes differs by at most one. The spare bit prevents borrows between axes:
/// an axis holds 512 + a − b + 1, which is 512, 513 or 514.
inline std::uint32_t apart(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t difference = ((a | spare) + ones) - (b & ~mark);
    return ((difference ^ spare) | ((difference + ones) ^ spare)) & upper;
}
}  // namespace cell_code

/// Position of a point relative to up to four boxes: a byte per box, a bit per side that the point is beyond. A
/// triangle's box overlaps a box exactly when the "and" of its corners' bytes is zero.
namespace box_sides {
inline constexpr std::size_t most = 4;
inline constexpr std::uint32_t absent = 1U << 6U;  ///< in the byte of an absent box
inline bool any_overlap(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const std::uint32_t beyond = a & b & c;
    return ((beyond - 0x01010101U) & ~beyond & 0x80808080U) != 0;
}
}  // namespace box_sides

struct OccupancyKernels {
    /// Codes of `count` finite points (x y z …), without marks.
    void (*encode)(const double* points, Index count, const CellWindow& window, std::uint32_t* codes);
    /// Marks the codes whose bit is set in `field`.
    void (*mark)(const std::uint32_t* field, Index count, const CellWindow& window, std::uint32_t* codes);
    /// Selects among triangles first … first+count-1, which have three corners each, from corners[3 · first]. A
    /// triangle is selected when its first corner's code has a bit of `mark`, or two codes differ by more than one on
    /// an axis. Writes their numbers in order and returns how many; `found` has room for `count`.
    Index (*select)(const std::uint32_t* codes, const Index* corners, Index first, Index count, std::uint32_t mark,
                    Index* found);
    /// Words of box_sides for `count` finite points and at most box_sides::most boxes.
    void (*beside)(const double* points, Index count, std::span<const Extent> boxes, std::uint32_t* words);
    const char* target;  ///< instruction set, as Highway names it
};

/// One per instruction set that was built and that this CPU has, best first, scalar last.
const std::vector<OccupancyKernels>& occupancy_kernels();

}  // namespace trocar
