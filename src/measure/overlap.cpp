#include "measure/overlap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "measure/vertical_crossings.hpp"

namespace trocar {
namespace {

std::array<Vector3, 13> make_directions() {
    std::array<Vector3, 13> directions{};
    std::size_t next = 0;
    for (int x = 0; x <= 1; ++x) {
        for (int y = -1; y <= 1; ++y) {
            for (int z = -1; z <= 1; ++z) {
                // One of each two opposite vectors.
                const bool first = x > 0 || y > 0 || (y == 0 && z > 0);
                if (!first || (x == 0 && y < 0)) continue;
                directions.at(next++) = Vector3(x, y, z).normalized();
            }
        }
    }
    return directions;
}

/// A rotation that turns `direction` (unit, not -z) to +z by the smallest angle. Written out, because Eigen's
/// FromTwoVectors brings an SVD for the case of opposite vectors, which took a tenth of this folder's time to compile.
Matrix3 turn_to_z(const Vector3& direction) {
    const double twice_half_cosine = std::sqrt(2.0 * (1.0 + direction.z()));
    const Vector3 axis = direction.cross(Vector3::UnitZ()) / twice_half_cosine;
    return Quaternion(0.5 * twice_half_cosine, axis.x(), axis.y(), axis.z()).toRotationMatrix();
}

/// A vertical line and the directed edge u→v of a triangle, seen from above.
struct Turn {
    double area = 0.0;  ///< m², twice the signed area of (line, u, v), rounded
    int side = 0;       ///< its sign, exact, as side_of_line has it

