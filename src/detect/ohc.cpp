// ohc: the detector of the thesis (§3.3, §4.2), as METHODS §2 reconstructs it. Space is a uniform grid, and no mesh
// connectivity is used. Bodies are compared by one box each, so the work grows with the triangles and not with the
// pairs of bodies. A tick is a cascade: each level passes on what it could not rule out. This file decides the order of
// levels and declares the parameters:
//
// * boxes of bodies [update]: where bodies can meet at all, the intersections of their boxes. The cells there are the
//   window of this tick (ohc_bodies.hpp, ohc_meeting.hpp).
// * occupancy [update]: per group one bit per cell of the window, from the vertices. Three numbers, one per corner,
//   rule out nearly all triangles. Others are ruled out when they lie outside those intersections
//   (ohc_occupancy.hpp).
// * shared cells [update]: the same bits for the remaining triangles, from their exact cells (ohc_occupancy.hpp).
// * three maps [detect]: triangles in cells of two groups are hashed. The maps hold live cells, the bodies in each,
//   and their triangles. Two triangles in a live cell with overlapping boxes are a candidate (ohc_maps.hpp).
// * triangles [detect]: the exact test (narrow_phase.hpp); with swept=on also the continuous one (swept.hpp).
//
// No pair is lost: see lattice.hpp. With a query distance every box, cell range and box test uses the same grown
// triangle (ohc_bodies.hpp decides which of two is grown). Triangles that span very many cells are cut into pieces for
// marking and hashing only (triangle_cells.hpp). Where pieces cost more, a triangle is tested against every other one.
//
// No state is kept between ticks, except under limits. Then pairs of the last tick are tested first, then pairs with an
// instrument, then all others (ohc_limits.hpp).
#include <algorithm>
#include <memory>
#include <vector>

#include "detect/narrow_phase.hpp"
#include "detect/ohc_bodies.hpp"
#include "detect/ohc_limits.hpp"
#include "detect/ohc_maps.hpp"
#include "detect/ohc_occupancy.hpp"
#include "detect/ohc_work.hpp"
#include "detect/pair_sort.hpp"
#include "detect/shared_parameters.hpp"
#include "detect/swept.hpp"
#include "method/entry.hpp"
#include "method/frame_check.hpp"

namespace trocar {
namespace {

class Ohc final : public Detector {
public:
    explicit Ohc(const OhcSettings& settings) : settings_(settings) { work_.budget = settings.work_budget; }

    void prepare(const Topology& topology, const Frame& frame) override {
        topology_ = &topology;
        bodies_.prepare(topology, frame);
        // Reserved for a crowded tick; more is allocated on demand.
        constexpr std::int64_t crowd = 16384;
        const std::int64_t triangles = topology.triangle_count();
        const auto room = static_cast<std::size_t>(std::min(crowd, triangles));
        occupancy_.prepare(room);
        constexpr std::int64_t cells_of_triangle = 4;
        maps_.prepare(settings_, static_cast<std::size_t>(std::min(crowd, cells_of_triangle * triangles)));
        limits_.prepare();
        candidates_.reserve(room);
        sorted_.reserve(room);
    }

    void update(const Frame& frame, double query_distance) override {
        work_.start();
        if (query_distance != bodies_.query_distance()) bodies_.set_query_distance(query_distance);
        find_shared(frame);
        after_update_ = work_;
    }

    void detect(const Frame& frame, ContactSet& contacts) override {
        contacts.clear();
        if (!answerable_ && !check_frame(*topology_, frame, contacts)) return;
        contacts.query_distance = bodies_.query_distance();
        work_ = after_update_;
        if (settings_.limited()) {
            limits_.detect(frame, candidates_, contacts);
        } else {
            detect_all(frame, contacts);
        }
        sort_pairs(contacts.pairs, sorted_);
        sort_pairs(contacts.near, sorted_);
        sort_swept(contacts.swept);
        contacts.work = work_.counters;
        contacts.truncated = work_.truncated;
    }

private:
    /// The levels of update.
    void find_shared(const Frame& frame) {
        occupancy_.clear();
        bodies_.cells().set_path(false);
        answerable_ = bodies_.read_boxes(frame);
        const std::int64_t to_read = topology_->vertex_count * std::int64_t{bodies_.cells().path() ? 2 : 1};
        if (!answerable_ || bodies_.groups().size() < 2) return;
        if (!work_.spend(work_.counters.vertices_read, to_read)) return;
        if (!bodies_.has_cell()) bodies_.choose_cell(frame);
        const CellRange meeting = bodies_.place_groups();
        if (!is_empty(meeting)) occupancy_.find(frame, meeting);
    }

    /// The levels of detect, without limits.
    void detect_all(const Frame& frame, ContactSet& contacts) {
        candidates_.clear();
        maps_.hash(frame);
        maps_.gather(
            OhcMaps::any_bodies, [] { return true; }, candidates_);
        maps_.gather_huge(frame, OhcMaps::any_bodies, candidates_);
        candidates_.settle();
        if (bodies_.cells().path()) {
            work_.counters.box_tests += static_cast<std::int64_t>(candidates_.once.size());
            std::erase_if(candidates_.once, [&](const TrianglePair& pair) {
                return !may_meet_on_path(*topology_, frame, pair, bodies_.query_distance());
            });
        }
        const auto tests = static_cast<std::int64_t>(candidates_.once.size());
        work_.counters.triangle_tests += tests;
        work_.counters.triangle_tests += test_pairs_within(bodies_.query_distance(), settings_.test, *topology_, frame,
                                                           candidates_.once, contacts.pairs, contacts.near);
        if (!bodies_.cells().path()) return;
        work_.counters.triangle_tests += tests;
        test_swept(*topology_, frame, candidates_.once, contacts.swept);
    }

    OhcSettings settings_;
    const Topology* topology_ = nullptr;
    OhcWork work_;
    OhcWork after_update_;
    OhcBodies bodies_{settings_};
    OhcOccupancy occupancy_{bodies_, work_};
    OhcMaps maps_{bodies_, occupancy_, work_};
    OhcLimits limits_{settings_, bodies_, maps_, work_};
    bool answerable_ = false;  ///< the frame of the last update has finite numbers that fit the topology
    OhcCandidates candidates_;
    std::vector<TrianglePair> sorted_;  ///< scratch
};

}  // namespace

DetectorEntry ohc_detector() {
    return {
        .name = "ohc",
        .configuration = "double precision cells and boxes; exact triangle test; one thread",
        .own = true,
        .claims_exact = true,
        .query_distance = true,
        .parameters =
            {{.name = "cell",
              .unit = "m",
              .default_value = "auto",
              .minimum = 1e-12,
              .meaning =
                  "edge of a cell; auto = 1.5 x the mean edge of the moving body with the shortest edges, at least the "
                  "scene's mean edge",
              .words = {"auto"}},
             choice_parameter("hash", "fibonacci", {"fibonacci", "teschner"},
                              "hash of a cell's numbers; changes the time, never the answer"),
             test_parameter(),
             swept_parameter(),
             work_budget_parameter()},
        .make = [](const ParameterValues& values) {
            OhcSettings settings;
            settings.cell = values.number("cell");
            settings.hash = values.is("hash", "teschner") ? CellHash::teschner : CellHash::fibonacci;
            settings.take(values);
            return std::make_unique<Ohc>(settings);
        }};
}

}  // namespace trocar
