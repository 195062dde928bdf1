// Reads OBJ, STL (binary and text), PLY, OFF and VRML 2.0 as doubles in file order, and writes OBJ. Bad files are
// InputErrors that name the line or byte; degenerate triangles are data and are kept.
#pragma once

#include <filesystem>
#include <string>

#include "geometry/types.hpp"

namespace trocar {

struct Mesh {
    std::string format;         ///< "obj", "stl-binary", "stl-ascii", "ply-ascii", "ply-binary", "off", "vrml"
    Matrix3X vertices;          ///< 3×N, the file's unit; STL: welded
    Triangles triangles;        ///< 3×T, file order, polygons fan-split, degenerate kept
    Index vertices_stored = 0;  ///< as stored in the file (STL: three a facet)
};

/// Throws InputError (missing file, truncated, index out of range, non-finite number, header promises more …).
Mesh read_mesh(const std::filesystem::path& file);

/// Writes vertices with 17 significant digits, triangles in order; beside, then rename.
void write_obj(const std::filesystem::path& file, const Matrix3X& vertices, const Triangles& triangles);

/// p' = R·(s·p) + t evaluated in this order in double (DESIGN §10). rotation_degrees: rotation vector about the origin.
void pose_vertices(double scale, const Vector3& translation, const Vector3& rotation_degrees, Matrix3X& vertices);

/// Merges identical positions (bit-equal, -0 = 0) in order of first appearance.
void weld(Matrix3X& vertices, Triangles& triangles);

}  // namespace trocar
