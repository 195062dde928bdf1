// The god-object of a tool's tip against bone (thesis §3.4.2: left to the GHOST library; METHODS §8): a proxy that
// follows the tip but stays outside, so that the force has a direction however deep and however fast the tip enters.
// After Zilles and Salisbury 1995, with the finite radius of Ruspini 1997.
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

/// A ball that follows a point as closely as the triangles let it. Between two calls it moves on straight segments;
/// none of them meets a triangle (exact test), whatever edge or vertex the triangles share. Triangles do not move.
class GodObject {
public:
    /// `radius` in m. The ball's centre keeps that distance from the triangles, to within a five-thousandth of it
    /// while it moves.
    void prepare(double radius);
    [[nodiscard]] bool placed() const { return placed_; }
    /// Puts the proxy at the device (m, world), or outside when the device is inside a closed body of these triangles
    /// by its winding number.
    void place(const Topology& topology, const Matrix3X& position, std::span<const Index> triangles,
               const Vector3& device);
    /// Moves the proxy towards the device point (m, world) to the nearest place that at most three contact planes
    /// allow, seen from where it was; returns its centre. The first call places it. `proximity`: the triangles around;
    /// where there are none the proxy is the device.
    const Vector3& follow(const Topology& topology, const Matrix3X& position, std::span<const Index> near,
                          const Vector3& device);
    [[nodiscard]] const Vector3& proxy() const { return proxy_; }
    /// Contact planes that held the proxy at the end of the last call, at most three.
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
    /// Moves along the segment until a triangle is nearer than the skin allows; false when it could not move.
    bool move_to(const Topology& topology, const Matrix3X& position, const Vector3& goal);

    double radius_ = 5e-4;
    bool placed_ = false;
    Vector3 proxy_ = Vector3::Zero();
    int active_ = 0;
    std::vector<Index> candidates_;
    std::vector<Plane> planes_;
};

/// The tips of all instruments that may meet a rigid body. Which triangles are around a tip is what the detector says
/// meets or is near its instrument, and their neighbours along the surface: a blunt tip has faces under it that its rim
/// does not touch. The ball's centre lies one radius up the shaft (towards the
/// trocar, else the middle of the body), so that the ball's front is the tip.
class TipProxies {
public:
    static constexpr double default_radius = 5e-4;  ///< m (METHODS §8)

    void prepare(const Topology& topology, const Materials& materials, double radius);
    [[nodiscard]] bool empty() const { return tips_.empty(); }
    /// Moves the proxies and adds to the output one contact per tip that is held back: F = K |x_p - x_d| - B v along
    /// x_p - x_d on the vertex nearest to the tip, not below 0. K and B are the pair's k (default rigid_stiffness) and
    /// mu; v is the tip's speed along that direction. Nothing for frames without poses.
    void respond(const Topology& topology, const Materials& materials, const ContactLaws& laws, const Frame& frame,
                 const ContactSet& contacts, ResponseOutput& output);
    /// How much of a contact of an instrument with a rigid body is not the proxy's, in [0, 1]: nothing within two radii
    /// of a tip that is led by a proxy in this tick, all of it from four radii on, smooth between, so that a contact
    /// that slides away from the tip is handed over without a jump. `place` is where the instrument is in contact, m.
    [[nodiscard]] double share_left(Index instrument, const Vector3& place) const;
    /// True when nothing of a contact of an instrument with a rigid body is left beside the proxy; its place is the
    /// instrument's vertex, or the contact's point where none enters, or the instrument's feature.
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
    std::vector<std::uint32_t> reached_;  ///< per triangle: the look around that came to it last
    std::uint32_t search_ = 0;
    std::vector<Index> around_;
    double radius_ = default_radius;
    bool driven_ = false;  ///< poses were known in this tick
};

}  // namespace trocar
