// Whether a body has been led through another where no tissue lies between the two (instrument and instrument,
// instrument and bone): the truth about what a script or a strong hand does to bodies that cannot give way. It examines
// the motion alone, so it is the same for every response, and no run says nothing about it.
//
// Samples are the vertices of one body and points on its edges, no farther apart than the other body's volume over its
// surface (half the thickness of a plate, half the radius of a shaft; open sheets: their mean edge). Each is followed
// in the other body's frame, from tick to tick in a straight line, and its signed crossings of the surface are counted.
// * Closed: a sample has passed through when it went in by one triangle and came out by another whose outward normal is
//   at least 120 degrees from the first one's, and on its way was at least 0.8 times as deep as the body's inside is
//   anywhere, or 0.4 times as deep as its way in and its way out are apart (a spike of a large bone). What is pressed
//   in comes out where it went in; what slides along a surface or cuts a corner comes out beside it or was only
//   shallow.
// * Open: when the two surfaces are apart again and a sample is on the other side.
// Both bodies of a pair are examined as the other's samples. A passage is counted once, at the tick at which the first
// sample is through; the same two bodies can make another one only after all samples have been out.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/box_pairs.hpp"
#include "measure/ray_tree.hpp"
#include "measure/surface_distance.hpp"
#include "scene/scene.hpp"

namespace trocar {

class PassageTruth {
public:
    /// Starts at the scene's first frame. The scene outlives the object.
    explicit PassageTruth(const Scene& scene);

    /// To be reported every frame after a step, in order. Returns how many passages were completed since the one
    /// before; -1: the scene has no two bodies to ask about.
    std::int64_t follow(const Frame& frame);

private:
    /// A point (1 - share) u + share v of a body's edge.
    struct Sample {
        Index u = -1;
        Index v = -1;
        double share = 0.0;
    };
    struct Target {
        Box box;                  ///< in the body's frame
        double jaw = 1.0;         ///< opening that shape, box and trees belong to
        double thickness = 0.0;   ///< m, volume / surface, the spacing of others' samples; open: the mean edge
        double half_width = 0.0;  ///< m, closed: how deep a point inside can be
        RayTree rays;
        SurfaceDistance distance;
        Matrix3X normal;  ///< 3×(triangles of the body), unit outward, body frame; 0 without area
    };
    /// Samples of one body in the frame of another.
    struct Direction {
        Index from = -1;
        Index into = -1;
        std::vector<Sample> samples;
        Matrix3X at;                  ///< 3×samples, m, frame of `into`
        std::vector<int> depth;       ///< per sample: surfaces entered less surfaces left
        std::vector<Index> entered;   ///< per sample: triangle by which it went in; -1: began inside, or is outside
        Matrix3X entry;               ///< 3×samples, m: where it went in
        std::vector<double> deepest;  ///< per sample, m: largest distance to the surface seen since
        bool up_to_date = false;      ///< `at` belongs to the frame before
        bool any_inside = false;
    };
    struct Pair {
        std::vector<Direction> directions;
        bool counted = false;  ///< the passage that goes on has been
    };
    struct Hit {
        double part;  ///< of the way
        Index triangle;
        int step;  ///< +1 in, -1 out
    };

    [[nodiscard]] const BodyRange& range(Index body) const {
        return scene_->topology.bodies[static_cast<std::size_t>(body)];
    }
    void place_target(Index body, double jaw);
    [[nodiscard]] double half_width_of(Index body) const;
    void add_samples(Direction& direction) const;
    void sample_places(const Direction& direction, const Matrix3X& position, const Pose& into, Matrix3X& at) const;
    /// True when a sample has come out at the other side.
    bool follow(const Frame& frame, Direction& direction);
    bool follow_sample(std::size_t sample, const Vector3& to, Direction& direction);
    /// Takes note of how deep a sample is on a stretch of its way.
    void deepen(std::size_t sample, const Vector3& from, const Vector3& to, Direction& direction) const;
    [[nodiscard]] bool surfaces_apart(const Frame& frame, const Direction& direction);

    const Scene* scene_;
    Matrix3X shape_;  ///< 3×N, m, every vertex in its own body's frame
    std::vector<Target> targets_;
    std::vector<Pair> pairs_;
    Matrix3X before_;  ///< 3×N, m, world, of the frame before
    std::vector<Pose> pose_before_;
    std::vector<Box> box_before_;  ///< per body, world
    std::vector<Box> box_;
    Matrix3X next_;
    std::vector<Hit> hits_;
    bool moved_through_ = false;
};

}  // namespace trocar
