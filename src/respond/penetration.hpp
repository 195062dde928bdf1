// What the crossing ledger knows of a sample and the tissue that it has crossed or rests on. One surface can pass a
// sample several times, folded or as the two walls of a flat bag: each passage is a layer of its own, with its own
// place on the surface and its own side.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "respond/surface.hpp"
#include "scene/world.hpp"

namespace trocar {

/// A point of another body that the ledger follows: a vertex, or a point on one of its long edges.
struct LedgerSample {
    Index vertex = -1;
    Index other = -1;       ///< other end of the edge, -1 for a vertex
    double fraction = 0.0;  ///< of the way from `vertex` to `other`
    Index body = -1;
    Index key = -1;  ///< names it: its vertex, or a number from the vertex count on for a point on an edge

    /// Of a 3×N matrix with a column per vertex: positions or velocities (exact for rigid bodies).
    [[nodiscard]] Vector3 of(const Matrix3X& columns) const {
        if (other < 0) return columns.col(vertex);
        return (1.0 - fraction) * columns.col(vertex) + fraction * columns.col(other);
    }
};

/// A layer of tissue that a sample point has crossed, has come back through and is still near, or is about to meet.
struct Penetration {
    LedgerSample sample;
    Index tissue = -1;    ///< tissue body
    Index triangle = -1;  ///< anchor: surface point that the normal through the sample meets
    Vector3 weights = Vector3::Zero();
    Vector3 normal =
        Vector3::Zero();             ///< unit, continuous along the surface, towards the side where the sample belongs
    Vector3 face = Vector3::Zero();  ///< unit normal of the anchor's triangle, same side
    double depth = 0.0;              ///< m, of the sample below the anchor along -normal; negative = clear
    double side = 0.0;               ///< +1: belongs in front of the surface, -1: behind it
    int crossed = 0;                 ///< signed crossings of this layer (front to back +1); 0: on the right side
    std::int64_t age = 0;            ///< ticks
    std::int64_t stalled = 0;        ///< ticks for which the depth has not fallen while the tissue is at its limit
    std::int64_t stretched = 0;      ///< ticks in a row that it pressed on tissue at the strain limit
    double least_depth = std::numeric_limits<double>::infinity();  ///< m, so far
    bool ruptured = false;                                         ///< given up until the sample is back on its side
    double opening = 0.0;  ///< m, ruptured: as deep as the tear lets it be by now
};

/// Slides `triangle` to the nearest point of its surface by a walk over neighbouring triangles and sets the weights of
/// that point.
void follow_surface(const Topology& topology, const SurfaceNeighbours& surface, const Frame& frame,
                    const Vector3& point, Index& triangle, Vector3& weights);

/// The layers of one sample in one tissue body while they are brought to the frame of this tick.
class SampleLayers {
public:
    /// All three outlive the tick.
    void look_at(const Topology& topology, const SurfaceNeighbours& surface, const Frame& frame) {
        topology_ = &topology;
        surface_ = &surface;
        frame_ = &frame;
    }
    void begin(const LedgerSample& sample, Index tissue);
    /// A layer of the last tick.
    void keep(const Penetration& layer);
    /// The sample has crossed this triangle in the tick, or with 0 crossings is about to meet it: of a layer that is
    /// known, or of a new one.
    void cross(Index triangle, int crossings);
    /// Crossings of two layers in opposite senses undo each other where the surface shows that they are of one layer:
    /// where one of them has the sample on its right side.
    void cancel();
    [[nodiscard]] bool any_crossed() const;
    /// The sample is on its right side after all.
    void forget_crossings();
    /// The layers as they are, or the one nearest to the sample where their crossings do not add up to `count` (at the
    /// start, and where a count has been put right): `nearest` tells the triangle.
    template <typename Nearest>
    void agree_with(int count, const Nearest& nearest) {
        if (crossings() == count) return;
        forget_crossings();
        if (count == 0) return;
        const Index triangle = nearest();
        if (triangle >= 0) cross(triangle, count);
    }
    /// A rim that has passed a sample has brought it to the other side without a crossing, so that the count no longer
    /// tells the side. The sample's own body does, within `shallow` (m) of the surface: the tissue belongs to where
    /// `outwards` leads from there. Puts layers right that would draw the tissue in.
    void turn_outwards(const Vector3& outwards, double shallow);
    /// Sets normal, depth and anchor of every layer and appends those that are crossed, or within the margin (m) of the
    /// sample and not torn.
    void append_to(std::vector<Penetration>& penetrations, double margin);
    [[nodiscard]] int crossings() const;

private:
    [[nodiscard]] bool is_of(const Penetration& layer, Index triangle) const;
    [[nodiscard]] bool is_behind(const Penetration& layer) const;
    [[nodiscard]] bool is_clear(const Penetration& layer) const;
    [[nodiscard]] Vector3 anchor_of(const Penetration& layer) const;
    void follow(const Vector3& point, Index& triangle, Vector3& weights) const {
        follow_surface(*topology_, *surface_, *frame_, point, triangle, weights);
    }
    void place(Penetration& layer) const;

    const Topology* topology_ = nullptr;
    const SurfaceNeighbours* surface_ = nullptr;
    const Frame* frame_ = nullptr;
    LedgerSample sample_;
    Index tissue_ = -1;
    Vector3 x_ = Vector3::Zero();
    std::vector<Penetration> layers_;
};

}  // namespace trocar
