// libccd 2.1 as a narrow phase: GJK (with EPA for depths) or MPR on pairs of triangles. It has no broad phase, so the
// candidates are the neutral ones of geometry/box_pairs, whose time is charged to it; bodies apart are not asked about.
//
// Settings, and where they depart from the library's defaults (measured facts in README.md):
//  iterations      at most 100 (default: no limit, and then some inputs never end). MPR has inner loops without any
//                  cap, which only the time limit of a run can end.
//  tolerances      1e-6 of the mean edge for EPA and MPR (default 1e-4 in absolute units, which is a tenth of a
//                  millimetre for a scene in metres).
//  scale           each pair is moved to its own first corner and divided by the mean edge of the scene, so that
//                  features are far above the tolerances wherever the scene lies and whatever its unit.
//  first direction the default (1, 0, 0); after a result that is not finite the query is repeated once with another
//                  direction, and the repeats are in the triangle test counter.
//  support         the best of three corners: for triangles there is nothing faster.
// Native contacts, from GJK + EPA or MPR: depth, direction (moving the second body along it parts the two) and
// position. MPR's depth is measured along the line of centres, not the least translation.
#include <ccd/ccd.h>
#include <ccd/vec3.h>
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <vector>

#include "candidates.hpp"
#include "geometry/box_pairs.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

struct CcdTriangle {
    ccd_vec3_t corner[3];
};

void support(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* best) {
    const auto& triangle = *static_cast<const CcdTriangle*>(object);
    int farthest = 0;
    ccd_real_t most = ccdVec3Dot(&triangle.corner[0], direction);
    for (int k = 1; k < 3; ++k) {
        const ccd_real_t distance = ccdVec3Dot(&triangle.corner[k], direction);
        if (distance > most) {
            most = distance;
            farthest = k;
        }
    }
    ccdVec3Copy(best, &triangle.corner[farthest]);
}

void center(const void* object, ccd_vec3_t* middle) {
    const auto& triangle = *static_cast<const CcdTriangle*>(object);
    ccdVec3Copy(middle, &triangle.corner[0]);
    ccdVec3Add(middle, &triangle.corner[1]);
    ccdVec3Add(middle, &triangle.corner[2]);
    ccdVec3Scale(middle, CCD_REAL(1.0) / CCD_REAL(3.0));
}

void other_direction(const void*, const void*, ccd_vec3_t* direction) {
    ccdVec3Set(direction, CCD_REAL(0.36), CCD_REAL(-0.48), CCD_REAL(0.8));
}

struct Settings {
    bool mpr = false;
    double tolerance = 1e-6;
};

class CcdPairs final : public Detector {
public:
    explicit CcdPairs(const Settings& settings) : settings_(settings) {
        CCD_INIT(&ccd_);
        ccd_.support1 = support;
        ccd_.support2 = support;
        ccd_.center1 = center;
        ccd_.center2 = center;
        ccd_.max_iterations = 100;
        ccd_.epa_tolerance = static_cast<ccd_real_t>(settings.tolerance);
        ccd_.mpr_tolerance = static_cast<ccd_real_t>(settings.tolerance);
        retry_ = ccd_;
        retry_.first_dir = other_direction;
    }

    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        unit_ = 0.0;
        if (is_answerable(topology, frame)) choose_unit(frame);
    }

    void update(const Frame& frame, double query_distance) override {
        query_distance_ = query_distance;
        if (!is_answerable(*topology_, frame)) return;
        if (unit_ == 0.0) choose_unit(frame);
        triangle_boxes(frame.position, topology_->triangles, boxes_);
        body_boxes_.clear();
        for (const BodyRange& body : topology_->bodies) {
            body_boxes_.push_back(baselines::box_of_body(frame, body));
        }
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!check_frame(*topology_, frame, contacts)) return;
        if (!check_no_query_distance(query_distance_, contacts)) return;
        contacts.work.vertices_read = topology_->vertex_count;
        out_of_memory_ = false;
        for (const auto& [a, b] : topology_->body_pairs) {
            if (!body_boxes_[static_cast<std::size_t>(a)].overlaps(body_boxes_[static_cast<std::size_t>(b)])) continue;
            overlapping_boxes(boxes_, topology_->bodies[static_cast<std::size_t>(a)].triangles,
                              topology_->bodies[static_cast<std::size_t>(b)].triangles, candidates_);
            contacts.work.box_tests += static_cast<std::int64_t>(candidates_.size());
            for (const auto& [first, second] : candidates_) test(frame, first, second, contacts);
        }
        contacts.sort();
        if (out_of_memory_) contacts.outcome = {OutcomeKind::threw, "libccd ran out of memory"};
    }

