// Global intersection analysis (Baraff, Witkin, Kass 2003; thesis §2.2 names it as too expensive to try): resolves
// interpenetration from a single frame. Closed curves of intersection cut off a region on each surface, and the regions
// attract each other until the surfaces have separated. It is the baseline of the generator `tracked_proximity`, which
// needs history.
//
// A vertex of a region and the other surface's region attract each other along the vector area of the tissue's faces.
// The other point is the first hit of a ray along that axis, else the nearest point. Nearest points alone change every
// tick in a concave region and pull sideways. The attraction is a stiff implicit spring, damped so that the distance
// decays with `relaxation_time`. `drag` damps transverse motion, since a light vertex otherwise swings aside. All other
// contacts, such as those on open curves or without tissue, act as in `penalty`.
//
// Limits of the method: a curve that ends at the rim of an open sheet has no region. A tool more than halfway through
// has the wrong region, and a tool completely through has no curve.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "geometry/exact.hpp"
#include "method/entry.hpp"
#include "respond/common.hpp"
#include "respond/intersection_regions.hpp"
#include "respond/point_contacts.hpp"
#include "respond/surface.hpp"

namespace trocar {
namespace {

struct Settings {
    double attraction = 1e5;  ///< N/m
    double drag = 2.0;        ///< N s/m
    LawSettings law = {};
};

class GlobalIntersection final : public Response {
public:
    explicit GlobalIntersection(const Settings& settings) : settings_(settings) {}

    [[nodiscard]] std::optional<ForceLawValues> values_in_force() const override {
        return laws_.values_in_force(settings_.attraction);
    }
    void prepare(const Topology& topology, const Materials& materials) override {
        topology_ = &topology;
        laws_.prepare(topology, materials, settings_.law);
        points_.prepare(topology);
        surface_.prepare(topology);
        regions_.prepare(topology);
        marked_.assign(at(topology.triangle_count()), 0);
        stamp_ = 0;
    }

    void respond(const Frame& frame, double dt, const ContactSet& contacts,
                 std::span<const ContactForce> /*contact_forces*/, ResponseOutput& output) override {
        output.clear();
        surface_.measure(*topology_, frame.position);
        regions_.find(*topology_, surface_, frame, contacts.pairs);
        others_.contacts.clear();
        for (const Contact& contact : contacts.contacts) {
            if (!resolved(contacts.pairs, contact)) others_.contacts.push_back(contact);
        }
        points_.gather(*topology_, frame, others_, true, output);
        for (const PointContact& contact : points_.list()) {
            output.contacts.push_back(spring_damper(*topology_, laws_, frame, dt, contact));
        }
        for (const IntersectionContour& contour : regions_.contours())
            attract(frame, dt, contacts.pairs, contour, output);
    }

private:
    /// True if the contact's pair lies on a curve with a region: attraction replaces it.
    [[nodiscard]] bool resolved(const std::vector<TrianglePair>& pairs, const Contact& contact) const {
        const TrianglePair pair{contact.a, contact.b};
        const auto found = std::lower_bound(pairs.begin(), pairs.end(), pair);
        if (found == pairs.end() || *found != pair) return false;
        const Index c = regions_.contour_of(static_cast<Index>(found - pairs.begin()));
        return c >= 0 && has_region(regions_.contours()[at(c)]);
    }
    static bool has_region(const IntersectionContour& contour) {
        return contour.closed && (!contour.inside_a.empty() || !contour.inside_b.empty());
    }

    /// Collects the faces of one body on a region's curve or with a vertex in the region, and one ring around them.
    void collect_patch(const std::vector<TrianglePair>& pairs, const IntersectionContour& contour, bool first) {
        patch_.clear();
        ++stamp_;
        const auto add = [this](Index t) {
            if (marked_[at(t)] == stamp_) return;
            marked_[at(t)] = stamp_;
            patch_.push_back(t);
        };
        for (const Index p : regions_.pairs_of(contour)) add(first ? pairs[at(p)].a : pairs[at(p)].b);
        for (const Index v : first ? contour.inside_a : contour.inside_b) {
            for (const Index t : surface_.triangles_at(v)) add(t);
        }
        // One ring more, since a ray from a tip may miss the region's own faces.
        const std::size_t core = patch_.size();
        for (std::size_t i = 0; i < core; ++i) {
            for (int k = 0; k < 3; ++k) {
                for (const Index t : surface_.triangles_at(topology_->triangles(k, patch_[i]))) add(t);
            }
        }
    }

