// Points and triangles of lists, and both as matrices.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "geometry/exact.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/types.hpp"
#include "scene/world.hpp"
#include "support/random_vectors.hpp"

namespace trocar::test {

using Faces = std::vector<std::array<Index, 3>>;

inline Matrix3X matrix_of(const std::vector<Vector3>& points) {
    Matrix3X matrix(3, static_cast<Eigen::Index>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) matrix.col(static_cast<Eigen::Index>(i)) = points[i];
    return matrix;
}

inline Triangles matrix_of(const Faces& faces) {
    Triangles matrix(3, static_cast<Eigen::Index>(faces.size()));
    for (std::size_t i = 0; i < faces.size(); ++i) {
        matrix.col(static_cast<Eigen::Index>(i)) << faces[i][0], faces[i][1], faces[i][2];
    }
    return matrix;
}

/// Vertices and triangles of one body.
struct Shape {
    std::vector<Vector3> vertices;
    Faces triangles;

    Shape& add(const Shape& other) {
        const auto first = static_cast<Index>(vertices.size());
        vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
        for (const auto& [a, b, c] : other.triangles) triangles.push_back({a + first, b + first, c + first});
        return *this;
    }
    Shape& move(const Vector3& by) {
        for (Vector3& v : vertices) v += by;
        return *this;
    }
    Shape& rotate(const Vector3& axis, double angle) {
        const Matrix3 rotation = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
        for (Vector3& v : vertices) v = rotation * v;
        return *this;
    }
    Shape& scale(double factor) {
        for (Vector3& v : vertices) v *= factor;
        return *this;
    }
    Shape& shake(double amplitude, std::uint32_t seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> uniform(-amplitude, amplitude);
        for (Vector3& v : vertices) v += random_vector(uniform, random);
        return *this;
    }
};

inline void write_obj(const std::filesystem::path& file, const Shape& shape) {
    trocar::write_obj(file, matrix_of(shape.vertices), matrix_of(shape.triangles));
}

/// A body that is one triangle.
inline Body triangle_body(const std::string& name, BodyKind kind, bool closed = true,
                          const std::string& instrument = {}) {
    return {.name = name,
            .kind = kind,
            .closed = closed,
            .instrument = instrument,
            .vertex_count = 3,
            .triangles = matrix_of(Faces{{0, 1, 2}})};
}

struct TriangleMesh {
    Matrix3X position;
    Triangles triangles;

    TriangleMesh(const std::vector<Vector3>& points, const Faces& faces)
        : position(matrix_of(points)), triangles(matrix_of(faces)) {}
    [[nodiscard]] Index count() const { return static_cast<Index>(triangles.cols()); }
    [[nodiscard]] Corners corners(Index t) const { return corners_of(triangles, position, t); }
};

/// Needles in bundles, and some triangles across them.
inline TriangleMesh needles_and_faces(std::mt19937_64& random, Index count) {
    std::uniform_real_distribution<double> place(-1.0, 1.0);
    const auto anywhere = [&] { return random_vector(place, random); };
    std::vector<Vector3> points;
    Faces faces;
    const Vector3 along = anywhere();
    for (Index t = 0; t < count; ++t) {
        const Vector3 p = anywhere();
        const Vector3 q = t % 4 == 0 ? anywhere() : Vector3(p + along);
        const Vector3 r = t % 8 == 0 ? anywhere() : Vector3(q + 1e-3 * anywhere());
        points.insert(points.end(), {p, q, r});
        faces.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    return {points, faces};
}

/// The cube from (0, 0, 0) to (1, 1, 1); bits 0, 1 and 2 of a corner's number are its x, y and z.
inline const Faces cube_faces{{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                              {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};

inline std::vector<Vector3> cube_points(const Vector3& low, const Vector3& size) {
    std::vector<Vector3> points;
    for (int i = 0; i < 8; ++i) points.push_back(low + size.cwiseProduct(Vector3(i & 1, (i >> 1) & 1, (i >> 2) & 1)));
    return points;
}

/// Closed box, outward normals.
inline Shape box_of(const Vector3& low, const Vector3& size) { return {cube_points(low, size), cube_faces}; }

}  // namespace trocar::test
