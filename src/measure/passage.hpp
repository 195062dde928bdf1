// Truth about the passage of one body through another where no tissue lies between them (instrument and instrument,
// instrument and bone). A script or a strong operator can force it on bodies that do not yield. It reads the motion
// alone, so that it is the same for every response.
//
// Samples are the vertices of one body and points on its edges. Their spacing is at most the other body's volume over
// its surface (half the thickness of a plate, half the radius of a shaft); for open sheets, their mean edge. Each
// sample moves in a straight line per tick in the other body's frame, and its signed crossings of the surface are
// counted.
// * Closed: a sample has passed through when it enters by one triangle and leaves by another whose outward normal
//   differs by at least 120 degrees. Its depth in between must be at least 0.8 times the body's largest inner depth.
//   Else 0.4 times the distance from entry to exit is enough (a spike of a large bone). A sample that is only pressed
//   in leaves where it entered. A sample that slides along a surface or cuts a corner leaves beside its entry or stays
//   shallow.
// * Open: a sample has passed through when the surfaces are apart again and it is on the other side.
// A body may change its shape. Its frame then follows the motion that fits its points best. Sample and triangle both
// move in straight lines during the tick. The exact sweeps of the triangles relative to the sample are the crossings
// (signed_crossing.hpp). Spacing of samples and inner depth stay those of the first shape.
// Each body of a pair provides samples for the other. A passage counts once, at the tick of its first sample. The pair
// can pass again only after all samples have been outside.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/box_pairs.hpp"
#include "measure/ray_tree.hpp"
#include "measure/surface_distance.hpp"
#include "scene/scene.hpp"

namespace trocar {

class PassageTruth {
public:
    /// `first`: the frame that follow() goes on from. The scene outlives the object.
    PassageTruth(const Scene& scene, const Frame& first);

    /// Call with every frame after a step, in order. Returns the number of passages completed since the last call; -1:
    /// the scene has no pair to examine. `reshaped`: per body, whether its shape in the scene (SceneBody::local) is
    /// another one since the last call; empty: of none.
    std::int64_t follow(const Frame& frame, std::span<const std::uint8_t> reshaped = {});

private:
    /// A point (1 - share) u + share v of a body's edge.
    struct Sample {
        Index u = -1;
        Index v = -1;
        double share = 0.0;
    };
    struct Target {
        Box box;                  ///< in the body's frame
        double jaw = 1.0;         ///< jaw opening of shape, box and trees
        double thickness = 0.0;   ///< m, volume / surface, spacing of the other body's samples; open: mean edge
        double half_width = 0.0;  ///< m, closed: largest depth of a point inside
        RayTree rays;
        SurfaceDistance distance;
        bool reshaped = false;  ///< since the frame before, whose shape is in shape_before_
        DistanceTree swept;     ///< reshaped: of the boxes of both shapes
        Matrix3X normal;        ///< 3×(triangles of the body), unit outward, body frame; 0 without area
    };
    /// Samples of one body in the frame of another.
    struct Direction {
        Index from = -1;
        Index into = -1;
        std::vector<Sample> samples;
        Matrix3X at;                  ///< 3×samples, m, frame of `into`
        std::vector<int> depth;       ///< per sample: surfaces entered less surfaces left
        std::vector<Index> entered;   ///< per sample: triangle of entry; -1: started inside, or is outside
        Matrix3X entry;               ///< 3×samples, m: point of entry
        std::vector<double> deepest;  ///< per sample, m: largest distance to the surface since entry
        bool up_to_date = false;      ///< `at` belongs to the frame before
        bool any_inside = false;
    };
    struct Pair {
        Index a = -1;
        Index b = -1;
        bool met = false;  ///< the boxes have met, and there are directions
        std::vector<Direction> directions;
        bool counted = false;  ///< the current passage is counted
    };
    struct Hit {
        double part;  ///< fraction of the motion in the tick
        Index triangle;
        int step;  ///< +1 in, -1 out
    };

    [[nodiscard]] const BodyRange& range(Index body) const {
        return scene_->topology.bodies[static_cast<std::size_t>(body)];
    }
    /// Gives the target the body's shape in the scene at that jaw opening.
    void place_target(Index body, double jaw);
    /// The same for a target that has a shape, which becomes the shape before.
    void reshape_target(Index body, double jaw);
    /// Begins to follow a pair from the frame before. `apart`: its boxes did not overlap there.
    void begin(bool apart, Pair& pair);
    [[nodiscard]] double half_width_of(Index body) const;
    void add_samples(Direction& direction) const;
    void sample_places(const Direction& direction, const Matrix3X& position, const Pose& into, Matrix3X& at) const;
    /// True when a sample has passed through.
    bool follow(const Frame& frame, Direction& direction);
    bool follow_sample(std::size_t sample, const Vector3& to, Direction& direction);
    /// Crossings of one sample on its straight path, into hits_.
    void cross_surface(const Vector3& from, const Vector3& to, Index into);
    void cross_swept_surface(const Vector3& from, const Vector3& to, Index into);
    /// The sample at `here`, which was at `last` before, crosses the triangle. True when it has passed through.
    bool cross(std::size_t sample, Index triangle, int step, const Vector3& last, const Vector3& here,
               Direction& direction) const;
    /// Updates the `deepest` of a sample on one part of its path.
    void deepen(std::size_t sample, const Vector3& from, const Vector3& to, Direction& direction) const;
    [[nodiscard]] bool surfaces_apart(const Frame& frame, const Direction& direction);

    const Scene* scene_;
    Matrix3X shape_;         ///< 3×N, m, every vertex in its own body's frame
    Matrix3X shape_before_;  ///< the same on the frame before, of bodies that are reshaped
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
