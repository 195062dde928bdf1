// How much two closed bodies overlap, as the two figures that a depth does not report: the volume that both fill, and
// the shortest way by which one would have to be moved to come free. Both come from parallel lines through the surfaces
// and read no contact, no pair and no method.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "scene/world.hpp"

namespace trocar {

struct Overlap {
    double volume = 0.0;                  ///< m³, filled by both bodies
    double min_translation = 0.0;         ///< m, shortest way out over translation_directions(), both senses of each
    Vector3 direction = Vector3::Zero();  ///< unit, world: the way out of the first body; zero when nothing overlaps
};

/// The stated set: unit vectors along the 3 axes, the 6 face diagonals and the 4 space diagonals of a cube. Each stands
/// for both senses, so that 26 ways out are tried.
std::span<const Vector3> translation_directions();

/// Lines per side of the square bundle that is laid over the part of the projection that both bodies share.
inline constexpr int overlap_lines = 48;

/// A point is inside a body where the winding number along the line is not 0. The volume's bundle is laid twice, the
/// second time over the part that the first one found to overlap: its error falls with the square of the spacing.
/// The way out along a direction is the smallest translation that leaves the intervals of both bodies apart on every
/// line of the bundle, so parts between two lines may make it too short by what they stand out there (for balls of
/// radius r about a spacing squared over 4 r each); it never is too long, and NaN where every bundle misses the
/// overlap. Bodies that do not overlap give zeros. Both bodies are closed.
class OverlapTruth {
public:
    Overlap measure(const Topology& topology, const Matrix3X& position, Index body_a, Index body_b);

private:
    struct Bundle {
        double low_u = 0.0;
        double low_v = 0.0;
        double high_u = 0.0;
        double high_v = 0.0;
    };
    struct Crossing {
        double height = 0.0;
        int sign = 0;
    };
    struct Interval {
        double low = 0.0;
        double high = 0.0;
    };
    using Lines = std::vector<std::vector<Crossing>>;

    /// Every stride-th line each way, and of these, where `met` is given, those that something there has met.
    static void pierce(const Triangles& triangles, Range range, const Matrix3X& turned, const Bundle& bundle,
                       int stride, const Lines* met, Lines& lines);
    static void intervals(std::vector<Crossing>& crossings, std::vector<Interval>& inside);
    /// Volume between the two bodies along the bundle's lines, m³; narrows `bundle` to the lines that overlap.
    double pass(const Topology& topology, const BodyRange& a, const BodyRange& b, Bundle& bundle);
    void cast(const Topology& topology, const BodyRange& a, const BodyRange& b, const Bundle& bundle, int stride = 1);
    /// Turned so that the direction points along the bundle's lines; nothing when the two miss each other.
    [[nodiscard]] std::optional<Bundle> turn_to(const Vector3& direction, const Matrix3X& position, const BodyRange& a,
                                                const BodyRange& b);
    /// Way out along the lines in either sense, m, 0 where they miss the overlap; from every stride-th line each way,
    /// which is a lower bound.
    [[nodiscard]] std::array<double, 2> paths_out(const Topology& topology, const BodyRange& a, const BodyRange& b,
                                                  const Bundle& bundle, int stride);

    Matrix3X turned_;
    Lines lines_a_;
    Lines lines_b_;
    std::vector<Interval> inside_a_;
    std::vector<Interval> inside_b_;
    std::vector<Interval> forbidden_;
    std::vector<double> least_;            ///< m, per direction: lower bound of its way out
    std::array<std::size_t, 13> order_{};  ///< directions by that bound
};

}  // namespace trocar
