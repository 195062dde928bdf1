// Contacts as the plain methods see them: a point of one body against a point of another, a normal and a depth. They
// come from intersection contacts as well as from a library's own, which may lack vertices, case or more.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "contact/contact_set.hpp"
#include "method/response.hpp"
#include "respond/common.hpp"
#include "respond/contact_laws.hpp"
#include "scene/world.hpp"

namespace trocar {

/// So many contacts find room from the first tick on.
inline constexpr std::size_t usual_contacts = 1024;

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
    /// Counts in the output what has no place in the list: no_direction and reduced.
    void gather(const Topology& topology, const Frame& frame, const ContactSet& contacts, bool reduce,
                ResponseOutput& output);
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

/// F = max(0, k d - mu v_n) n on b, its opposite on a. Tissue is pushed where there is tissue, both sides of two
/// tissues; between an instrument and a rigid body only the instrument is. Without a stiffness from method or scene:
/// the mean of the tissue's springs there, or rigid_stiffness. An open contact is such a law with a positive gap.
ContactForceLaw spring_damper(const Topology& topology, const ContactLaws& laws, const Frame& frame, double dt,
                              const PointContact& contact);

/// The same contact, `law`, without its law: ResponseOutput::solver finds its impulse.
ContactForceLaw solved_contact(const Frame& frame, const PointContact& contact, ContactForceLaw law);

/// `acts`: the words of SolverTiming.
Parameter timing_parameter(const std::string& name_of_default);
SolverTiming read_timing(const ParameterValues& values);

/// What the responses on point contacts share: gathering, the penalty law of contacts, and, of a method with a solver,
/// contacts on tissue for that. Between bodies that do not deform, whose device mass a response does not know, all have
/// the penalty law.
class PointResponse : public Response {
public:
    struct Settings {
        LawSettings law = {};
        bool reduce = true;  ///< one closed contact per vertex and other body, the deepest
        SolverTiming timing = SolverTiming::substep;
    };
    explicit PointResponse(const Settings& settings, std::unique_ptr<SubstepSolver> solver = nullptr)
        : settings_(settings), solver_(std::move(solver)) {}
    void prepare(const Topology& topology, const Materials& materials) final;
    void respond(const Frame& frame, double dt, const ContactSet& contacts,
                 std::span<const ContactForce> contact_forces, ResponseOutput& output) final;
    [[nodiscard]] std::map<std::string, double> values_in_force() const override {
        return solver_ == nullptr ? laws_.values_in_force() : std::map<std::string, double>{};
    }

private:
    Settings settings_;
    std::unique_ptr<SubstepSolver> solver_;  ///< of contacts on tissue; null: they have the penalty law
    const Topology* topology_ = nullptr;
    ContactLaws laws_;
    PointContacts points_;
};

}  // namespace trocar
