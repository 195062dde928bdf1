#include "scene/shapes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "scene/rotation.hpp"

namespace trocar {
namespace {

using Type = ShapeParameter::Type;
using Fault = std::optional<ShapeFault>;

const double row_height = std::sqrt(0.75);  // of an equilateral triangle of edge 1

class Builder {
public:
    Index add(const Vector3& point) {
        points_.push_back(point);
        return static_cast<Index>(points_.size()) - 1;
    }
    void triangle(Index a, Index b, Index c) { triangles_.push_back({a, b, c}); }
    [[nodiscard]] const Vector3& point(Index i) const { return points_[static_cast<std::size_t>(i)]; }
    [[nodiscard]] Surface surface() const {
        Surface result;
        result.vertices.resize(3, static_cast<Eigen::Index>(points_.size()));
        for (std::size_t i = 0; i < points_.size(); ++i) result.vertices.col(static_cast<Eigen::Index>(i)) = points_[i];
        result.triangles.resize(3, static_cast<Eigen::Index>(triangles_.size()));
        for (std::size_t t = 0; t < triangles_.size(); ++t) {
            result.triangles.col(static_cast<Eigen::Index>(t)) << triangles_[t][0], triangles_[t][1], triangles_[t][2];
        }
        return result;
    }

private:
    std::vector<Vector3> points_;
    std::vector<std::array<Index, 3>> triangles_;
};

int steps(double length, double step, int fewest = 1) {
    return std::max(fewest, static_cast<int>(std::round(length / step)));
}

/// Segments of a circle whose chords are at most `edge` long.
int segments(double radius, double edge) {
    return std::max(6, static_cast<int>(std::ceil(2.0 * std::numbers::pi * radius / edge)));
}

using Section = std::vector<Index>;  // closed polygon, counter-clockwise about the direction of the loft

/// Band between two sections of as many points, each quadrilateral cut along its shorter diagonal.
void add_band(const Section& lower, const Section& upper, Builder& builder) {
    const std::size_t n = lower.size();
    for (std::size_t i = 0; i < n; ++i) {
        const std::size_t j = (i + 1) % n;
        const double rising = (builder.point(upper[j]) - builder.point(lower[i])).squaredNorm();
        const double falling = (builder.point(upper[i]) - builder.point(lower[j])).squaredNorm();
        constexpr double tie = 1.0 + 1e-9;  // equal diagonals must not be distinguished by rounding
        if (rising <= tie * falling) {
            builder.triangle(lower[i], lower[j], upper[j]);
            builder.triangle(lower[i], upper[j], upper[i]);
        } else {
            builder.triangle(lower[i], lower[j], upper[i]);
            builder.triangle(lower[j], upper[j], upper[i]);
        }
    }
}

/// Surface over sections between two poles.
void add_loft(const Vector3& first_pole, const std::vector<Section>& sections, const Vector3& last_pole,
              Builder& builder) {
    const Section& first = sections.front();
    const Section& last = sections.back();
    const std::size_t n = first.size();
    const Index bottom = builder.add(first_pole);
    for (std::size_t i = 0; i < n; ++i) builder.triangle(bottom, first[(i + 1) % n], first[i]);
    for (std::size_t k = 0; k + 1 < sections.size(); ++k) add_band(sections[k], sections[k + 1], builder);
    const Index top = builder.add(last_pole);
    for (std::size_t i = 0; i < n; ++i) builder.triangle(top, last[i], last[(i + 1) % n]);
}

/// Circle about `centre` in the plane of x and y (x × y is the direction of the loft), begun `half_turns` half segments
/// on: rings that alternate give nearly equilateral bands.
Section add_ring(const Vector3& centre, const Vector3& x, const Vector3& y, double radius, int count, int half_turns,
                 Builder& builder) {
    Section ring;
    for (int i = 0; i < count; ++i) {
        const SineCosine at = sine_cosine_of_degrees(180.0 * (2 * i + half_turns) / count);
        ring.push_back(builder.add(centre + radius * (at.cosine * x + at.sine * y)));
    }
    return ring;
}

struct ProfilePoint {
    double radius = 0.0;
    double z = 0.0;
};

std::vector<Section> add_rings(const std::vector<ProfilePoint>& profile, int count, Builder& builder) {
    std::vector<Section> rings;
    for (std::size_t k = 0; k < profile.size(); ++k) {
        rings.push_back(add_ring(Vector3(0.0, 0.0, profile[k].z), Vector3::UnitX(), Vector3::UnitY(), profile[k].radius,
                                 count, static_cast<int>(k % 2), builder));
    }
    return rings;
}

/// Body of revolution about z from pole to pole; the profile holds the rings between.
Surface revolve(double first_pole, const std::vector<ProfilePoint>& profile, double last_pole, int count) {
    Builder builder;
    const std::vector<Section> rings = add_rings(profile, count, builder);
    add_loft(Vector3(0.0, 0.0, first_pole), rings, Vector3(0.0, 0.0, last_pole), builder);
    return builder.surface();
}

/// Points after `from` up to and with `to`.
void add_line(ProfilePoint from, ProfilePoint to, double edge, std::vector<ProfilePoint>& profile) {
    const double dr = to.radius - from.radius;
    const double dz = to.z - from.z;
    const int n = steps(std::sqrt(dr * dr + dz * dz), edge * row_height);
    for (int k = 1; k < n; ++k) profile.push_back({from.radius + dr * k / n, from.z + dz * k / n});
    profile.push_back(to);
}

/// Arc about (0, centre_z) between two angles measured from the -z axis, without its first point.
void add_arc(double centre_z, double radius, double from_degrees, double to_degrees, double edge,
             std::vector<ProfilePoint>& profile) {
    const double length = radius * (to_degrees - from_degrees) * std::numbers::pi / 180.0;
    const int n = steps(length, edge * row_height, 2);
    for (int k = 1; k <= n; ++k) {
        const SineCosine at = sine_cosine_of_degrees(from_degrees + (to_degrees - from_degrees) * k / n);
        profile.push_back({radius * at.sine, centre_z - radius * at.cosine});
    }
}

// ---- sheets ----

/// Lattice of nearly equilateral triangles: rows of edges along x, each row at the (y, z) that `place` gives.
template <typename Place>
Surface lattice(double width, int columns, int rows, const Place& place) {
    Builder builder;
    std::vector<Section> lines;
    for (int j = 0; j <= rows; ++j) {
        const auto [y, z] = place(j);
        Section line;
        const auto add = [&, y = y, z = z](double column) {
            line.push_back(builder.add(Vector3(width * (column / columns - 0.5), y, z)));
        };
        if (j % 2 == 0) {
            for (int i = 0; i <= columns; ++i) add(i);
        } else {  // half a step on, with a half triangle at either end so that the rim is straight
            add(0.0);
            for (int i = 0; i < columns; ++i) add(i + 0.5);
            add(columns);
        }
        lines.push_back(std::move(line));
    }
    for (std::size_t j = 0; j + 1 < lines.size(); ++j) {
        const bool even_below = j % 2 == 0;
        const Section& even = lines[even_below ? j : j + 1];
        const Section& odd = lines[even_below ? j + 1 : j];
        const auto add = [&](Index a, Index b, Index c) {  // given counter-clockwise for even_below
            if (even_below) {
                builder.triangle(a, b, c);
            } else {
                builder.triangle(a, c, b);
            }
        };
        for (std::size_t i = 0; i < even.size(); ++i) {
            add(even[i], odd[i + 1], odd[i]);
            if (i + 1 < even.size()) add(even[i], even[i + 1], odd[i + 1]);
        }
    }
    return builder.surface();
}

Surface make_sheet(const ShapeValues& values) {
    const std::vector<double>& size = values.numbers.find("size")->second;
    const double edge = values.number("edge");
    const int rows = steps(size[1], edge * row_height);
    return lattice(size[0], steps(size[0], edge), rows,
                   [&](int j) { return std::pair(size[1] * (static_cast<double>(j) / rows - 0.5), 0.0); });
}

Surface make_arch(const ShapeValues& values) {
    const double radius = values.number("radius");
    const double angle = values.number("angle");
    const double edge = values.number("edge");
    const double arc = radius * angle * std::numbers::pi / 180.0;
    const int rows = 2 * steps(arc, 2.0 * edge * row_height);  // even: a row of edges runs along the crest
    return lattice(values.number("length"), steps(values.number("length"), edge), rows, [&](int j) {
        const SineCosine at = sine_cosine_of_degrees(angle * (static_cast<double>(j) / rows - 0.5));
        return std::pair(radius * at.sine, radius * at.cosine);
    });
}

double estimate_arch(const ShapeValues& values) {
    const double edge = values.number("edge");
    return 2.0 * (values.number("length") / edge + 3.0) * (7.0 * values.number("radius") / (edge * row_height) + 3.0);
}

double estimate_sheet(const ShapeValues& values) {
    const std::vector<double>& size = values.numbers.find("size")->second;
    const double edge = values.number("edge");
    return 2.0 * (size[0] / edge + 3.0) * (size[1] / (edge * row_height) + 2.0);
}

Surface make_disc(const ShapeValues& values) {
    const double radius = values.number("radius");
    const int rings = steps(radius, values.number("edge"));
    Builder builder;
    builder.add(Vector3::Zero());
    const auto number = [](int ring, int i) {  // of vertex i of a ring with 6·ring vertices
        return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1) + i % (6 * ring);
    };
    for (int k = 1; k <= rings; ++k) {
        for (int i = 0; i < 6 * k; ++i) {
            const SineCosine at = sine_cosine_of_degrees(60.0 * i / k);
            builder.add(radius * k / rings * Vector3(at.cosine, at.sine, 0.0));
        }
        for (int sector = 0; sector < 6; ++sector) {
            for (int i = 0; i < k; ++i) {
                const Index outer = number(k, sector * k + i + 1);
                builder.triangle(number(k - 1, sector * (k - 1) + i), number(k, sector * k + i), outer);
                if (i + 1 < k) {
                    builder.triangle(number(k - 1, sector * (k - 1) + i), outer,
                                     number(k - 1, sector * (k - 1) + i + 1));
                }
            }
        }
    }
    return builder.surface();
}

double estimate_disc(const ShapeValues& values) {
    const double rings = values.number("radius") / values.number("edge") + 1.0;
    return 6.0 * rings * rings;
}

Surface make_triangle(const ShapeValues& values) {
    const std::vector<double>& corners = values.numbers.find("corners")->second;
    Builder builder;
    for (std::size_t i = 0; i < 9; i += 3) builder.add(Vector3(corners[i], corners[i + 1], corners[i + 2]));
    builder.triangle(0, 1, 2);
    return builder.surface();
}

// ---- closed bodies ----

Surface make_box(const ShapeValues& values) {
    const Vector3 size = values.vector3("size");
    std::array<int, 3> count{};
    for (int axis = 0; axis < 3; ++axis)
        count[static_cast<std::size_t>(axis)] = steps(size[axis], values.number("edge"));
    Builder builder;
    std::unordered_map<std::int64_t, Index> known;
    const auto vertex = [&](const std::array<int, 3>& at) {
        const std::int64_t key = (std::int64_t{at[0]} * (count[1] + 1) + at[1]) * (count[2] + 1) + at[2];
        const auto [entry, is_new] = known.try_emplace(key, -1);
        if (is_new) {
            Vector3 point;
            for (int axis = 0; axis < 3; ++axis) {
                const auto a = static_cast<std::size_t>(axis);
                point[axis] = size[axis] * (static_cast<double>(at[a]) / count[a] - 0.5);
            }
            entry->second = builder.add(point);
        }
        return entry->second;
    };
    for (std::size_t normal = 0; normal < 3; ++normal) {
        const std::size_t u = (normal + 1) % 3;
        const std::size_t v = (normal + 2) % 3;
        for (const bool upper : {false, true}) {
            for (int i = 0; i < count[u]; ++i) {
                for (int j = 0; j < count[v]; ++j) {
                    const auto corner = [&](int di, int dj) {
                        std::array<int, 3> at{};
                        at[normal] = upper ? count[normal] : 0;
                        at[u] = i + di;
                        at[v] = j + dj;
                        return vertex(at);
                    };
                    const Index a = corner(0, 0);
                    const Index b = upper ? corner(1, 0) : corner(0, 1);
                    const Index c = corner(1, 1);
                    const Index d = upper ? corner(0, 1) : corner(1, 0);
                    builder.triangle(a, b, c);
                    builder.triangle(a, c, d);
                }
            }
        }
    }
    return builder.surface();
}

double estimate_box(const ShapeValues& values) {
    const Vector3 n = (values.vector3("size") / values.number("edge")).array() + 1.0;
    return 4.0 * (n.x() * n.y() + n.y() * n.z() + n.z() * n.x());
}

/// 20 n² triangles on a sphere of radius r have the mean area of an equilateral triangle of edge 1.2046 r / n.
constexpr double geodesic_edge = 1.2046;

/// Icosahedron with every edge cut in n, projected onto the unit sphere.
Surface geodesic_sphere(int n) {
    const double golden = 0.5 * (1.0 + std::sqrt(5.0));
    const double unit = 1.0 / std::sqrt(1.0 + golden * golden);
    Builder builder;
    for (const double s : {-1.0, 1.0}) {
        for (const double t : {-golden, golden}) {
            builder.add(unit * Vector3(s, t, 0.0));
            builder.add(unit * Vector3(0.0, s, t));
            builder.add(unit * Vector3(t, 0.0, s));
        }
    }
    // Three corners at mutual distance of one edge are a face: no table to get wrong.
    std::vector<std::array<Index, 3>> faces;
    const double edge = 2.0 * unit;
    const auto near = [&](Index a, Index b) {
        return std::fabs((builder.point(a) - builder.point(b)).norm() - edge) < 0.01;
    };
    for (Index a = 0; a < 12; ++a) {
        for (Index b = a + 1; b < 12; ++b) {
            for (Index c = b + 1; c < 12; ++c) {
                if (!near(a, b) || !near(b, c) || !near(c, a)) continue;
                const bool outward = builder.point(a).dot(builder.point(b).cross(builder.point(c))) > 0.0;
                faces.push_back({a, outward ? b : c, outward ? c : b});
            }
        }
    }
    const auto on_sphere = [](const Vector3& p) {
        return Vector3(p / std::sqrt(p.x() * p.x() + p.y() * p.y() + p.z() * p.z()));
    };
    std::unordered_map<Index, std::vector<Index>> edges;  // by 12·low + high: points from low to high
    const auto along = [&](Index from, Index to, int step) {
        const Index low = std::min(from, to);
        const Index high = std::max(from, to);
        std::vector<Index>& points = edges[12 * low + high];
        if (points.empty()) {
            points.push_back(low);
            for (int i = 1; i < n; ++i) {
                const Vector3 sum = static_cast<double>(n - i) * builder.point(low) + i * builder.point(high);
                points.push_back(builder.add(on_sphere(sum)));
            }
            points.push_back(high);
        }
        return points[static_cast<std::size_t>(from == low ? step : n - step)];
    };
    for (const auto& [a, b, c] : faces) {
        std::vector<Section> rows;  // row r runs from the edge a-b to the edge a-c
        for (int r = 0; r <= n; ++r) {
            Section row;
            for (int i = 0; i <= r; ++i) {
                if (r == 0) {
                    row.push_back(a);
                } else if (i == 0) {
                    row.push_back(along(a, b, r));
                } else if (i == r) {
                    row.push_back(along(a, c, r));
                } else if (r == n) {
                    row.push_back(along(b, c, i));
                } else {
                    const Vector3 sum = static_cast<double>(n - r) * builder.point(a) +
                                        static_cast<double>(r - i) * builder.point(b) + i * builder.point(c);
                    row.push_back(builder.add(on_sphere(sum)));
                }
            }
            rows.push_back(std::move(row));
        }
        for (std::size_t r = 0; r + 1 < rows.size(); ++r) {
            for (std::size_t i = 0; i < rows[r].size(); ++i) {
                builder.triangle(rows[r][i], rows[r + 1][i], rows[r + 1][i + 1]);
                if (i + 1 < rows[r].size()) builder.triangle(rows[r][i], rows[r + 1][i + 1], rows[r][i + 1]);
            }
        }
    }
    return builder.surface();
}

Surface make_sphere(const ShapeValues& values) {
    const double radius = values.number("radius");
    Surface surface = geodesic_sphere(steps(geodesic_edge * radius, values.number("edge")));
    surface.vertices *= radius;
    return surface;
}

double estimate_geodesic(double radius, double edge) {
    const double n = geodesic_edge * radius / edge + 1.0;
    return 20.0 * n * n;
}

double estimate_sphere(const ShapeValues& values) {
    return estimate_geodesic(values.number("radius"), values.number("edge"));
}

Surface make_ellipsoid(const ShapeValues& values) {
    const Vector3 radii = values.vector3("radii");
    Surface surface = geodesic_sphere(steps(geodesic_edge * radii.maxCoeff(), values.number("edge")));
    surface.vertices = (radii.asDiagonal() * surface.vertices).eval();
    return surface;
}

double estimate_ellipsoid(const ShapeValues& values) {
    return estimate_geodesic(values.vector3("radii").maxCoeff(), values.number("edge"));
}

/// Radius of the organ in a direction: bumps and one hollow, each a smooth rational function of the direction.
double organ_radius(const Vector3& direction, double lumpiness) {
    struct Bump {
        Vector3 centre;
        double height;
        double sharpness;
    };
    static const std::array<Bump, 5> bumps{{{Vector3(0.8, 0.3, 0.5), 0.7, 3.0},
                                            {Vector3(-0.7, 0.5, 0.4), 0.4, 5.0},
                                            {Vector3(-0.3, -0.9, 0.2), 0.5, 4.0},
                                            {Vector3(0.2, 0.6, -0.7), 0.3, 6.0},
                                            {Vector3(0.1, -0.2, -1.0), -0.55, 4.0}}};
    double radius = 1.0;
    for (const Bump& bump : bumps) {
        const Vector3 d = direction - bump.centre;
        radius += lumpiness * bump.height / (1.0 + bump.sharpness * (d.x() * d.x() + d.y() * d.y() + d.z() * d.z()));
    }
    return radius;
}

Surface make_organ(const ShapeValues& values) {
    const Vector3 size = values.vector3("size");
    Surface surface = geodesic_sphere(steps(geodesic_edge * 0.5 * size.maxCoeff(), values.number("edge")));
    const double lumpiness = values.number("lumpiness");
    for (Eigen::Index i = 0; i < surface.vertices.cols(); ++i) {
        const Vector3 direction = surface.vertices.col(i);
        surface.vertices.col(i) = organ_radius(direction, lumpiness) * direction;
    }
    // The box is the given size, centred on the origin.
    const Vector3 low = surface.vertices.rowwise().minCoeff();
    const Vector3 high = surface.vertices.rowwise().maxCoeff();
    for (int axis = 0; axis < 3; ++axis) {
        const double span = high[axis] - low[axis];
        for (Eigen::Index i = 0; i < surface.vertices.cols(); ++i) {
            surface.vertices(axis, i) = size[axis] * ((surface.vertices(axis, i) - low[axis]) / span - 0.5);
        }
    }
    return surface;
}

double estimate_organ(const ShapeValues& values) {
    return estimate_geodesic(0.5 * values.vector3("size").maxCoeff(), values.number("edge"));
}

double estimate_revolved(double radius, double length, double edge) {
    return 2.0 * (2.0 * std::numbers::pi * radius / edge + 7.0) * (length / (edge * row_height) + 8.0);
}

Surface make_tube(const ShapeValues& values) {
    const double outer = values.number("radius");
    const double inner = outer - values.number("wall");
    const double half = 0.5 * values.number("length");
    const double edge = values.number("edge");
    std::vector<ProfilePoint> profile;
    add_line({outer, -half}, {outer, half}, edge, profile);
    add_line({outer, half}, {inner, half}, edge, profile);
    add_line({inner, half}, {inner, -half}, edge, profile);
    add_line({inner, -half}, {outer, -half}, edge, profile);
    Builder builder;
    const std::vector<Section> rings = add_rings(profile, segments(outer, edge), builder);
    for (std::size_t k = 0; k < rings.size(); ++k) add_band(rings[k], rings[(k + 1) % rings.size()], builder);
    return builder.surface();
}

Fault check_tube(const ShapeValues& values) {
    if (values.number("wall") < values.number("radius")) return std::nullopt;
    return ShapeFault{"wall", "a wall thinner than the radius"};
}

double estimate_tube(const ShapeValues& values) {
    return estimate_revolved(values.number("radius"), 2.0 * (values.number("length") + values.number("wall")),
                             values.number("edge"));
}

Surface make_bone(const ShapeValues& values) {
    const double radius = values.number("radius");
    const double head = values.number("head_radius");
    const double edge = values.number("edge");
    const double centre = 0.5 * values.number("length") - head;  // of the head, from the middle
    std::vector<ProfilePoint> profile;
    add_arc(-centre, head, 0.0, 90.0, edge, profile);
    const int rows = steps(2.0 * centre, edge * row_height, 2);
    for (int k = 1; k < rows; ++k) {
        // Smooth step from the shaft's radius in the middle to the head's: no kink at either end.
        const double u = 2.0 * k / rows - 1.0;
        const double w = u * u * (3.0 - 2.0 * std::fabs(u));
        profile.push_back({radius + (head - radius) * w, centre * u});
    }
    profile.push_back({head, centre});
    add_arc(centre, head, 90.0, 180.0, edge, profile);
    profile.pop_back();  // the pole
    return revolve(-centre - head, profile, centre + head, segments(head, edge));
}

Fault check_bone(const ShapeValues& values) {
    if (values.number("head_radius") < values.number("radius")) {
        return ShapeFault{"head_radius", "at least the radius of the shaft"};
    }
    if (values.number("length") <= 2.0 * values.number("head_radius")) {
        return ShapeFault{"length", "more than the two heads"};
    }
    return std::nullopt;
}

double estimate_bone(const ShapeValues& values) {
    return estimate_revolved(values.number("head_radius"), values.number("length") + 4.0 * values.number("head_radius"),
                             values.number("edge"));
}

// ---- instruments ----

Surface make_shaft(const ShapeValues& values) {
    const double radius = values.number("radius");
    const double length = values.number("length");
    const double edge = values.number("edge");
    std::vector<ProfilePoint> profile;
    double side = 0.0;
    if (values.word("tip") == "round") {
        add_arc(radius, radius, 0.0, 90.0, edge, profile);
        side = radius;
    } else {
        add_line({0.0, 0.0}, {radius, 0.0}, edge, profile);
    }
    add_line({radius, side}, {radius, length}, edge, profile);
    add_line({radius, length}, {0.0, length}, edge, profile);
    profile.pop_back();  // the pole
    return revolve(0.0, profile, length, segments(radius, edge));
}

Fault check_shaft(const ShapeValues& values) {
    if (values.number("length") > values.number("radius")) return std::nullopt;
    return ShapeFault{"length", "more than the radius"};
}

double estimate_shaft(const ShapeValues& values) {
    return estimate_revolved(values.number("radius"), values.number("length") + 3.0 * values.number("radius"),
                             values.number("edge"));
}

Surface make_needle(const ShapeValues& values) {
    const double radius = values.number("radius");
    const double point = values.number("tip_length");
    const double length = values.number("length");
    const double edge = values.number("edge");
    std::vector<ProfilePoint> profile;
    add_line({0.0, 0.0}, {radius, point}, edge, profile);
    add_line({radius, point}, {radius, length}, edge, profile);
    add_line({radius, length}, {0.0, length}, edge, profile);
    profile.pop_back();  // the pole
    return revolve(0.0, profile, length, segments(radius, edge));
}

Fault check_needle(const ShapeValues& values) {
    if (values.number("length") > values.number("tip_length")) return std::nullopt;
    return ShapeFault{"length", "more than the tip"};
}

Surface make_jaw(const ShapeValues& values) {
    const double radius = values.number("radius");
    const double length = values.number("length");
    const double edge = values.number("edge");
    const int arc = std::max(4, static_cast<int>(std::ceil(std::numbers::pi * radius / edge)));
    const int chord = std::max(2, static_cast<int>(std::ceil(2.0 * radius / edge)));
    std::vector<ProfilePoint> profile;
    add_arc(radius, radius, 0.0, 90.0, edge, profile);
    add_line({radius, radius}, {radius, length - radius}, edge, profile);
    add_arc(length - radius, radius, 90.0, 180.0, edge, profile);
    profile.pop_back();  // the pole
    Builder builder;
    std::vector<Section> sections;
    for (const ProfilePoint& at : profile) {
        Section half_disc;
        for (int i = 0; i < arc; ++i) {
            const SineCosine turn = sine_cosine_of_degrees(180.0 * i / arc);
            half_disc.push_back(builder.add(Vector3(at.radius * turn.cosine, at.radius * turn.sine, at.z)));
        }
        for (int i = 0; i < chord; ++i) {
            half_disc.push_back(builder.add(Vector3(at.radius * (2.0 * i / chord - 1.0), 0.0, at.z)));
        }
        sections.push_back(std::move(half_disc));
    }
    add_loft(Vector3::Zero(), sections, Vector3(0.0, 0.0, length), builder);
    return builder.surface();
}

Fault check_jaw(const ShapeValues& values) {
    if (values.number("length") > 2.0 * values.number("radius")) return std::nullopt;
    return ShapeFault{"length", "more than twice the radius"};
}

Surface make_hook(const ShapeValues& values) {
    const double radius = values.number("radius");
    const double length = values.number("length");
    const double bend = values.number("bend_radius");
    const double angle = values.number("bend_angle");
    const double edge = values.number("edge");
    const int count = segments(radius, edge);
    const int cap = steps(radius * std::numbers::pi / 2.0, edge * row_height, 2);
    const int straight = steps(length, edge * row_height);
    const int bent = steps((bend + radius) * angle * std::numbers::pi / 180.0, edge * row_height, 2);
    const Vector3 side = Vector3::UnitY();
    Builder builder;
    std::vector<Section> rings;
    // From the top down the straight rod and round the bend; `t` is the direction of travel.
    const auto add = [&](const Vector3& centre, const Vector3& t, double ring_radius) {
        rings.push_back(
            add_ring(centre, side.cross(t), side, ring_radius, count, static_cast<int>(rings.size() % 2), builder));
    };
    const Vector3 down = -Vector3::UnitZ();
    for (int k = 1; k < cap; ++k) {
        const SineCosine at = sine_cosine_of_degrees(90.0 * k / cap);
        add(Vector3(0.0, 0.0, length) - radius * at.cosine * down, down, radius * at.sine);
    }
    for (int k = 0; k <= straight; ++k) add(Vector3(0.0, 0.0, length - length * k / straight), down, radius);
    Vector3 end = Vector3::Zero();
    Vector3 t = down;
    for (int k = 1; k <= bent; ++k) {
        const SineCosine at = sine_cosine_of_degrees(angle * k / bent);
        end = Vector3(bend - bend * at.cosine, 0.0, -bend * at.sine);
        t = Vector3(at.sine, 0.0, -at.cosine);
        add(end, t, radius);
    }
    for (int k = cap - 1; k > 0; --k) {
        const SineCosine at = sine_cosine_of_degrees(90.0 * k / cap);
        add(end + radius * at.cosine * t, t, radius * at.sine);
    }
    add_loft(Vector3(0.0, 0.0, length + radius), rings, end + radius * t, builder);
    return builder.surface();
}

Fault check_hook(const ShapeValues& values) {
    if (values.number("bend_radius") > values.number("radius")) return std::nullopt;
    return ShapeFault{"bend_radius", "more than the radius of the rod"};
}

double estimate_hook(const ShapeValues& values) {
    return estimate_revolved(
        values.number("radius"),
        values.number("length") + 4.0 * values.number("bend_radius") + 4.0 * values.number("radius"),
        values.number("edge"));
}

// ---- the table ----

const ShapeParameter edge_parameter{.name = "edge", .meaning = "length of a triangle's edge, about"};

ShapeParameter length_of(std::string name, std::string meaning) {
    return {.name = std::move(name), .meaning = std::move(meaning)};
}

std::vector<Shape> make_table() {
    const ShapeParameter size3{.name = "size", .type = Type::lengths3, .meaning = "extent in x, y and z"};
    const ShapeParameter radius = length_of("radius", "radius");
    const ShapeParameter length = length_of("length", "extent in z");
    return {
        {"sheet",
         false,
         "flat sheet of nearly equilateral triangles with a straight rim, centred on the origin, normal +z",
         {{.name = "size", .type = Type::lengths2, .meaning = "extent in x and y"}, edge_parameter},
         nullptr,
         estimate_sheet,
         make_sheet},
        {"disc",
         false,
         "flat round sheet of rings, centred on the origin, normal +z; its triangles are unequal (edges 1 to 1.5 x "
         "edge) and so is its tension: membranes that are held against a formula are sheets",
         {radius, edge_parameter},
         nullptr,
         estimate_disc,
         make_disc},
        {"arch",
         false,
         "sheet bent about the x axis, crest at z = radius, normal outward",
         {length_of("radius", "radius of the bend"),
          {.name = "angle",
           .type = Type::degrees,
           .meaning = "180 is half a pipe",
           .default_number = 180.0,
           .minimum = 1.0,
           .maximum = 350.0},
          length_of("length", "extent in x"),
          edge_parameter},
         nullptr,
         estimate_arch,
         make_arch},
        {"triangle",
         false,
         "one triangle",
         {{.name = "corners", .type = Type::points3, .meaning = "its corners, counter-clockwise seen from the front"}},
         nullptr,
         [](const ShapeValues&) { return 1.0; },
         make_triangle},
        {"box", true, "block, centred on the origin", {size3, edge_parameter}, nullptr, estimate_box, make_box},
        {"sphere",
         true,
         "geodesic sphere, centred on the origin",
         {radius, edge_parameter},
         nullptr,
         estimate_sphere,
         make_sphere},
        {"ellipsoid",
         true,
         "geodesic sphere stretched along the axes, centred on the origin",
         {{.name = "radii", .type = Type::lengths3, .meaning = "half axes in x, y and z"}, edge_parameter},
         nullptr,
         estimate_ellipsoid,
         make_ellipsoid},
        {"organ",
         true,
         "smooth lumpy body with a hollow on its -z side, centred on the origin",
         {size3,
          edge_parameter,
          {.name = "lumpiness",
           .type = Type::ratio,
           .meaning = "0 an ellipsoid, 1 strong lumps",
           .default_number = 0.5,
           .minimum = 0.0,
           .maximum = 1.0}},
         nullptr,
         estimate_organ,
         make_organ},
        {"tube",
         true,
         "vessel about the z axis with a wall that is closed at both ends, centred on the origin",
         {length_of("radius", "outer radius"), length_of("wall", "thickness of the wall"), length, edge_parameter},
         check_tube,
         estimate_tube,
         make_tube},
        {"bone",
         true,
         "shaft with two round heads along z, centred on the origin",
         {length_of("radius", "radius in the middle"), length_of("head_radius", "radius of the heads"), length,
          edge_parameter},
         check_bone,
         estimate_bone,
         make_bone},
        {"shaft",
         true,
         "instrument shaft from its tip at the origin along +z",
         {radius,
          length,
          edge_parameter,
          {.name = "tip", .type = Type::choice, .meaning = "hemisphere or flat end", .choices = {"round", "flat"}}},
         check_shaft,
         estimate_shaft,
         make_shaft},
        {"needle",
         true,
         "cone with its point at the origin, then a cylinder along +z",
         {radius, length, length_of("tip_length", "length of the cone"), edge_parameter},
         check_needle,
         estimate_shaft,
         make_needle},
        {"jaw",
         true,
         "half of a capsule from the origin along +z: flat face on y = 0, round side towards +y",
         {radius, length, edge_parameter},
         check_jaw,
         estimate_shaft,
         make_jaw},
        {"hook",
         true,
         "rod from z = length down to the origin, there bent towards +x; both ends round",
         {length_of("radius", "radius of the rod"),
          length_of("length", "straight part"),
          length_of("bend_radius", "radius of the bend's axis"),
          {.name = "bend_angle",
           .type = Type::degrees,
           .meaning = "90 points along +x, 180 back up",
           .default_number = 90.0,
           .minimum = 1.0,
           .maximum = 180.0},
          edge_parameter},
         check_hook,
         estimate_hook,
         make_hook},
    };
}

}  // namespace

Vector3 ShapeValues::vector3(std::string_view name) const {
    const std::vector<double>& values = numbers.find(name)->second;
    return {values[0], values[1], values[2]};
}

const std::vector<Shape>& shapes() {
    static const std::vector<Shape> table = make_table();
    return table;
}

const Shape* find_shape(std::string_view name) {
    for (const Shape& shape : shapes()) {
        if (shape.name == name) return &shape;
    }
    return nullptr;
}

}  // namespace trocar
