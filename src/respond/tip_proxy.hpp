// God-object of a tool's tip against bone (thesis §3.4.2: left to the GHOST library; METHODS §8). The proxy follows the
// tip but stays outside, so that the force direction is defined at any depth and speed. After Zilles and Salisbury
// 1995, with the finite radius of Ruspini 1997.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "contact/contact_set.hpp"
#include "contact/response_output.hpp"
#include "respond/common.hpp"
#include "respond/contact_laws.hpp"
#include "respond/surface.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Ball that follows a point as closely as static triangles permit. Between two calls it moves on straight segments.
/// None of them intersects a triangle (exact test), not even at shared edges and vertices.
class GodObject {
public:
    /// `radius` in m. The ball's centre keeps that distance from the triangles, to within 1/5000 of it while it moves.
    void prepare(double radius);
    [[nodiscard]] bool placed() const { return placed_; }
    /// Places the proxy at the device (m, world), or outside if the device is inside a closed body of these triangles
    /// (by winding number).
    void place(const Topology& topology, const Matrix3X& position, std::span<const Index> triangles,
               const Vector3& device);
    /// Moves the proxy towards the device point (m, world), to the nearest position that at most three contact planes
    /// permit; returns its centre. The first call places it. `near`: the triangles around; if empty, the proxy is the
    /// device.
    const Vector3& follow(const Topology& topology, const Matrix3X& position, std::span<const Index> near,
                          const Vector3& device);
    [[nodiscard]] const Vector3& proxy() const { return proxy_; }
    /// Active planes at the end of the last call, at most three.
    [[nodiscard]] int active_planes() const { return active_; }

private:
    /// n·(goal - x) >= least
    struct Plane {
        Vector3 normal = Vector3::Zero();
        double least = 0.0;
        Vector3 foot = Vector3::Zero();  ///< nearest point of the triangle
        double distance = 0.0;
        Index triangle = -1;
    };
    struct Nearest {
        Vector3 point = Vector3::Zero();
        double distance = 0.0;
    };

    void collect_candidates(const Topology& topology, const Matrix3X& position, std::span<const Index> near,
                            const Vector3& centre, double query_distance);
    [[nodiscard]] static Nearest nearest(const Topology& topology, const Matrix3X& position, Index triangle,
                                         const Vector3& point);
    void collect_planes(const Topology& topology, const Matrix3X& position, double within);
    [[nodiscard]] Vector3 constrained_goal(const Vector3& wanted, int& active) const;
    /// Moves along the segment until a triangle is nearer than the contact offset permits; false if it could not move.
    bool move_to(const Topology& topology, const Matrix3X& position, const Vector3& goal);

    double radius_ = 5e-4;
    bool placed_ = false;
    Vector3 proxy_ = Vector3::Zero();
    int active_ = 0;
    std::vector<Index> candidates_;
    std::vector<Plane> planes_;
};

/// Tips of all instruments that can meet a rigid body. The triangles around a tip are those that the detector pairs
/// with its instrument, and their neighbours along the surface. The ball's centre lies one radius up the shaft, towards
/// the trocar or else the middle of the body. The ball's front is thus the tip.
class TipProxies {
public:
    static constexpr double default_radius = 5e-4;  ///< m (METHODS §8)

    void prepare(const Topology& topology, const Materials& materials, double radius);
    [[nodiscard]] bool empty() const { return tips_.empty(); }
    /// Moves the proxies and appends one contact per tip that is held back, on the vertex nearest to the tip. Its force
    /// is F = K |x_p - x_d| - B v >= 0 along x_p - x_d, with the tip's speed v in that direction. K and B are the
    /// pair's k (default rigid_stiffness) and mu. No effect in frames without poses.
    void respond(const Topology& topology, const Materials& materials, const ContactLaws& laws, const Frame& frame,
                 const ContactSet& contacts, ResponseOutput& output);
    /// Weight in [0, 1] of an instrument's contact with a rigid body beside the proxy. It is 0 within two radii of a
    /// tip with proxy, 1 from four radii on, smooth between. `place`: m, the contact's position on the instrument.
    [[nodiscard]] double share_left(Index instrument, const Vector3& place) const;
    /// True if the proxy replaces the contact, share_left being 0. The position is that of the instrument's feature or
    /// entering vertex, else the contact's point.
    [[nodiscard]] bool takes(const Topology& topology, const Frame& frame, const Contact& contact) const;

private:
    struct Tip {
        Index body = -1;
        Index rigid = -1;   ///< the first rigid partner, for the contact law
        Index vertex = -1;  ///< nearest to the tip
        GodObject object;
        std::vector<Index> bones;         ///< triangles of its rigid partners
        Vector3 place = Vector3::Zero();  ///< m, world, in this tick
    };
    void collect_around(const Topology& topology, const Frame& frame, const ContactSet& contacts, const Tip& tip,
                        const Vector3& device);

    std::vector<Tip> tips_;
    SurfaceNeighbours surface_;
    std::vector<std::uint32_t> reached_;  ///< per triangle: the last search that found it
    std::uint32_t search_ = 0;
    std::vector<Index> around_;
    double radius_ = default_radius;
    bool driven_ = false;  ///< the frame of this tick has poses
};

}  // namespace trocar
