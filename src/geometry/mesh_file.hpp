// Reads OBJ, STL (binary and text), PLY, OFF, VTK polydata and VRML 2.0 as doubles in file order, and writes OBJ. Bad
// files are InputErrors that name the line or byte. Degenerate triangles are data and are kept.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/types.hpp"

namespace trocar {

struct Mesh {
    std::string format = {};  ///< "obj", "stl-binary", "stl-ascii", "ply-ascii", "ply-binary", "off", "vrml",
                              ///< "vtk-ascii", "vtk-binary", "vtp"
    Matrix3X vertices = Matrix3X(3, 0);     ///< 3×N, the file's unit; STL: welded
    Triangles triangles = Triangles(3, 0);  ///< 3×T, file order, polygons fan-split, degenerate kept
    Index vertices_stored = 0;              ///< as stored in the file (STL: three per facet)
    std::string stated_unit = {};           ///< "mm", "cm", "m" or "in" when a comment of the file says so, else empty
    std::vector<std::string> objects = {};  ///< OBJ: names of its objects (o), else of its groups (g)
    std::vector<Index> object_of_triangle = {};  ///< T entries, into `objects`; -1: before the first; empty without any
    std::vector<std::string> ignored = {};       ///< surfaces in the file that are not polygons: "line 12: Sphere"
};

/// Reads a mesh. The extension (.obj .stl .ply .off .vtk .vtp .wrl .vrml, any case) decides the format and the content
/// must agree; with another extension the content decides. A mesh without triangles is valid. Throws InputError for a
/// missing or truncated file, an index out of range, a non-finite coordinate or compressed content. Throws also for a
/// polygon with fewer than three corners or a header that does not match the file's counts. Normals, colours and
/// texture coordinates are neither read nor checked.
Mesh read_mesh(const std::filesystem::path& file);

/// Writes vertices with 17 significant digits and triangles in order, to a temporary file that is then renamed. Throws
/// InputError when the folder cannot be written.
void write_obj(const std::filesystem::path& file, const Matrix3X& vertices, const Triangles& triangles);

/// p' = R·(s·p) + t evaluated in this order in double (DESIGN §10). rotation_degrees is a rotation vector about the
/// origin: its direction is the axis, its length the angle. R is built by Rodrigues' formula cos·I + sin·[k] + (1 −
/// cos)·k kᵀ and applied row by row, x then y then z.
void pose_vertices(double scale, const Vector3& translation, const Vector3& rotation_degrees, Matrix3X& vertices);

/// Merges identical positions (bit-equal, -0 = 0) in order of first appearance; the first one's bits stay.
void weld(Matrix3X& vertices, Triangles& triangles);

}  // namespace trocar
