// Which way round a mesh's triangles run, and what is wrong with it: every side of a surface (inside or outside, front
// or back) is read from it, so a triangle that is turned round does not keep tools out, it draws them in.
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

/// Vertices at the same place are taken as one, triangles whose corners coincide are left out. All numbers are those of
/// the triangles as given, 0-based.
struct OrientationReport {
    bool closed = false;  ///< no edge has one triangle only
    /// Edges that triangles run along more often one way than the other. Closed: any difference; open: more than the
    /// odd one that an edge with an odd number of triangles must have.
    Index disagreeing_edges = 0;
    std::array<Index, 2> first_disagreeing{-1, -1};  ///< two triangles that run along the first such edge the same way
    /// Triangles, ascending, that make neighbours agree when they are turned round: the fewer of each shell. Empty
    /// where none need to be, or where no choice helps (a one-sided surface, or more than two triangles at an edge).
    std::vector<Index> to_turn;
    std::vector<ShellInsideOut> inside_out;  ///< of closed shells that agree; a cavity is one too
};

OrientationReport orientation_of(const Matrix3X& vertices, const Triangles& triangles);

/// How often the triangles, those of the ascending list `without` left out, surround the point, counted by solid angle
/// (Van Oosterom and Strackee 1983): +1 inside a surface that is counter-clockwise seen from outside. Between whole
/// numbers where they do not close.
double winding_number(const Matrix3X& vertices, const Triangles& triangles, const Vector3& point,
                      const std::vector<Index>& without = {});

/// Triangles with the corners of an earlier one, in the same order up to rotation: (triangle, first one like it).
/// `same_place`: corners at the same place count as the same, else only the same vertices do.
std::vector<std::array<Index, 2>> repeated_triangles(const Matrix3X& vertices, const Triangles& triangles,
                                                     bool same_place);

/// The rest of the triangles surrounds the shell, so that it is right inside out: the wall of a hollow.
bool is_cavity(const Matrix3X& vertices, const Triangles& triangles, const ShellInsideOut& shell);

/// Every triangle once, turned so that neighbours agree and that closed shells have their volume inside, cavities left
/// as they are. What no turning mends stays.
Triangles mended(const Matrix3X& vertices, const Triangles& triangles);

/// The first numbers of a list as text: "3, 5, 9 and 12 more".
std::string first_of(const std::vector<Index>& numbers);

}  // namespace trocar