private:
    /// Mean edge of the scene, m; the length that becomes 1.
    void choose_unit(const Frame& frame) {
        double sum = 0.0;
        for (Index t = 0; t < topology_->triangle_count(); ++t) {
            const auto v = topology_->triangles.col(t);
            for (int k = 0; k < 3; ++k) sum += (frame.position.col(v((k + 1) % 3)) - frame.position.col(v(k))).norm();
        }
        unit_ = topology_->triangle_count() > 0 ? sum / (3.0 * topology_->triangle_count()) : 0.0;
    }

    CcdTriangle triangle(const Frame& frame, Index number, const Vector3& origin) const {
        CcdTriangle result;
        for (int k = 0; k < 3; ++k) {
            const Vector3 x = (frame.position.col(topology_->triangles(k, number)) - origin) / length();
            ccdVec3Set(&result.corner[k], static_cast<ccd_real_t>(x[0]), static_cast<ccd_real_t>(x[1]),
                       static_cast<ccd_real_t>(x[2]));
        }
        return result;
    }
    [[nodiscard]] double length() const { return unit_ > 0.0 ? unit_ : 1.0; }

    void test(const Frame& frame, Index a, Index b, ContactSet& contacts) {
        const Vector3 origin = frame.position.col(topology_->triangles(0, a));
        const CcdTriangle first = triangle(frame, a, origin);
        const CcdTriangle second = triangle(frame, b, origin);
        ++contacts.work.triangle_tests;
        if (!contacts.native_wanted) {
            const int hit =
                settings_.mpr ? ccdMPRIntersect(&first, &second, &ccd_) : ccdGJKIntersect(&first, &second, &ccd_);
            if (hit != 0) contacts.pairs.push_back({a, b});
            return;
        }
        Contact contact;
        int code = query(first, second, ccd_, contact);
        if (code == 0 && !(std::isfinite(contact.depth) && contact.normal.allFinite() && contact.point.allFinite())) {
            ++contacts.work.triangle_tests;
            code = query(first, second, retry_, contact);
        }
        if (code == -2) out_of_memory_ = true;
        if (code != 0) return;
        contacts.pairs.push_back({a, b});
        // "Intersects" without a usable direction is a pair and no contact.
        if (!std::isfinite(contact.depth) || !contact.normal.allFinite() || !contact.point.allFinite()) return;
        contact.a = a;
        contact.b = b;
        contact.point = origin + length() * contact.point;
        contact.depth *= length();
        contacts.native.push_back(contact);
    }

    int query(const CcdTriangle& first, const CcdTriangle& second, const ccd_t& ccd, Contact& contact) const {
        ccd_real_t depth = CCD_REAL(0.0);
        ccd_vec3_t direction = {};
        ccd_vec3_t position = {};
        const int code = settings_.mpr ? ccdMPRPenetration(&first, &second, &ccd, &depth, &direction, &position)
                                       : ccdGJKPenetration(&first, &second, &ccd, &depth, &direction, &position);
        contact.depth = static_cast<double>(depth);
        contact.normal = Vector3(direction.v[0], direction.v[1], direction.v[2]);
        contact.point = Vector3(position.v[0], position.v[1], position.v[2]);
        return code;
    }

    Settings settings_;
    ccd_t ccd_{};
    ccd_t retry_{};
    const Topology* topology_ = nullptr;
    double query_distance_ = 0.0;  ///< m
    double unit_ = 0.0;
    bool out_of_memory_ = false;
    std::vector<Box> boxes_;
    std::vector<Box> body_boxes_;
    std::vector<IndexPair> candidates_;
};

}  // namespace

DetectorEntry ccd_pairs_detector() {
    return {
        .name = "ccd_pairs",
        .library = "libccd",
        .version = TROCAR_CCD_VERSION,
        .configuration = fmt::format(
            "sizeof(ccd_real_t) {}; release 2.1 announces itself as 2.0; candidates from boxes sorted along one axis",
            sizeof(ccd_real_t)),
        .native_contacts = true,
        .parameters = {choice_parameter("algorithm", "gjk", {"gjk", "mpr"},
                                        "GJK, with EPA where a depth is wanted, or Minkowski portal refinement"),
                       number_parameter("tolerance", "1", "1e-6", 1e-15, 1.0,
                                        "of EPA and MPR, as a fraction of the scene's mean edge")},
        .make = [](const ParameterValues& values) -> std::unique_ptr<Detector> {
            return std::make_unique<CcdPairs>(
                Settings{.mpr = values.is("algorithm", "mpr"), .tolerance = values.number("tolerance")});
        }};
}

}  // namespace trocar
