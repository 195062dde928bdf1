// Generated bodies and scenes for tests of detectors, independent of the library's own shapes.
#pragma once

#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "scene/world.hpp"
#include "support/meshes.hpp"
#include "support/random_vectors.hpp"

namespace trocar::test {

/// Open rectangle of n × n quads from `corner` along u and v, normal u × v.
inline Shape rectangle(const Vector3& corner, const Vector3& u, const Vector3& v, int n) {
    Shape shape;
    for (int j = 0; j <= n; ++j) {
        for (int i = 0; i <= n; ++i) shape.vertices.emplace_back(corner + i * u / n + j * v / n);
    }
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
            const Index a = j * (n + 1) + i;
            const Index c = a + n + 2;
            shape.triangles.push_back({a, a + 1, c});
            shape.triangles.push_back({a, c, c - 1});
        }
    }
    return shape;
}

/// Open square sheet in the plane z = 0, centred at the origin, n × n quads.
inline Shape sheet(double size, int n) {
    return rectangle({-size / 2, -size / 2, 0.0}, {size, 0.0, 0.0}, {0.0, size, 0.0}, n);
}

/// Closed tube with flat caps along z from 0 to `length`: `around` sides, `along` rings. along = 1 gives slender
/// triangles.
inline Shape shaft(double radius, double length, int around, int along) {
    Shape shape;
    for (int j = 0; j <= along; ++j) {
        for (int i = 0; i < around; ++i) {
            const double angle = 2.0 * std::numbers::pi * i / around;
            shape.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), length * j / along);
        }
    }
    const auto bottom = static_cast<Index>(shape.vertices.size());
    shape.vertices.emplace_back(0.0, 0.0, 0.0);
    shape.vertices.emplace_back(0.0, 0.0, length);
    for (int j = 0; j < along; ++j) {
        for (int i = 0; i < around; ++i) {
            const Index a = j * around + i;
            const Index b = j * around + (i + 1) % around;
            shape.triangles.push_back({a, b, b + around});
            shape.triangles.push_back({a, b + around, a + around});
        }
    }
    for (int i = 0; i < around; ++i) {
        const Index next = (i + 1) % around;
        shape.triangles.push_back({bottom, next, i});
        shape.triangles.push_back({bottom + 1, along * around + i, along * around + next});
    }
    return shape;
}

/// Closed sphere of n × n quads on a longitude-latitude grid with poles.
inline Shape sphere(double radius, int n) {
    Shape shape;
    for (int j = 1; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
            const double theta = std::numbers::pi * j / n;
            const double phi = 2.0 * std::numbers::pi * i / n;
            shape.vertices.emplace_back(radius * std::sin(theta) * std::cos(phi),
                                        radius * std::sin(theta) * std::sin(phi), radius * std::cos(theta));
        }
    }
    const auto north = static_cast<Index>(shape.vertices.size());
    shape.vertices.emplace_back(0.0, 0.0, radius);
    shape.vertices.emplace_back(0.0, 0.0, -radius);
    for (int i = 0; i < n; ++i) {
        const Index next = (i + 1) % n;
        shape.triangles.push_back({north, i, next});
        shape.triangles.push_back({north + 1, (n - 2) * n + next, (n - 2) * n + i});
        for (int j = 0; j + 2 < n; ++j) {
            const Index a = j * n + i;
            const Index b = j * n + next;
            shape.triangles.push_back({a, a + n, b + n});
            shape.triangles.push_back({a, b + n, b});
        }
    }
    return shape;
}

/// Closed slab: two sheets of n × n quads, `thickness` apart, joined at the rim. The top is at z = 0.
inline Shape slab(double size, double thickness, int n) {
    Shape shape = sheet(size, n);
    Shape under = sheet(size, n);
    const auto shift = static_cast<Index>(shape.vertices.size());
    for (const Vector3& v : under.vertices) shape.vertices.emplace_back(v - Vector3(0.0, 0.0, thickness));
    for (const auto& t : under.triangles) shape.triangles.push_back({t[0] + shift, t[2] + shift, t[1] + shift});
    const auto wall = [&shape, shift](Index a, Index b) {
        shape.triangles.push_back({a, a + shift, b + shift});
        shape.triangles.push_back({a, b + shift, b});
    };
    for (int i = 0; i < n; ++i) {
        wall(i, i + 1);
        wall(i * (n + 1) + n, (i + 1) * (n + 1) + n);
        wall(n * (n + 1) + i + 1, n * (n + 1) + i);
        wall((i + 1) * (n + 1), i * (n + 1));
    }
    return shape;
}

/// `count` separate triangles with corners within `size` of centres in a cube of edge `extent` at the origin.
inline Shape soup(int count, double size, double extent, std::uint32_t seed) {
    Shape shape;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    const auto point = [&] { return random_vector(uniform, random); };
    for (int k = 0; k < count; ++k) {
        const Vector3 centre = extent / 2 * point();
        const auto first = static_cast<Index>(shape.vertices.size());
        for (int corner = 0; corner < 3; ++corner) shape.vertices.emplace_back(centre + size * point());
        shape.triangles.push_back({first, first + 1, first + 2});
    }
    return shape;
}

inline Shape triangle(const Vector3& a, const Vector3& b, const Vector3& c) { return {{a, b, c}, {{0, 1, 2}}}; }

/// Topology and first frame of a scene made of shapes.
struct World {
    std::string name;
    Topology topology;
    Frame frame;
};

struct Part {
    BodyKind kind = BodyKind::tissue;
    Shape shape = {};
    std::string instrument = {};
    bool closed = true;
};

inline Frame frame_of(Matrix3X position) {
    Frame frame;
    frame.previous = position;
    frame.velocity = Matrix3X::Zero(3, position.cols());
    frame.position = std::move(position);
    return frame;
}

inline World make_world(std::string name, const std::vector<Part>& parts) {
    std::vector<Body> bodies;
    std::size_t total = 0;
    for (const Part& part : parts) {
        Body body{.name = "body" + std::to_string(bodies.size()),
                  .kind = part.kind,
                  .closed = part.closed,
                  .instrument = part.instrument,
                  .vertex_count = static_cast<Index>(part.shape.vertices.size())};
        body.triangles = matrix_of(part.shape.triangles);
        bodies.push_back(std::move(body));
        total += part.shape.vertices.size();
    }
    Matrix3X position(3, static_cast<Eigen::Index>(total));
    Eigen::Index column = 0;
    for (const Part& part : parts) {
        for (const Vector3& v : part.shape.vertices) position.col(column++) = v;
    }
    return {std::move(name), make_topology(bodies), frame_of(std::move(position))};
}

}  // namespace trocar::test
