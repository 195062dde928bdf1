// On which side of an open sheet the points of another body are. It is read from the frame as it stands: from where the
// sheet cuts that body's surface; only one point of each connected surface is followed through time.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "measure/body_surface.hpp"

namespace trocar {

enum class Side : std::uint8_t { right, wrong, undecided };

/// An open sheet has sides only near itself, so a body is judged as a whole. Of every connected surface of it one
/// vertex, the anchor (farthest from the sheet in the first frame), says where the surface belongs; what the sheet cuts
/// off from the anchor is beyond it.
///
/// - The sheet is thought closed by a curtain from its rim straight up to infinity. The winding number of that shell
///   about a point is the number of signed crossings of the upward ray; from one point to the next along an edge of the
///   body it changes by the crossings of the sheet, and by those of the curtain, which are counted apart and taken off.
///   So the crossings of the sheet along any way over the surface are known from the current frame alone, exactly; the
///   way with the fewest counts.
/// - The anchor's own number is the same along its way through time. Beside where the anchor is, it depends on one
///   thing only: how often the anchor has gone round the rim.
/// - While no part of the rim is inside the body, all ways over its surface agree, and that is the answer. While the
///   rim is inside (it pierces the surface, or a closed body holds it) there is a way round it within the body, and a
///   second witness is heard: the signed crossings of the sample's own motion since the rim was last out. Where both
///   say beyond, the sample is on the wrong side; where both say not, on the right one; where they differ it is
///   undecided. An anchor that passes the sheet while the rim is inside may have been passed by the rim alone: its
///   surface is undecided until the anchor is back.
///
/// In the first frame the body's farthest vertex is on the right side, and the others' numbers count from there; where
/// edges of the body pass through the sheet, the first of them says which points are on the side that the scene
/// declares (BodyRange::start_side), and those are right instead. So a tool may start deep. Ties are broken by thinking
/// every sample moved by the same infinitesimal step, upwards first (Edelsbrunner and Mücke 1990).
class SheetSides {
public:
    /// Both outlive this, and stand at the first frame.
    SheetSides(BodySurface& body, BodySurface& sheet);

    /// To be called on every frame, in order, when both surfaces have followed it.
    void update();

    [[nodiscard]] Side side(std::size_t sample) const { return side_[sample]; }

private:
    /// A connected surface of the body.
    struct Shell {
        std::size_t anchor = 0;   ///< vertex of the body
        int side = 0;             ///< signed crossings of the anchor; 0: on the right side
        int last_sure = 0;        ///< the same when last no rim was inside
        bool rim_inside = false;  ///< now
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
    std::vector<int> rays_;         ///< per sample: signed crossings of the upward ray, now
    std::vector<int> rays_before_;  ///< and on the frame before
    std::vector<int> by_surface_;   ///< per sample: signed crossings of the sheet, by the way over the surface
    std::vector<int> by_motion_;    ///< per sample: by its own motion since the rim was last out
    std::vector<Side> side_;

    std::vector<RimEdge> near_rim_;  ///< whose curtain the body may meet
    std::vector<Box> near_rim_box_;
    Triangles near_rim_corners_;  ///< the same as triangles without area, for the tree
    RayTree near_rim_tree_;
    std::vector<int> crossed_;          ///< buffers: per edge of the body, both ways: signed crossings of the sheet
    std::vector<std::size_t> reverse_;  ///< where the same edge stands the other way round
    std::vector<int> cost_;
    std::vector<std::array<std::size_t, 2>> queue_;
};

}  // namespace trocar
