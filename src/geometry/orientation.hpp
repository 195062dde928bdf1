// Orientation of a mesh's triangles and its defects. The side of a surface (inside or outside, front or back) follows
// from it: a flipped triangle pulls tools in instead of keeping them out.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

/// A closed set of triangles connected by edges whose volume is not positive.
struct ShellInsideOut {
    std::vector<Index> triangles = {};  ///< ascending
    double volume = 0.0;                ///< unit³, <= 0
};

/// Vertices at the same place count as one, triangles whose corners coincide are left out. Numbers are those of the
/// given triangles, 0-based.
struct OrientationReport {
    bool closed = false;  ///< every edge has at least two triangles
    /// Edges that triangles traverse more often in one direction than in the other. Closed: any difference; open: a
    /// difference above the one that an odd number of triangles must have.
    Index disagreeing_edges = 0;
    std::array<Index, 2> first_disagreeing{-1, -1};  ///< two triangles that traverse the first such edge alike
    /// Triangles to turn, ascending, so that all neighbours agree: the smaller set of each shell. Empty where none is
    /// needed or no choice helps (a one-sided surface, or more than two triangles at an edge).
    std::vector<Index> to_turn;
    std::vector<ShellInsideOut> inside_out;  ///< closed shells that agree; includes cavities
};

OrientationReport orientation_of(const Matrix3X& vertices, const Triangles& triangles);

/// Winding number of the triangles around the point, by solid angle (Van Oosterom and Strackee 1983). The value is +1
/// inside a surface that is counter-clockwise seen from outside. Not an integer where they do not close. `without`
/// (ascending) lists triangles to leave out.
double winding_number(const Matrix3X& vertices, const Triangles& triangles, const Vector3& point,
                      const std::vector<Index>& without = {});

/// Triangles with the corners of an earlier one, in the same order up to rotation: (triangle, the first such one).
/// `same_place`: corners match by position, else by vertex number.
std::vector<std::array<Index, 2>> repeated_triangles(const Matrix3X& vertices, const Triangles& triangles,
                                                     bool same_place);

/// True when the other triangles surround the shell, so that its inverted orientation is correct: the wall of a hollow.
bool is_cavity(const Matrix3X& vertices, const Triangles& triangles, const ShellInsideOut& shell);

/// Each triangle once, oriented so that neighbours agree and closed shells have positive volume; cavities stay. Defects
/// that no reorientation repairs stay.
Triangles mended(const Matrix3X& vertices, const Triangles& triangles);

/// The first numbers of a list as text: "3, 5, 9 and 12 more".
std::string first_of(const std::vector<Index>& numbers);

}  // namespace trocar
