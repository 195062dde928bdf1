// Grasping (METHODS §10): which tissue vertices a closed pair of jaws holds, from attach to slip and release. The
// thesis only says that grasped tissue follows the tool; the rule when and what is ours.
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
    bool both_jaws = false;    ///< tissue must touch two jaws (separate pieces of the instrument) or two opposing faces
                               ///< between the jaws, else nothing is grasped; false: one contact is enough
    double stiffness = 300.0;  ///< N/m, of the spring that holds a vertex
    double slip_force = 2.0;   ///< N, on one vertex
    double jaw_length = 0.012;  ///< m, from the tip towards the shaft: what is held lies there
    double release_time = 0.0;  ///< s, in which the force on a vertex that slips or is let go falls to zero
};

class Grasp {
public:
    void prepare(const Topology& topology, const Materials& materials, const GraspSettings& settings);
    /// Opens and closes: releases above q = 0.3, attaches when q falls through 0.2 (hysteresis) what the contacts say
    /// touches the jaws: the corners of tissue triangles that meet them, and features that are as good as on them. Does
    /// nothing in frames without poses.
    void update(const Topology& topology, const Materials& materials, const Frame& frame, const ContactSet& contacts);
    [[nodiscard]] const std::vector<GraspedVertex>& held() const { return held_; }
    /// True when this vertex is held by the instrument that the body belongs to: no contact response between them.
    [[nodiscard]] bool holds(Index vertex, Index body) const {
        return holder_[static_cast<std::size_t>(vertex)] >= 0 &&
               holder_[static_cast<std::size_t>(vertex)] == group_of_body_[static_cast<std::size_t>(body)];
    }
    /// Body whose pose carries the group.
    [[nodiscard]] Index body_of(Index group) const { return groups_[static_cast<std::size_t>(group)].body; }
    /// Where a held vertex should be, m, and how fast it should move, m/s.
    [[nodiscard]] Vector3 target(const Frame& frame, const GraspedVertex& held) const;
    [[nodiscard]] Vector3 target_velocity(const Frame& frame, const GraspedVertex& held, double dt) const;
    /// Holds every grasped vertex at its target by a spring and a critical damper, which the integrator takes
    /// implicitly and whose reaction the tool feels (METHODS §10, ours). First lets go of those that pull with
    /// more than the slip force or whose springs have reached the strain limit, and counts them; what was let go is
    /// pulled less and less for the release time.
    void hold_by_springs(const Materials& materials, const VertexSprings& springs, const Frame& frame, double dt,
                         ResponseOutput& output);
    /// Lets one vertex go: at once, or over the release time.
    void detach(std::size_t position);
    /// Remembers the poses of this frame; call at the end of a tick.
    void remember(const Frame& frame);

private:
    struct Group {
        Index body = -1;  ///< first body of the instrument
        std::string name;
        double last_jaw = 1.0;
        Pose last_pose = {};
        bool seen = false;
    };
    /// Let go, but not yet free.
    struct PartingVertex {
        GraspedVertex held = {};
        double stiffness = 0.0;    ///< N/m, never rises
        double first_force = 0.0;  ///< N, when it was let go
        double age = 0.0;          ///< s
    };
    /// A spring of this stiffness and its critical damper from a vertex to its target.
    void pull(const Materials& materials, const Frame& frame, const GraspedVertex& held, double stiffness, double dt,
              ResponseOutput& output) const;
    void weaken(const Frame& frame, double dt);
    void attach(const Topology& topology, const Materials& materials, const Frame& frame, const ContactSet& contacts,
                Index group);

    GraspSettings settings_;
    std::vector<Group> groups_;
    std::vector<Index> group_of_body_;  ///< -1: not an instrument
    std::vector<Index> piece_;          ///< N; smallest vertex that a vertex of an instrument is connected to
    std::vector<Index> holder_;         ///< N; group or -1
    std::vector<double> touching_;      ///< m, per body: features of that tissue no further than that touch
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
