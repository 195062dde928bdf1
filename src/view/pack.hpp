// Encoding of a page's frames: coordinates as whole numbers within a box, delta coding, zlib and base64. A scene's
// replay thus fits into one file. src/web/source/data.js decodes it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// Maps coordinates within a box to whole numbers. Coordinates outside are clamped to its border.
class Quantiser {
public:
    /// 14 bits: in a scene of 0.1 m half a step is 3 µm, a tenth of a pixel when the scene fills a screen. Two more
    /// bits would enlarge a page by a third.
    static constexpr std::uint16_t largest = 16383;
    /// Corners of the box, m; a side of length 0 is enlarged.
    Quantiser(const Vector3& low, const Vector3& high);
    [[nodiscard]] std::uint16_t number(double coordinate, int axis) const;  ///< coordinate: m, finite
    [[nodiscard]] double coordinate(std::uint16_t number, int axis) const;  ///< m
    [[nodiscard]] bool holds(const Vector3& point) const;
    [[nodiscard]] const Vector3& low() const { return low_; }
    /// m, per axis; the error of a coordinate within the box is at most half of it, plus rounding.
    [[nodiscard]] const Vector3& step() const { return step_; }

private:
    Vector3 low_;
    Vector3 step_;
};

/// A frame as three planes (x of all vertices, then y, then z).
std::vector<std::uint16_t> quantised(const Matrix3X& position, const Quantiser& quantiser);

/// Encodes frames of equal length. Each number is coded as its change since the frame before (the first since `rest`),
/// less the change of the preceding vertex in its plane. Differences are modulo 2^16 and zigzag coded; all low bytes
/// precede all high bytes.
std::string frame_bytes(const std::vector<std::vector<std::uint16_t>>& frames, std::span<const std::uint16_t> rest);

/// zlib stream in base64.
std::string deflated(std::string_view bytes);

/// The same for the memory of numbers (little-endian).
template <typename Number>
std::string deflated_numbers(const std::vector<Number>& numbers) {
    return deflated({reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)});
}

}  // namespace trocar