    [[nodiscard]] ContactPoint nearest_in_patch(const Frame& frame, const Vector3& x) const {
        ContactPoint best;
        double least = std::numeric_limits<double>::infinity();
        for (const Index t : patch_) {
            const Vector3 weights = closest_point_on_triangle(corners_of(topology_->triangles, frame.position, t), x);
            const ContactPoint point = ContactPoint::in_triangle(topology_->triangles, t, weights);
            const double distance = (point.blend(frame.position) - x).squaredNorm();
            if (distance < least) {
                least = distance;
                best = point;
            }
        }
        return best;
    }

    /// First intersection of the ray from x with the patch; false if there is none.
    bool ray_to_patch(const Frame& frame, const Vector3& x, const Vector3& direction, ContactPoint& hit) const {
        double least = std::numeric_limits<double>::infinity();
        for (const Index t : patch_) {
            const Corners c = corners_of(topology_->triangles, frame.position, t);
            Matrix3 system;
            system << c[1] - c[0], c[2] - c[0], -direction;
            const double volume = system.determinant();
            if (std::abs(volume) < 1e-9 * (c[1] - c[0]).norm() * (c[2] - c[0]).norm()) continue;
            const Vector3 solved = system.inverse() * (x - c[0]);
            constexpr double rim = 1e-9;  // tolerance: no gap between faces that share an edge
            if (solved[0] < -rim || solved[1] < -rim || solved[0] + solved[1] > 1.0 + rim) continue;
            if (solved[2] < 0.0 || solved[2] >= least) continue;
            least = solved[2];
            hit = ContactPoint::in_triangle(topology_->triangles, t,
                                            Vector3(1.0 - solved[0] - solved[1], solved[0], solved[1]));
        }
        return std::isfinite(least);
    }

    /// Unit direction in which the tissue separates: vector area of its patch, which depends on the patch's boundary
    /// only. Zero if the area nearly vanishes.
    [[nodiscard]] Vector3 path_out(const Frame& frame, const std::vector<TrianglePair>& pairs,
                                   const IntersectionContour& contour) const {
        Vector3 sum = Vector3::Zero();
        double area = 0.0;
        for (const Index t : patch_) {
            const Vector3 normal = area_normal(corners_of(topology_->triangles, frame.position, t));
            sum += normal;
            area += normal.norm();
        }
        constexpr double least_share = 0.05;
        if (!(sum.norm() > least_share * area)) return Vector3::Zero();
        Vector3 towards = Vector3::Zero();
        for (const Index v : contour.inside_a) towards += frame.position.col(v) - contour.centre;
        if (contour.inside_a.empty()) {
            for (const Index p : regions_.pairs_of(contour)) {
                towards += area_normal(corners_of(topology_->triangles, frame.position, pairs[at(p)].a));
            }
        }
        const Vector3 axis = sum.normalized();
        return towards.dot(axis) < 0.0 ? Vector3(-axis) : axis;
    }

