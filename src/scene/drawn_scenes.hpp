// Parts that families of drawn scenes share: random numbers, tools, targets, and the text of a scene file.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "geometry/random.hpp"
#include "geometry/types.hpp"

namespace trocar {

struct DrawnScene {
    std::string name;   ///< "moving_sheet_4_outward"; also of its file
    std::string group;  ///< "moving"; of the judged scenes their kind
    std::string text;   ///< a scene file, format trocar-scene-2
};

namespace drawn {

using Document = nlohmann::ordered_json;

/// Numbers within ranges. Equal seeds give equal numbers on every machine.
class Numbers {
public:
    explicit Numbers(std::uint64_t seed) : random_(seed) {}
    double within(double low, double high) { return low + 0.5 * (random_.signed_unit() + 1.0) * (high - low); }
    bool coin() { return random_.below(2) == 0; }

private:
    Random random_;
};

/// To the micrometre and the microsecond, so that files are short.
double rounded(double value);

struct Key {
    double time;  ///< s
    Vector3 translation;
};

/// A tool whose lowest point is the origin of its frame; its axis is +z.
struct Tool {
    std::string name;
    Document part;
};

Tool blunt(double radius = 0.004);
/// The cone is four radii long.
Tool pointed(double radius = 0.002);

/// A rectangle in the plane z = 0 with a pinned rim. m
Document sheet(const std::string& name, std::array<double, 2> size, double edge);

/// An ellipsoid with its top at z = 0; the vertices below a third of its half axis under its middle are pinned. m
Document organ(const Vector3& radii, double edge);

/// m, height of the organ's surface at a place near its top.
double organ_height(const Vector3& radii, double x, double y);

/// The body "tool" that follows the keys at a constant rotation (rotation vector, degrees).
Document tool_body(const Tool& tool, const std::string& drive, const std::vector<Key>& keys, const Vector3& rotation);

/// `k` N/m, and mu = 2 N s/m.
Document contact_law(const std::string& body, const std::string& other, int k);

/// A scene of 1 ms ticks until `end`. `contact_off`: from and to. s
DrawnScene finished(const std::string& name, const std::string& group, const std::string& description, double end,
                    std::optional<std::array<double, 2>> contact_off, const Document& bodies, const Document& contact);

}  // namespace drawn
}  // namespace trocar
