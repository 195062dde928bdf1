// Contacts as the plain methods see them: a point of one body against a point of another, a normal and a depth. They
// come from canonical contacts as well as from a library's own, which may lack vertices, case or more.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "contact/contact_set.hpp"
#include "method/response.hpp"
#include "respond/common.hpp"
#include "respond/contact_laws.hpp"
#include "scene/world.hpp"

namespace trocar {

struct PointContact {
    Index vertex = -1;       ///< the vertex that stands for the contact in a reduction
    Index other = -1;        ///< body on the other side of that vertex
    Index next = -1;         ///< next contact of the same vertex
    double distance = 0.0;   ///< m, between the points a and b
    bool of_vertex = false;  ///< `vertex` has entered the other body; false: edges cross, or a library's contact
    std::array<Vector3, 16> normals{};  ///< different ones of the faces that are as deep and as near
    int normal_count = 0;
    Index body_a = -1;
    Index body_b = -1;
    ContactPoint a, b;
    Vector3 normal = Vector3::Zero();  ///< unit, a to b
    double depth = 0.0;                ///< m, where scripts have made this tick's motion; negative: open
    std::uint64_t id = 0;              ///< Contact::id
};

/// `reduction`: `vertex` or `pair`.
Parameter reduction_parameter();

class PointContacts {
public:
    void prepare(const Topology& topology);
    /// Replaces the list. `reduce`: of the closed contacts one per vertex and other body, the deepest, and edge
    /// contacts only where no vertex beside them is inside; else one per contact. Open contacts are never reduced.
    /// Counts in the effect what has no place in the list: no_direction and reduced.
    void gather(const Topology& topology, const Frame& frame, const ContactSet& contacts, bool reduce, Effect& effect);
    [[nodiscard]] const std::vector<PointContact>& list() const { return list_; }

private:
    /// The list holds the contact of this very vertex with that body.
    [[nodiscard]] bool stands_for(Index vertex, Index other) const;
    /// Of a contact of edges: a vertex beside it is inside the other body and stands for the overlap.
    [[nodiscard]] bool is_left_to_a_vertex(const Contact& contact, const PointContact& point) const;
    /// False where another contact of the vertex stands for it.
    bool keep_deepest(PointContact& contact);
    std::vector<Index> first_;  ///< N; first contact of a vertex
    std::vector<PointContact> list_;
};

/// Velocities and positions of tissue vertices while a response changes them one contact after the other; becomes one
/// placement per vertex.
class VertexEdits {
public:
    void prepare(const Topology& topology, const Materials& materials);
    void clear();
    [[nodiscard]] double inverse_mass(Index vertex) const { return inverse_mass_[static_cast<std::size_t>(vertex)]; }
    [[nodiscard]] Vector3 position(const Frame& frame, Index vertex) const;
    [[nodiscard]] Vector3 velocity(const Frame& frame, Index vertex) const;
    /// Σ weights (position or velocity) of a load point.
    [[nodiscard]] Vector3 position(const Frame& frame, const ContactPoint& point) const;
    [[nodiscard]] Vector3 velocity(const Frame& frame, const ContactPoint& point) const;
    /// Σ weights² / mass, 1/kg; 0 for a point of a kinematic body.
    [[nodiscard]] double mobility(const ContactPoint& point) const;
    /// Adds weight/mass times the given vector to every vertex of the point.
    void change_velocity(const Frame& frame, const ContactPoint& point, const Vector3& impulse);
    void change_position(const Frame& frame, const ContactPoint& point, const Vector3& impulse);
    void write(Effect& effect) const;

private:
    Placement& edit(const Frame& frame, Index vertex);
    std::vector<double> inverse_mass_;
    std::vector<Index> slot_;
    std::vector<Placement> edits_;
};

/// F = max(0, k d - mu v_n) n on b, its opposite on a. Tissue is pushed where there is tissue, both sides of two
/// tissues; between an instrument and a rigid body only the instrument is. Without a stiffness from method or scene:
/// the mean of the tissue's springs there, or rigid_stiffness. An open contact is such a law with a positive gap.
LinearContact spring_damper(const Topology& topology, const ContactLaws& laws, const Frame& frame, double dt,
                            const PointContact& contact);

/// Adds a force at a point to the body's wrench: what a tool feels of an impulse on tissue.
void add_reaction(Index body, const Vector3& point, const Vector3& force, Effect& effect);

/// What the responses on point contacts share: gathering, the plain penalty law between bodies that do not deform
/// (whose device mass a response does not know), and placements. A method adds what it does to contacts on
/// tissue.
class PointResponse : public Response {
public:
    struct Settings {
        LawSettings law = {};
        bool reduce = true;  ///< one closed contact per vertex and other body, the deepest
    };
    void prepare(const Topology& topology, const Materials& materials) final;
    void respond(const Frame& frame, double dt, const ContactSet& contacts, std::span<const ContactLoad> loads,
                 Effect& effect) final;

protected:
    explicit PointResponse(const Settings& settings) : settings_(settings) {}
    /// Answers the contacts of list() for which on_tissue() holds, once per tick.
    virtual void resolve(const Frame& frame, double dt, Effect& effect) = 0;

    [[nodiscard]] const std::vector<PointContact>& list() const { return points_.list(); }
    [[nodiscard]] bool on_tissue(const PointContact& contact) const;
    [[nodiscard]] const ContactLaws& laws() const { return laws_; }
    [[nodiscard]] VertexEdits& edits() { return edits_; }
    [[nodiscard]] const VertexEdits& edits() const { return edits_; }
    [[nodiscard]] LinearContact spring_damper_of(const Frame& frame, double dt, const PointContact& contact) const {
        return spring_damper(*topology_, laws_, frame, dt, contact);
    }
    /// Velocity of b's point against a's, m/s, edits included.
    [[nodiscard]] Vector3 relative_velocity(const Frame& frame, const PointContact& contact) const;
    /// Depth left after the edits so far, m.
    [[nodiscard]] double depth_left(const Frame& frame, const PointContact& contact) const;
    [[nodiscard]] double mobility(const PointContact& contact) const {
        return edits_.mobility(contact.a) + edits_.mobility(contact.b);
    }
    /// Opposite impulses (N s) on both sides, as change of velocity or, in kg m, of position.
    void push_apart(const Frame& frame, const PointContact& contact, const Vector3& impulse);
    void move_apart(const Frame& frame, const PointContact& contact, const Vector3& impulse);
    /// Force on b's side, N: its opposite is what body a feels if it is an instrument.
    void react(const Frame& frame, const PointContact& contact, const Vector3& force, Effect& effect) const;

private:
    Settings settings_;
    const Topology* topology_ = nullptr;
    ContactLaws laws_;
    PointContacts points_;
    VertexEdits edits_;
};

}  // namespace trocar
