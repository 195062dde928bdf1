// Grasping (METHODS §10): tissue vertices that closed jaws hold, from attachment to slip and release. The thesis only
// states that grasped tissue follows the tool; the rules are ours.
#pragma once

#include <string>
#include <vector>

#include "contact/contact_set.hpp"
#include "contact/response_output.hpp"
#include "respond/common.hpp"
#include "scene/world.hpp"

namespace trocar {

struct GraspedVertex {
    Index vertex = -1;
    Index group = -1;                 ///< instrument
    Vector3 local = Vector3::Zero();  ///< m, in the frame of the instrument's first body
};

struct GraspSettings {
    bool both_jaws = false;     ///< two separate jaws or two opposing faces must touch; false: one contact is enough
    double stiffness = 300.0;   ///< N/m, of the spring that holds a vertex
    double slip_force = 2.0;    ///< N, on one vertex
    double jaw_length = 0.012;  ///< m, from the tip towards the shaft, within which vertices are held
    double release_time = 0.0;  ///< s, time in which the force on a vertex that slips or is released falls to zero
};

class Grasp {
public:
    void prepare(const Topology& topology, const Materials& materials, const GraspSettings& settings);
    /// Releases above a jaw opening q of 0.3 and attaches when q falls through 0.2 (hysteresis). Attaches corners of
    /// tissue triangles that intersect the jaws, and features within 2 % of an edge of them. No effect in frames
    /// without poses.
    void update(const Topology& topology, const Materials& materials, const Frame& frame, const ContactSet& contacts);
    [[nodiscard]] const std::vector<GraspedVertex>& held() const { return held_; }
    /// True if the body's instrument holds the vertex: no contact response between them.
    [[nodiscard]] bool holds(Index vertex, Index body) const {
        return holder_[static_cast<std::size_t>(vertex)] >= 0 &&
               holder_[static_cast<std::size_t>(vertex)] == group_of_body_[static_cast<std::size_t>(body)];
    }
    /// Body whose pose moves the group.
    [[nodiscard]] Index body_of(Index group) const { return groups_[static_cast<std::size_t>(group)].body; }
    /// Target position (m) and velocity (m/s) of a held vertex.
    [[nodiscard]] Vector3 target(const Frame& frame, const GraspedVertex& held) const;
    [[nodiscard]] Vector3 target_velocity(const Frame& frame, const GraspedVertex& held, double dt) const;
    /// Holds every grasped vertex at its target by a critically damped spring, integrated implicitly, with reaction on
    /// the tool (METHODS §10, ours). First releases and counts vertices above the slip force or with springs at the
    /// strain limit. Their force decays over the release time.
    void hold_by_springs(const Materials& materials, const VertexSprings& springs, const Frame& frame, double dt,
                         ResponseOutput& output);
    /// Releases one vertex, at once or over the release time.
    void detach(std::size_t position);
    /// Stores the poses of this frame; call at the end of a tick.
    void remember(const Frame& frame);

private:
    struct Group {
        Index body = -1;  ///< first body of the instrument
        std::string name;
        double last_jaw = 1.0;
        Pose last_pose = {};
        bool seen = false;
    };
    /// Released vertex whose force still decays.
    struct PartingVertex {
        GraspedVertex held = {};
        double stiffness = 0.0;    ///< N/m, never rises
        double first_force = 0.0;  ///< N, at release
        double age = 0.0;          ///< s
    };
    /// Appends a spring of this stiffness with critical damper from a vertex to its target.
    void pull(const Materials& materials, const Frame& frame, const GraspedVertex& held, double stiffness, double dt,
              ResponseOutput& output) const;
    void weaken(const Frame& frame, double dt);
    void attach(const Topology& topology, const Materials& materials, const Frame& frame, const ContactSet& contacts,
                Index group);

    GraspSettings settings_;
    std::vector<Group> groups_;
    std::vector<Index> group_of_body_;  ///< -1: not an instrument
    std::vector<Index> piece_;          ///< N; connected component, -1: in no triangle
    std::vector<Index> holder_;         ///< N; group or -1
    std::vector<double> touching_;      ///< m, per body: largest gap at which a feature touches
    std::vector<GraspedVertex> held_;
    std::vector<PartingVertex> parting_;
    struct Touch {
        Index vertex = -1;
        Vector3 normal = Vector3::Zero();
        Index piece = -1;
        double distance = 0.0;
    };
    std::vector<Touch> touches_;
};

}  // namespace trocar
