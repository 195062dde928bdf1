#include "view/pack.hpp"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "geometry/text.hpp"

namespace trocar {
namespace {

constexpr double largest_code = Quantiser::largest;

std::uint16_t zigzag(std::uint16_t difference) {
    const auto sign = static_cast<std::uint16_t>((difference & 0x8000U) != 0 ? 0xffffU : 0U);
    return static_cast<std::uint16_t>(static_cast<std::uint16_t>(difference << 1U) ^ sign);
}

}  // namespace

Quantiser::Quantiser(const Vector3& low, const Vector3& high) : low_(low), step_((high - low) / largest_code) {
    const double longest = step_.maxCoeff();
    const double least = longest > 0.0 ? 1e-6 * longest : 1.0 / largest_code;
    step_ = step_.cwiseMax(least);
}

std::uint16_t Quantiser::number(double coordinate, int axis) const {
    const double steps = std::round((coordinate - low_[axis]) / step_[axis]);
    return static_cast<std::uint16_t>(std::clamp(steps, 0.0, largest_code));
}

double Quantiser::coordinate(std::uint16_t number, int axis) const { return low_[axis] + step_[axis] * number; }

bool Quantiser::holds(const Vector3& point) const {
    const Vector3 steps = (point - low_).cwiseQuotient(step_);
    return steps.minCoeff() >= -0.5 && steps.maxCoeff() <= largest_code + 0.5;
}

std::vector<std::uint16_t> quantised(const Matrix3X& position, const Quantiser& quantiser) {
    std::vector<std::uint16_t> numbers;
    numbers.reserve(static_cast<std::size_t>(position.size()));
    for (int axis = 0; axis < 3; ++axis) {
        for (Index vertex = 0; vertex < static_cast<Index>(position.cols()); ++vertex) {
            numbers.push_back(quantiser.number(position(axis, vertex), axis));
        }
    }
    return numbers;
}

std::string frame_bytes(const std::vector<std::vector<std::uint16_t>>& frames, std::span<const std::uint16_t> rest) {
    const std::size_t size = rest.size();
    std::string bytes(2 * size * frames.size(), '\0');
    const std::size_t high = size * frames.size();
    std::size_t at = 0;
    std::span<const std::uint16_t> last = rest;
    for (const std::vector<std::uint16_t>& frame : frames) {
        std::uint16_t before = 0;
        for (std::size_t i = 0; i < size; ++i, ++at) {
            if (i % (size / 3) == 0) before = 0;
            const auto change = static_cast<std::uint16_t>(frame[i] - last[i]);
            const std::uint16_t number = zigzag(static_cast<std::uint16_t>(change - before));
            before = change;
            bytes[at] = static_cast<char>(number & 0xffU);
            bytes[high + at] = static_cast<char>(number >> 8U);
        }
        last = frame;
    }
    return bytes;
}

std::string deflated(std::string_view bytes) {
    uLongf size = compressBound(bytes.size());
    std::vector<unsigned char> packed(size);
    const int status = compress2(packed.data(), &size, reinterpret_cast<const unsigned char*>(bytes.data()),
                                 bytes.size(), Z_BEST_COMPRESSION);
    if (status != Z_OK) throw std::runtime_error("zlib: no memory for the frames of a page");
    return base64({reinterpret_cast<const char*>(packed.data()), size});
}

}  // namespace trocar
