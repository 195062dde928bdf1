// Side of an open sheet on which the points of another body are. It follows from where the sheet cuts that body's
// surface on the current frame. Only one point of each connected surface is followed through time.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "measure/body_surface.hpp"

namespace trocar {

enum class Side : std::uint8_t { right, wrong, undecided };

/// An open sheet has sides only near itself, so that a body is judged as a whole. The anchor of a connected surface is
/// its vertex farthest from the sheet in the first frame. Parts of the surface that the sheet cuts off from the anchor
/// are beyond it.
///
/// - A vertical curtain from the rim up to infinity closes the sheet. The winding number of that shell about a point is
///   the number of signed crossings of the upward ray. Along an edge of the body it changes by the crossings of the
///   sheet and of the curtain; the latter are counted separately and subtracted. The crossings of the sheet along any
///   path over the surface thus follow exactly from the current frame. The path that crosses the sheet the fewest times
///   counts.
/// - The anchor's own number follows in the same way from its path through time. Beside the anchor's position it
///   depends only on how often the anchor has gone round the rim.
/// - While no part of the rim is inside the body, all paths over its surface agree, and they give the side.
/// - While the rim is inside (it pierces the surface, or a closed body holds it), paths round it exist within the body.
///   A second criterion is then the signed crossings of the sample's own motion since the rim was last outside. A
///   sample is on the wrong side where both say beyond, on the right one where neither does, else undecided. An anchor
///   that passes the sheet meanwhile may have passed by motion of the rim alone; its surface is undecided until it is
///   back.
///
/// In the first frame the body's farthest vertex is on the right side, and the others' numbers count from there. Where
/// edges of the body pass through the sheet, the points on the declared side (BodyRange::start_side) are right instead;
/// the first such edge identifies them. A tool may thus start deep. Ties are broken by the same infinitesimal shift of
/// every sample, upwards first (Edelsbrunner and Mücke 1990).
class SheetSides {
public:
    /// Both outlive this and are at the first frame.
    SheetSides(BodySurface& body, BodySurface& sheet);

    /// Call on every frame, in order, after both surfaces have followed it.
    void update();

    [[nodiscard]] Side side(std::size_t sample) const { return side_[sample]; }

private:
    /// A connected surface of the body.
    struct Shell {
        std::size_t anchor = 0;   ///< vertex of the body
        int side = 0;             ///< signed crossings of the anchor; 0: on the right side
        int last_sure = 0;        ///< the same on the last frame without a rim inside
        bool rim_inside = false;  ///< on the current frame
        bool rim_was_inside = false;
        bool doubtful = false;
    };

    void find_shells();
    void find_anchors();
    void start();
    void count_rays();
    void follow_anchors();
    void find_near_rim();
    void read_surface();
    void cross_edges();
    void walk_edges();
    void join_area_samples();
    void search_for_rim_inside();
    void hear_witnesses(bool first);
    void settle(std::size_t sample);
    void declare_start_side();
    [[nodiscard]] Index declared_right() const;
    [[nodiscard]] std::size_t shell_of(std::size_t sample) const;
    [[nodiscard]] int step(const Vector3& from, int ray_from, const Vector3& to, int ray_to);
    [[nodiscard]] int curtain_passages(const Vector3& from, const Vector3& to);
    [[nodiscard]] int rim_contribution(const Vector3& before, const Vector3& now) const;
    template <typename Act>
    void each_neighbour(std::size_t vertex, const Act& act) const;

    BodySurface* body_;
    BodySurface* sheet_;
    std::vector<Shell> shells_;
    std::vector<std::size_t> shell_of_vertex_;
    std::vector<int> rays_;         ///< per sample: signed crossings of the upward ray, on the current frame
    std::vector<int> rays_before_;  ///< and on the frame before
    std::vector<int> by_surface_;   ///< per sample: signed crossings of the sheet, by the path over the surface
    std::vector<int> by_motion_;    ///< per sample: by its own motion since the rim was last out
    std::vector<Side> side_;

    std::vector<RimEdge> near_rim_;  ///< whose curtain the body may meet
    std::vector<Box> near_rim_box_;
    Triangles near_rim_corners_;  ///< the same as triangles without area, for the tree
    RayTree near_rim_tree_;
    std::vector<int> crossed_;          ///< buffer: per directed edge of the body, signed crossings of the sheet
    std::vector<std::size_t> reverse_;  ///< position of the opposite directed edge
    std::vector<int> cost_;
    std::vector<std::array<std::size_t, 2>> queue_;
};

}  // namespace trocar
