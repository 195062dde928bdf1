// Overlap of two closed bodies: shared volume, and the minimum translation that separates them. Both come from parallel
// lines through the surfaces, independent of contacts, pairs and methods.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "scene/world.hpp"

namespace trocar {

struct Overlap {
    double volume = 0.0;                  ///< m³, filled by both bodies
    double min_translation = 0.0;         ///< m, shortest separating translation, along translation_directions()
    Vector3 direction = Vector3::Zero();  ///< unit, world: in which the first body separates; zero without overlap
};

/// Unit vectors along the 3 axes, the 6 face diagonals and the 4 space diagonals of a cube. Each stands for both
/// senses, 26 translations in all.
std::span<const Vector3> translation_directions();

/// Lines per side of the square bundle over the part of the projection that both bodies share.
inline constexpr int overlap_lines = 48;

/// A point is inside a body where the winding number along the line is not 0. Two bundles find the volume; the second
/// one covers only the overlap found by the first. The volume's error falls with the square of the line spacing.
///
/// The translation along a direction is the smallest one that separates the intervals of both bodies on every line.
/// Parts between two lines may make it too short, for balls of radius r by about spacing² / (4 r) each. It is never too
/// long, and NaN where every bundle misses the overlap. Bodies that do not overlap give zeros. Both bodies are closed.
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

    /// Crossings on every stride-th line each way; where `met` is given, only on its lines with a crossing.
    static void pierce(const Triangles& triangles, Range range, const Matrix3X& turned, const Bundle& bundle,
                       int stride, const Lines* met, Lines& lines);
    static void intervals(std::vector<Crossing>& crossings, std::vector<Interval>& inside);
    /// Overlap volume along the bundle's lines, m³; narrows `bundle` to the lines that overlap.
    double pass(const Topology& topology, const BodyRange& a, const BodyRange& b, Bundle& bundle);
    void cast(const Topology& topology, const BodyRange& a, const BodyRange& b, const Bundle& bundle, int stride = 1);
    /// Bundle along `direction`, to which the bodies are rotated; nothing when the two miss each other.
    [[nodiscard]] std::optional<Bundle> turn_to(const Vector3& direction, const Matrix3X& position, const BodyRange& a,
                                                const BodyRange& b);
    /// Separating translation along the lines in either sense, m; 0 where they miss the overlap. Every stride-th line
    /// each way gives a lower bound.
    [[nodiscard]] std::array<double, 2> paths_out(const Topology& topology, const BodyRange& a, const BodyRange& b,
                                                  const Bundle& bundle, int stride);

    Matrix3X turned_;
    Lines lines_a_;
    Lines lines_b_;
    std::vector<Interval> inside_a_;
    std::vector<Interval> inside_b_;
    std::vector<Interval> forbidden_;
    std::vector<double> least_;            ///< m, per direction: lower bound of its translation
    std::array<std::size_t, 13> order_{};  ///< directions by that bound
};

}  // namespace trocar
