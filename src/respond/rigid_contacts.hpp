// Contacts between bodies that do not deform, one per patch in which two of them meet (corrected, rigid=patch): however
// many triangles the curve crosses that bounds the patch, the pair's k counts once, and force and direction change
// neither with the mesh nor when the curve passes an edge. Where a hand yields the contact may be as stiff as the
// device's mass allows (rigid=hold): it clears what a penalty would leave where it balances the hand.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "contact/contact.hpp"
#include "respond/thesis_state.hpp"

namespace trocar {

class RigidContacts {
public:
    void prepare(const Topology& topology);
    /// True when contacts of this pair go to add(): rigid=patch or hold, and no tissue.
    [[nodiscard]] bool takes(const ThesisState& state, Index body_a, Index body_b) const;
    /// Keeps a triangle pair that crosses.
    void add(const ThesisState& state, const Frame& frame, const Contact& contact);
    /// Gives a contact that stands for a share of the pair its law: the pair's k and mu; with rigid=hold, where a hand
    /// leads one of the two, at least k = m/T² (m the hands' effective mass, T rigid_settle) and the damper that makes
    /// it critical. Gap (at the frame; told at the start of the tick after that), normal,
    /// vertices, face velocity and reaction are set.
    void give_law(const ThesisState& state, const Frame& frame, Index body_a, Index body_b, double share,
                  LinearContact& linear) const;
    /// Appends one contact per curve of intersection. Its direction is that of the curve's area vector ½ Σ p×q, which
    /// is minus the gradient of the overlap's volume when one body is moved against the other, leaning with the blended
    /// normals of the surface that the other stands in (normal=blend); its depth is how far the
    /// overlap (the curve, and the vertices inside it) reaches along that direction. An open body whose rim is inside a
    /// closed one leaves it along the normals of the faces that it passes through. `share(body_a, body_b, place)` in
    /// [0, 1] scales its force.
    template <typename Share>
    void respond(const ThesisState& state, const Frame& frame, const Share& share, Effect& effect) {
        trace(state, frame);
        for (const Curve& curve : curves_) {
            LinearContact linear = contact_of(state, frame, curve);
            const double part = share(curve.body_a, curve.body_b, curve.centre);
            if (!(part > 0.0)) continue;
            give_law(state, frame, curve.body_a, curve.body_b, part, linear);
            effect.contacts.push_back(linear);
        }
    }

private:
    /// Where two triangles cross: a piece of a curve.
    struct Piece {
        Index a = -1;
        Index b = -1;
        Index body_a = -1;
        Index body_b = -1;
        std::array<bool, 3> below_a{};  ///< corners of a below b's face
        std::array<bool, 3> below_b{};
        Vector3 from = Vector3::Zero();  ///< m; runs so that the curve goes round the direction that pushes b from a
        Vector3 to = Vector3::Zero();
        Vector3 push = Vector3::Zero();  ///< the contact's own normal and depth, for curves without area
        double depth = 0.0;
        Index curve = -1;  ///< union-find: piece that stands for it
    };
    /// A body's own normals along a curve, each times the length that runs there.
    struct Side {
        Vector3 faces = Vector3::Zero();
        Vector3 blended = Vector3::Zero();
    };
    struct Curve {
        Index body_a = -1;
        Index body_b = -1;
        Vector3 centre = Vector3::Zero();
        Vector3 area = Vector3::Zero();    ///< m²
        Vector3 normal = Vector3::Zero();  ///< unit, pushes b from a
        double length = 0.0;
        double radius = 0.0;
        double depth = 0.0;  ///< m, the largest of its contacts
        bool closed = false;
        /// One of the two bodies is open and the curve ends at its rim: no loop whose area would tell a way out.
        bool ends_at_rim = false;
        Vector3 chord = Vector3::Zero();  ///< m, from its start to its end; zero of a loop
        Side side_a{};
        Side side_b{};
        double highest = 0.0;  ///< m, along the normal, of a's part of the overlap and the curve
        double lowest = 0.0;
        Index a = -1;  ///< the triangle of each body that faces along the normal most
        Index b = -1;
        double facing_a = 0.0;
        double facing_b = 0.0;
    };
    [[nodiscard]] Index root(Index piece);
    void trace(const ThesisState& state, const Frame& frame);
    static void add_piece(const ThesisState& state, const Frame& frame, const Piece& piece, Curve& curve);
    static void push_out_of_the_closed_body(const ThesisState& state, Curve& curve);
    static void lean_with_the_surface(Curve& curve);
    void measure_depths(const ThesisState& state, const Frame& frame);
    void find_corners_inside(const ThesisState& state, const Frame& frame, Index curve, bool of_a);
    [[nodiscard]] bool open_corner_is_inside(const ThesisState& state, const Frame& frame, const Piece& piece,
                                             bool of_a, Index vertex) const;
    void walk_inside(const ThesisState& state, const Frame& frame, Curve& curve, bool of_a);
    [[nodiscard]] bool crosses(Index triangle) const;
    [[nodiscard]] LinearContact contact_of(const ThesisState& state, const Frame& frame, const Curve& curve) const;

    std::vector<Piece> pieces_;
    std::vector<std::pair<Index, Index>> by_triangle_;  ///< triangle, piece
    std::vector<Curve> curves_;
    std::vector<Index> curve_of_root_;
    std::vector<Index> inside_;         ///< vertices inside a curve, as the walk finds them
    std::vector<std::uint64_t> known_;  ///< N; walk that has seen a vertex
    std::uint64_t walk_ = 0;
};

}  // namespace trocar
