// How a page holds frames: coordinates as whole numbers within a box, reported as differences, deflated and put into
// base64, so that a scene's replay fits into one file. src/web/source/data.js undoes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// Coordinates as whole numbers within a box. What lies outside is put on its border.
class Quantiser {
public:
    /// 14 bits: of a scene of 0.1 m half a step is 3 µm, a tenth of a pixel where the whole scene fills a screen, and
    /// two bits more would make a page a third larger.
    static constexpr std::uint16_t largest = 16383;
    /// Corners of the box, m; a side without length gets one that is not 0.
    Quantiser(const Vector3& low, const Vector3& high);
    [[nodiscard]] std::uint16_t number(double coordinate, int axis) const;  ///< coordinate: m, finite
    [[nodiscard]] double coordinate(std::uint16_t number, int axis) const;  ///< m
    [[nodiscard]] bool holds(const Vector3& point) const;
    [[nodiscard]] const Vector3& low() const { return low_; }
    /// m, per axis; a coordinate within the box comes back to half of it, and rounding.
    [[nodiscard]] const Vector3& step() const { return step_; }

private:
    Vector3 low_;
    Vector3 step_;
};

/// A frame as three planes (x of all vertices, then y, then z).
std::vector<std::uint16_t> quantised(const Matrix3X& position, const Quantiser& quantiser);

/// Frames of equal length, each reported as its change since the frame before (the first since `rest`), and that as its
/// difference from the change of the vertex before in its plane; modulo 2^16, zigzag, all low bytes before all high
/// bytes.
std::string frame_bytes(const std::vector<std::vector<std::uint16_t>>& frames, std::span<const std::uint16_t> rest);

/// The numbers of frame_bytes again; for tests.
std::vector<std::vector<std::uint16_t>> frames_of(std::string_view bytes, std::span<const std::uint16_t> rest);

/// zlib stream in base64.
std::string deflated(std::string_view bytes);

/// The same of numbers as they lie in memory (little-endian).
template <typename Number>
std::string deflated_numbers(const std::vector<Number>& numbers) {
    return deflated({reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)});
}

}  // namespace trocar