    Turn(const Vector3& line, const Vector3& u, const Vector3& v) {
        const double left = (u.x() - line.x()) * (v.y() - line.y());
        const double right = (u.y() - line.y()) * (v.x() - line.x());
        area = left - right;
        // Above the rounding error, underflow included.
        const double unsure =
            4.0 * std::numeric_limits<double>::epsilon() * (std::abs(left) + std::abs(right)) + 1e-280;
        side = area > unsure ? 1 : area < -unsure ? -1 : side_of_line(u, v, line);
    }
};

/// Moves the lines off the round coordinates on which the vertices of generated meshes lie.
constexpr double line_shift = 0.4833333;

/// The first line at or after `from` that a bundle of every stride-th line has.
int next_line(int from, int stride) { return (from + stride - 1) / stride * stride; }

double coordinate(double low, double high, int i) { return low + (high - low) * (i + line_shift) / overlap_lines; }

}  // namespace

std::span<const Vector3> translation_directions() {
    static const std::array<Vector3, 13> directions = make_directions();
    return directions;
}

void OverlapTruth::pierce(const Triangles& triangles, Range range, const Matrix3X& turned, const Bundle& bundle,
                          int stride, const Lines* met, Lines& lines) {
    lines.resize(static_cast<std::size_t>(overlap_lines) * overlap_lines);
    for (auto& line : lines) line.clear();
    const double scale_u = overlap_lines / (bundle.high_u - bundle.low_u);
    const double scale_v = overlap_lines / (bundle.high_v - bundle.low_v);
    // A line on the border of a triangle's box belongs to it, however its number is rounded.
    constexpr double slack = 1e-9;
    const auto first_at = [](double from, double low, double scale) {
        const double line = (from - low) * scale - line_shift - slack;
        return static_cast<int>(std::clamp(std::ceil(line), 0.0, 1.0 * overlap_lines));
    };
    const auto last_at = [](double to, double low, double scale) {
        const double line = (to - low) * scale - line_shift + slack;
        return static_cast<int>(std::clamp(std::floor(line), -1.0, overlap_lines - 1.0));
    };
    for (Index t = range.first; t < range.end(); ++t) {
        const Index a = triangles(0, t);
        const Index b = triangles(1, t);
        const Index c = triangles(2, t);
        const auto [low_u, high_u] = std::minmax({turned(0, a), turned(0, b), turned(0, c)});
        const auto [low_v, high_v] = std::minmax({turned(1, a), turned(1, b), turned(1, c)});
        if (high_u < bundle.low_u || low_u > bundle.high_u || high_v < bundle.low_v || low_v > bundle.high_v) continue;
        const int last_u = last_at(high_u, bundle.low_u, scale_u);
        const int last_v = last_at(high_v, bundle.low_v, scale_v);
        const int first_u = next_line(first_at(low_u, bundle.low_u, scale_u), stride);
        if (first_u > last_u) continue;
        const Vector3 corner_a = turned.col(a);
        const Vector3 corner_b = turned.col(b);
        const Vector3 corner_c = turned.col(c);
        const auto [low, high] = std::minmax({corner_a.z(), corner_b.z(), corner_c.z()});
        for (int j = next_line(first_at(low_v, bundle.low_v, scale_v), stride); j <= last_v; j += stride) {
            const double y = coordinate(bundle.low_v, bundle.high_v, j);
            for (int i = first_u; i <= last_u; i += stride) {
                const std::size_t line = static_cast<std::size_t>(j) * overlap_lines + static_cast<std::size_t>(i);
                if (met != nullptr && (*met)[line].empty()) continue;
                const Vector3 at(coordinate(bundle.low_u, bundle.high_u, i), y, 0.0);
                const Turn at_a(at, corner_b, corner_c);
                const Turn at_b(at, corner_c, corner_a);
                if (at_a.side == 0 || at_b.side != at_a.side) continue;
                const Turn at_c(at, corner_a, corner_b);
                if (at_c.side != at_a.side) continue;
                const double height = (at_a.area * corner_a.z() + at_b.area * corner_b.z() + at_c.area * corner_c.z()) /
                                      (at_a.area + at_b.area + at_c.area);
                // A triangle that is counter-clockwise seen from above is left by the line going up. Rounding may put
                // the height on a triangle seen edge-on outside of it, or leave none.
                lines[line].push_back({std::isnan(height) ? low : std::clamp(height, low, high), -at_a.side});
            }
        }
    }
}

void OverlapTruth::intervals(std::vector<Crossing>& crossings, std::vector<Interval>& inside) {
    inside.clear();
    std::sort(crossings.begin(), crossings.end(),
              [](const Crossing& x, const Crossing& y) { return x.height < y.height; });
    int winding = 0;
    for (const Crossing& crossing : crossings) {
        const int before = winding;
        winding += crossing.sign;
        if (before == 0 && winding != 0) inside.push_back({crossing.height, crossing.height});
        if (before != 0 && winding == 0) inside.back().high = crossing.height;
    }
    // A surface that is not watertight may leave the last interval open: it counts for nothing.
    if (winding != 0 && !inside.empty()) inside.pop_back();
}

void OverlapTruth::cast(const Topology& topology, const BodyRange& a, const BodyRange& b, const Bundle& bundle,
                        int stride) {
    pierce(topology.triangles, a.triangles, turned_, bundle, stride, nullptr, lines_a_);
    pierce(topology.triangles, b.triangles, turned_, bundle, stride, &lines_a_, lines_b_);
}

double OverlapTruth::pass(const Topology& topology, const BodyRange& a, const BodyRange& b, Bundle& bundle) {
    cast(topology, a, b, bundle);
    const double step_u = (bundle.high_u - bundle.low_u) / overlap_lines;
    const double step_v = (bundle.high_v - bundle.low_v) / overlap_lines;
    double length = 0.0;
    constexpr double infinite = std::numeric_limits<double>::infinity();
    Bundle found{infinite, infinite, -infinite, -infinite};
    for (int j = 0; j < overlap_lines; ++j) {
        for (int i = 0; i < overlap_lines; ++i) {
            const auto line = static_cast<std::size_t>(j) * overlap_lines + static_cast<std::size_t>(i);
            if (lines_a_[line].empty() || lines_b_[line].empty()) continue;
            intervals(lines_a_[line], inside_a_);
            intervals(lines_b_[line], inside_b_);
            double common = 0.0;
            for (const Interval& x : inside_a_) {
                for (const Interval& y : inside_b_) {
                    common += std::max(0.0, std::min(x.high, y.high) - std::max(x.low, y.low));
                }
            }
            if (common <= 0.0) continue;
            length += common;
            const double u = coordinate(bundle.low_u, bundle.high_u, i);
            const double v = coordinate(bundle.low_v, bundle.high_v, j);
            found.low_u = std::min(found.low_u, u - step_u);
            found.low_v = std::min(found.low_v, v - step_v);
            found.high_u = std::max(found.high_u, u + step_u);
            found.high_v = std::max(found.high_v, v + step_v);
        }
    }
    if (length > 0.0) {
        bundle.low_u = std::max(bundle.low_u, found.low_u);
        bundle.low_v = std::max(bundle.low_v, found.low_v);
        bundle.high_u = std::min(bundle.high_u, found.high_u);
        bundle.high_v = std::min(bundle.high_v, found.high_v);
    }
    return length * step_u * step_v;
}

std::optional<OverlapTruth::Bundle> OverlapTruth::turn_to(const Vector3& direction, const Matrix3X& position,
                                                          const BodyRange& a, const BodyRange& b) {
    const Matrix3 turn = turn_to_z(direction);
    for (const BodyRange* body : {&a, &b}) {
        const Range v = body->vertices;
        turned_.middleCols(v.first, v.count) = turn * position.middleCols(v.first, v.count);
    }
    const Box one = box_of(turned_, a.vertices);
    const Box other = box_of(turned_, b.vertices);
    const Bundle shared{std::max(one.min.x(), other.min.x()), std::max(one.min.y(), other.min.y()),
                        std::min(one.max.x(), other.max.x()), std::min(one.max.y(), other.max.y())};
    if (!(shared.low_u < shared.high_u && shared.low_v < shared.high_v)) return std::nullopt;
    return shared;
}

std::array<double, 2> OverlapTruth::paths_out(const Topology& topology, const BodyRange& a, const BodyRange& b,
                                              const Bundle& bundle, int stride) {
    cast(topology, a, b, bundle, stride);
    // Moving the first body by t along the line brings [a0, a1] and [b0, b1] together for b0 - a1 < t < b1 - a0.
    forbidden_.clear();
    for (std::size_t line = 0; line < lines_a_.size(); ++line) {
        if (lines_a_[line].empty() || lines_b_[line].empty()) continue;
        intervals(lines_a_[line], inside_a_);
        intervals(lines_b_[line], inside_b_);
        for (const Interval& x : inside_a_) {
            for (const Interval& y : inside_b_) forbidden_.push_back({y.low - x.high, y.high - x.low});
        }
    }
    std::sort(forbidden_.begin(), forbidden_.end(), [](const Interval& x, const Interval& y) { return x.low < y.low; });
    double up = 0.0;
    for (const Interval& span : forbidden_) {
        if (span.low < up || (up == 0.0 && span.low <= 0.0)) up = std::max(up, span.high);
    }
    std::sort(forbidden_.begin(), forbidden_.end(),
              [](const Interval& x, const Interval& y) { return x.high > y.high; });
    double down = 0.0;
    for (const Interval& span : forbidden_) {
        if (span.high > down || (down == 0.0 && span.high >= 0.0)) down = std::min(down, span.low);
    }
    return {up, -down};
}

Overlap OverlapTruth::measure(const Topology& topology, const Matrix3X& position, Index body_a, Index body_b) {
    Overlap result;
    const BodyRange& a = topology.bodies[static_cast<std::size_t>(body_a)];
    const BodyRange& b = topology.bodies[static_cast<std::size_t>(body_b)];
    if (a.triangles.count == 0 || b.triangles.count == 0 ||
        !box_of(position, a.vertices).overlaps(box_of(position, b.vertices))) {
        return result;
    }
    turned_.resize(3, position.cols());
    const std::span<const Vector3> directions = translation_directions();
    // World z gives the volume, and says whether there is anything to come out of.
    const auto upwards = turn_to(directions.front(), position, a, b);
    if (!upwards) return {};
    Bundle narrowed = *upwards;
    result.volume = pass(topology, a, b, narrowed);
    if (!(result.volume > 0.0)) return {};
    result.volume = pass(topology, a, b, narrowed);

    // A few lines of each bundle bound its exits from below: most directions need no more.
    constexpr int few = 6;  // every sixth line in either direction
    least_.clear();
    for (const Vector3& direction : directions) {
        const auto shared = turn_to(direction, position, a, b);
        if (!shared) return {};
        const auto [up, down] = paths_out(topology, a, b, *shared, few);
        least_.push_back(std::min(up, down));
    }
    const std::span<const double> least = least_;
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::stable_sort(order_.begin(), order_.end(),
                     [least](std::size_t x, std::size_t y) { return least[x] < least[y]; });
    double shortest = std::numeric_limits<double>::infinity();
    std::size_t best = 0;
    for (const std::size_t d : order_) {
        if (least[d] > shortest) break;
        const auto shared = turn_to(directions[d], position, a, b);
        const auto [up, down] = paths_out(topology, a, b, *shared, 1);
        // A bundle whose lines all miss the overlap says nothing about its direction.
        if (up == 0.0 && down == 0.0) continue;
        const double path = std::min(up, down);
        // Of equal distances the direction that is named first.
        if (path > shortest || (path == shortest && d > best)) continue;
        shortest = path;
        best = d;
        result.direction = (up <= down ? 1.0 : -1.0) * directions[d];
    }
    result.min_translation = std::isfinite(shortest) ? shortest : std::nan("");
    return result;
}

}  // namespace trocar
