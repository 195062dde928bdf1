// Anatomy and instruments made by formula at any resolution, so that scenes need no mesh files and their truth is
// known. One table says what shapes exist and what each needs; reading, schema and documentation print from it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// Vertices in the unit of the parameters, shape frame; triangles counter-clockwise seen from outside (open shapes:
/// from +z).
struct Surface {
    Matrix3X vertices;
    Triangles triangles;
};

struct ShapeParameter {
    enum class Type {
        length,    ///< number > 0, unit of the scene
        lengths2,  ///< [x, y], each > 0
        lengths3,  ///< [x, y, z], each > 0
        points3,   ///< three points [[x, y, z], …]
        degrees,   ///< number in [minimum, maximum]
        ratio,     ///< number in [minimum, maximum]
        choice     ///< one of `choices`
    };
    std::string name = {};
    Type type = Type::length;
    std::string meaning = {};
    std::optional<double> default_number = std::nullopt;  ///< absent: the parameter is required (choice: the first)
    double minimum = 0.0;
    double maximum = 0.0;
    std::vector<std::string> choices = {};
};

/// Checked values of all parameters of one shape.
struct ShapeValues {
    std::map<std::string, std::vector<double>, std::less<>> numbers;
    std::map<std::string, std::string, std::less<>> words;
    [[nodiscard]] double number(std::string_view name) const { return numbers.find(name)->second.front(); }
    [[nodiscard]] Vector3 vector3(std::string_view name) const;
    [[nodiscard]] const std::string& word(std::string_view name) const { return words.find(name)->second; }
};

/// A value that is possible by itself but not together with the others.
struct ShapeFault {
    std::string parameter;
    std::string expected;
};

struct Shape {
    std::string name;
    bool closed = true;
    std::string meaning;
    std::vector<ShapeParameter> parameters;
    /// Absent when the values fit together.
    std::optional<ShapeFault> (*check)(const ShapeValues&) = nullptr;
    /// Estimate from above of the number of triangles; may be infinite.
    double (*triangle_estimate)(const ShapeValues&) = nullptr;
    Surface (*make)(const ShapeValues&) = nullptr;
};

/// All shapes, in the order of the documentation.
const std::vector<Shape>& shapes();
/// Null when there is none of that name.
const Shape* find_shape(std::string_view name);

}  // namespace trocar
