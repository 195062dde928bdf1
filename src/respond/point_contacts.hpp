// Contacts as the plain methods see them: a point of one body against a point of another, a normal and a depth. They
// come from canonical contacts as well as from a library's own, which may lack vertices, case or more.
#pragma once

#include <vector>

#include "contact/contact_set.hpp"
#include "respond/common.hpp"
#include "scene/world.hpp"

namespace trocar {

struct PointContact {
    Index vertex = -1;  ///< the vertex that stands for the contact in a reduction
    Index other = -1;   ///< body on the other side of that vertex
    Index next = -1;    ///< next contact of the same vertex
    Index body_a = -1;
    Index body_b = -1;
    LoadPoint a, b;
    Vector3 normal = Vector3::Zero();  ///< unit, a to b
    double depth = 0.0;                ///< m, >= 0
};

class PointContacts {
public:
    void prepare(const Topology& topology);
    /// Replaces the list. `reduce`: one per vertex and other body, the deepest; else one per contact. Returns how many
    /// contacts have no place in it: touch, coplanar, degenerate, and those without triangles, normal, point or depth.
    std::int64_t gather(const Topology& topology, const Frame& frame, const ContactSet& contacts, bool reduce);
    [[nodiscard]] const std::vector<PointContact>& list() const { return list_; }

private:
    void keep_deepest(PointContact& contact);
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
    [[nodiscard]] Vector3 position(const Frame& frame, const LoadPoint& point) const;
    [[nodiscard]] Vector3 velocity(const Frame& frame, const LoadPoint& point) const;
    /// Σ weights² / mass, 1/kg; 0 for a point of a kinematic body.
    [[nodiscard]] double mobility(const LoadPoint& point) const;
    /// Adds weight/mass times the given vector to every vertex of the point.
    void change_velocity(const Frame& frame, const LoadPoint& point, const Vector3& impulse);
    void change_position(const Frame& frame, const LoadPoint& point, const Vector3& impulse);
    void write(Effect& effect) const;

private:
    Placement& edit(const Frame& frame, Index vertex);
    std::vector<double> inverse_mass_;
    std::vector<Index> slot_;
    std::vector<Placement> edits_;
};

/// F = max(0, k d - mu v_n) n on b, its opposite on a. Tissue is pushed where there is tissue, both sides of two
/// tissues; between an instrument and a rigid body only the instrument is. Without a stiffness from method or scene:
/// the mean of the tissue's springs there, or rigid_stiffness.
LinearContact spring_damper(const Topology& topology, const Materials& materials, const PairLaws& laws,
                            const Frame& frame, const PointContact& contact);

/// -impulse/dt as force on the body of a load point's kinematic side: what the tool feels of an impulse on tissue.
void add_reaction(Index body, const Vector3& point, const Vector3& force, Effect& effect);

}  // namespace trocar
