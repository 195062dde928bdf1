// Contacts of the simpler responses: a point of each body, a normal and a depth. They come from any contact generator;
// native contacts may lack vertices, case or more.
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

/// Initial capacity of contact buffers.
inline constexpr std::size_t usual_contacts = 1024;

struct PointContact {
    Index vertex = -1;       ///< vertex that represents the contact in a reduction
    Index other = -1;        ///< body on the other side of that vertex
    Index next = -1;         ///< next contact of the same vertex
    double distance = 0.0;   ///< m, between the points a and b
    bool of_vertex = false;  ///< `vertex` has entered the other body; false: crossing edges, or a native contact
    std::array<Vector3, 16> normals{};  ///< distinct normals of equally deep and near faces
    int normal_count = 0;
    Index body_a = -1;
    Index body_b = -1;
    ContactPoint a, b;
    Vector3 normal = Vector3::Zero();  ///< unit, a to b
    double depth = 0.0;                ///< m, after this tick's scripted motion; negative: open
    std::uint64_t id = 0;              ///< Contact::id
};

/// Parameter `reduction`: `vertex` or `pair`.
Parameter reduction_parameter();

class PointContacts {
public:
    void prepare(const Topology& topology);
    /// Replaces the list. `reduce`: keeps the deepest closed contact per vertex and other body, and edge contacts only
    /// if no vertex beside them is inside. Open contacts are never reduced. Counts omitted contacts in the output, as
    /// no_direction or reduced.
    void gather(const Topology& topology, const Frame& frame, const ContactSet& contacts, bool reduce,
                ResponseOutput& output);
    [[nodiscard]] const std::vector<PointContact>& list() const { return list_; }

private:
    /// True if the list has a contact of this vertex with that body.
    [[nodiscard]] bool stands_for(Index vertex, Index other) const;
    /// True for an edge contact if a vertex beside it has entered the other body and represents the overlap.
    [[nodiscard]] bool is_left_to_a_vertex(const Contact& contact, const PointContact& point) const;
    /// False if another contact of the vertex represents it.
    bool keep_deepest(PointContact& contact);
    std::vector<Index> first_;  ///< N; first contact of a vertex
    std::vector<PointContact> list_;
};

/// Penalty law F = max(0, k d - mu v_n) n on b, its opposite on a. Between an instrument and a rigid body only the
/// instrument is pushed. Default stiffness: the mean of the tissue's springs there, or rigid_stiffness. An open contact
/// has a positive gap.
ContactForceLaw spring_damper(const Topology& topology, const ContactLaws& laws, const Frame& frame, double dt,
                              const PointContact& contact);

/// `law` with role `solved` and without k and mu: ResponseOutput::solver computes its impulse.
ContactForceLaw solved_contact(const Frame& frame, const PointContact& contact, ContactForceLaw law);

/// Base of the responses on point contacts: reduction and penalty law. With a solver, contacts on tissue have role
/// `solved`. Between non-deformable bodies all use the penalty law, since a response lacks the device's mass.
class PointResponse : public Response {
public:
    struct Settings {
        LawSettings law = {};
        bool reduce = true;  ///< one closed contact per vertex and other body, the deepest
    };
    explicit PointResponse(const Settings& settings, std::unique_ptr<SubstepSolver> solver = nullptr)
        : settings_(settings), solver_(std::move(solver)) {}
    void prepare(const Topology& topology, const Materials& materials) final;
    void respond(const Frame& frame, double dt, const ContactSet& contacts,
                 std::span<const ContactForce> contact_forces, ResponseOutput& output) final;
    [[nodiscard]] std::optional<ForceLawValues> values_in_force() const override {
        return solver_ == nullptr ? laws_.values_in_force() : std::nullopt;
    }

private:
    Settings settings_;
    std::unique_ptr<SubstepSolver> solver_;  ///< for contacts on tissue; null: the penalty law
    const Topology* topology_ = nullptr;
    ContactLaws laws_;
    PointContacts points_;
};

}  // namespace trocar