    void attract(const Frame& frame, double dt, const std::vector<TrianglePair>& pairs,
                 const IntersectionContour& contour, ResponseOutput& output) {
        if (!has_region(contour)) return;
        collect_patch(pairs, contour, false);
        const Vector3 axis = path_out(frame, pairs, contour);
        for (const Index v : contour.inside_a) {
            const Vector3 x = frame.position.col(v);
            ContactPoint met;
            const bool along = !axis.isZero() && ray_to_patch(frame, x, -axis, met);
            pull(frame, dt, contour.body_a, ContactPoint::at_vertex(v), along ? met : nearest_in_patch(frame, x),
                 along ? axis : Vector3::Zero(), output);
        }
        collect_patch(pairs, contour, true);
        for (const Index v : contour.inside_b) {
            const Vector3 x = frame.position.col(v);
            ContactPoint met;
            const bool along = !axis.isZero() && ray_to_patch(frame, x, axis, met);
            pull(frame, dt, contour.body_a, along ? met : nearest_in_patch(frame, x), ContactPoint::at_vertex(v),
                 along ? axis : Vector3::Zero(), output);
        }
    }

    /// Attraction between a point of tissue and a point of body a, along `axis` or, if that is zero, along their
    /// connection.
    void pull(const Frame& frame, double dt, Index body_a, const ContactPoint& a, const ContactPoint& tissue,
              const Vector3& axis, ResponseOutput& output) const {
        const Vector3 path = a.blend(frame.position) - tissue.blend(frame.position);
        const double distance = axis.isZero() ? path.norm() : path.dot(axis);
        if (!(distance > 0.0)) return;
        ContactForceLaw contact;
        contact.role = ContactRole::constraint;
        contact.vertices = tissue.vertices;
        contact.weights = tissue.weights;
        contact.normal = axis.isZero() ? Vector3(path / distance) : axis;
        contact.gap = -distance;
        contact.k = settings_.attraction;
        contact.mu = settings_.attraction * settings_.law.relaxation_time;
        contact.face_velocity = a.blend(frame.velocity).dot(contact.normal);
        const BodyKind kind = topology_->bodies[at(body_a)].kind;
        if (kind == BodyKind::tissue) {
            contact.reaction_vertices = a.vertices;
            contact.reaction_weights = a.weights;
        } else if (kind == BodyKind::instrument) {
            react_on_line(frame, body_a, contact);
        }
        report_at_start(*topology_, frame, dt, contact);
        output.contacts.push_back(contact);
        if (settings_.drag <= 0.0) return;
        // Transverse dampers between the two points.
        const Vector3 across = contact.normal.unitOrthogonal();
        for (const Vector3& direction : {across, Vector3(contact.normal.cross(across))}) {
            contact.normal = direction;
            contact.gap = 0.0;
            contact.k = 0.0;
            contact.mu = settings_.drag;
            contact.face_velocity = a.blend(frame.velocity).dot(direction);
            contact.role = ContactRole::damper;
            output.contacts.push_back(contact);
        }
    }

    Settings settings_;
    const Topology* topology_ = nullptr;
    ContactLaws laws_;
    PointContacts points_;
    SurfaceNeighbours surface_;
    IntersectionRegions regions_;
    ContactSet others_;
    std::vector<Index> patch_;
    std::vector<std::uint32_t> marked_;  ///< per triangle: stamp of its last patch
    std::uint32_t stamp_ = 0;
};

}  // namespace

ResponseEntry global_intersection_response() {
    ResponseEntry entry;
    entry.name = "global_intersection";
    entry.version = "1";
    entry.own = true;
    entry.contact_generators = {"intersection", "native"};  // traces intersecting triangles
    entry.without_tissue = acts_as_penalty;
    entry.parameters = {
        number_parameter("attraction", "N/m", "100000", 0.0, 1e9,
                         "spring between a vertex of one region and the nearest point of the other"),
        number_parameter("drag", "N s/m", "2", 0.0, 1e6, "damping between the two points across the pull")};
    const std::vector<Parameter> law =
        law_parameters_on_tissue(std::string(auto_stiffness) + "; of contacts without a region", false);
    entry.parameters.insert(entry.parameters.end(), law.begin(), law.end());
    entry.make = [](const ParameterValues& values) -> std::unique_ptr<Response> {
        return std::make_unique<GlobalIntersection>(Settings{.attraction = values.number("attraction"),
                                                             .drag = values.number("drag"),
                                                             .law = read_law_settings(values)});
    };
    return entry;
}

}  // namespace trocar
