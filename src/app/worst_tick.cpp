#include "app/worst_tick.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "app/view_runs.hpp"
#include "geometry/input_error.hpp"
#include "playback/playback.hpp"
#include "reference/reference.hpp"
#include "scene/scene.hpp"

namespace trocar::app {
namespace {

constexpr double mm = 1.0e3;  // m to mm

/// A vertical plane with its own x and y.
struct Cut {
    Vector3 origin = Vector3::Zero();
    Vector3 right = Vector3::UnitX();
    Vector3 up = Vector3::UnitZ();
    [[nodiscard]] Vector3 normal() const { return right.cross(up); }
    [[nodiscard]] std::array<double, 2> place(const Vector3& point) const {
        const Vector3 path = point - origin;
        return {mm * path.dot(right), mm * path.dot(up)};
    }
};

Index deepest_vertex(const PlayedFrame& frame) {
    Index deepest = 0;
    for (std::size_t v = 0; v < frame.depth.size(); ++v) {
        if (frame.depth[v] > frame.depth[static_cast<std::size_t>(deepest)] ||
            std::isnan(frame.depth[static_cast<std::size_t>(deepest)])) {
            deepest = static_cast<Index>(v);
        }
    }
    return deepest;
}

/// Along the longest path of the tool over the ground, so that a shaft is seen from its side; along x of one that
/// stands upright.
Cut cut_through(const Topology& topology, const PlayedFrame& frame) {
    const Index vertex = deepest_vertex(frame);
    Cut cut;
    cut.origin = frame.position.col(vertex);
    Matrix3 spread = Matrix3::Zero();
    for (const BodyRange& body : topology.bodies) {
        if (body.kind != BodyKind::instrument) continue;
        const auto points = frame.position.middleCols(body.vertices.first, body.vertices.count);
        const Matrix3X path = points.colwise() - points.rowwise().mean();
        spread += path * path.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Matrix3> axes(spread);
    Vector3 along = axes.eigenvectors().col(2);
    along.z() = 0.0;
    if (along.norm() > 0.2) cut.right = along.normalized() * (along.x() < 0.0 ? -1.0 : 1.0);
    return cut;
}

/// Where the plane meets the triangles of a body.
WorstTick::Body slice(const Topology& topology, const BodyRange& body, const PlayedFrame& frame, const Cut& cut) {
    const char* const kind = body.kind == BodyKind::tissue       ? "tissue"
                             : body.kind == BodyKind::instrument ? "instrument"
                                                                 : "rigid";
    WorstTick::Body slice{.name = body.name, .kind = kind, .segments = {}};
    const Vector3 normal = cut.normal();
    for (Index t = body.triangles.first; t < body.triangles.first + body.triangles.count; ++t) {
        std::array<double, 4> ends{};
        double depth = 0.0;
        std::size_t crossed = 0;
        for (int side = 0; side < 3 && crossed < 2; ++side) {
            const Index a = topology.triangles(side, t);
            const Index b = topology.triangles((side + 1) % 3, t);
            const double from = normal.dot(frame.position.col(a) - cut.origin);
            const double to = normal.dot(frame.position.col(b) - cut.origin);
            // A vertex on the plane belongs to the side that the normal points to.
            if ((from < 0.0) == (to < 0.0)) continue;
            const double share = from / (from - to);
            const auto place =
                cut.place(Vector3(frame.position.col(a) + share * (frame.position.col(b) - frame.position.col(a))));
            ends.at(2 * crossed) = place[0];
            ends.at(2 * crossed + 1) = place[1];
            const double at_a = frame.depth[static_cast<std::size_t>(a)];
            const double at_b = frame.depth[static_cast<std::size_t>(b)];
            depth += 0.5 * mm * (at_a + share * (at_b - at_a));
            ++crossed;
        }
        // A vertex on the plane makes slices without a length.
        constexpr double shortest = 1.0e-3;  // mm
        if (crossed == 2 && std::hypot(ends[2] - ends[0], ends[3] - ends[1]) > shortest)
            slice.segments.push_back({.ends = ends, .depth = depth});
    }
    return slice;
}

/// A picture shows some centimetres: what is farther away is left out of the file.
constexpr double farthest_shown = 60.0;  // mm

void keep_near(double farthest, WorstTick::Body& body) {
    std::erase_if(body.segments, [farthest](const WorstTick::Segment& one) {
        return std::any_of(one.ends.begin(), one.ends.end(),
                           [farthest](double end) { return std::abs(end) > farthest; });
    });
}

/// `marked`: vertices that the reference holds too, so that places can be compared.
WorstTick::State state_of(const Topology& topology, const PlayedFrame& frame, const Cut& cut,
                          const std::vector<Index>& marked, const std::string& name, const std::string& state_hash,
                          double farthest = farthest_shown) {
    WorstTick::State state;
    state.name = name;
    state.state_hash = state_hash;
    state.depth =
        mm * (std::isnan(frame.row.residual_penetration) ? frame.deepest_vertex() : frame.row.residual_penetration);
    for (const BodyRange& body : topology.bodies) {
        WorstTick::Body part = slice(topology, body, frame, cut);
        keep_near(farthest, part);
        if (!part.segments.empty()) state.bodies.push_back(std::move(part));
    }
    for (const Index vertex : marked) state.points.push_back(cut.place(frame.position.col(vertex)));
    return state;
}

/// The force shown on the tool, at most 300 points: of every stretch of ticks the largest.
WorstTick::Curve force_of(const std::string& name, const Record& record) {
    WorstTick::Curve curve{.name = name, .points = {}};
    const std::size_t stretch = std::max<std::size_t>(1, record.rows.size() / 300);
    for (std::size_t from = 0; from < record.rows.size(); from += stretch) {
        double most = 0.0;
        for (std::size_t i = from; i < std::min(from + stretch, record.rows.size()); ++i) {
            if (record.rows[i].tool_force.allFinite()) most = std::max(most, record.rows[i].tool_force.norm());
        }
        curve.points.emplace_back(record.rows[from].time, most);
    }
    return curve;
}

/// Runs a record's specification again and returns the frame that is wanted.
Record run_again(const Scene& scene, const Record& record, const PlaybackChoice& choice, PlayedFrame& kept) {
    Record again = play(scene, record.spec, {}, choice, [&kept](const PlayedFrame& frame) { kept = frame; });
    if (again.state_hash != record.state_hash) {
        throw InputError(record.spec.scene_file, "/state_hash", record.state_hash + " as in the record",
                         again.state_hash + ": this program moves the scene otherwise");
    }
    return again;
}

/// What the stored solution of hard contact holds: the places of some vertices, and the force.
void add_reference(const ReferenceSolution& hard, bool scripted, const PlayedFrame& frame, const Cut& cut,
                   WorstTick& seen) {
    if (!hard.available) {
        WorstTick::State none;
        none.name = "hard contact";
        none.note = "There is no stored solution.";
        seen.states.push_back(std::move(none));
        return;
    }
    const Matrix3X places = hard.positions_at(frame.time);
    WorstTick::State state;
    state.name = "hard contact (stored solution)";
    if (scripted) {  // the tool is where the script drives it, whatever the contact
        for (const WorstTick::Body& body : seen.states.front().bodies) {
            if (body.kind == "tissue") continue;
            state.bodies.push_back(body);
            for (WorstTick::Segment& one : state.bodies.back().segments) one.depth = 0.0;
        }
    }
    for (Index i = 0; i < places.cols(); ++i) state.points.push_back(cut.place(places.col(i)));
    state.note = fmt::format("It holds {} vertices{}.", places.cols(), scripted ? " and no surface" : ", no body");
    seen.states.push_back(std::move(state));
    WorstTick::Curve curve{.name = "hard contact", .points = {}};
    for (Index i = 0; i < hard.force.cols(); ++i) {
        const double time = static_cast<double>(i) * hard.sample_interval;
        if (time > hard.until || (!seen.force.empty() && time > seen.force.front().points.back().first)) break;
        curve.points.emplace_back(time, hard.force.col(i).norm());
    }
    seen.force.push_back(std::move(curve));
}

/// Every body that is no tissue stands in the same place in both frames.
bool driven_alike(const Topology& topology, const PlayedFrame& a, const PlayedFrame& b) {
    return std::all_of(topology.bodies.begin(), topology.bodies.end(), [&](const BodyRange& body) {
        return body.kind == BodyKind::tissue || a.position.middleCols(body.vertices.first, body.vertices.count) ==
                                                    b.position.middleCols(body.vertices.first, body.vertices.count);
    });
}

}  // namespace

WorstTick cut_frame(const Topology& topology, const PlayedFrame& frame, const std::string& name) {
    WorstTick seen;
    seen.scene = name;
    seen.tick = frame.tick;
    seen.time = frame.time;
    seen.states.push_back(state_of(topology, frame, cut_through(topology, frame), {},
                                   fmt::format("{}, frame {}", name, frame.tick), "",
                                   std::numeric_limits<double>::infinity()));
    return seen;
}

std::optional<WorstTick> see_worst_tick(const std::vector<Record>& records, const std::filesystem::path& study_folder,
                                        const std::optional<std::filesystem::path>& data) {
    const std::optional<WorstTickRuns> runs = worst_tick_runs(records);
    if (!runs) return std::nullopt;
    const bool first_is_deeper = runs->other == nullptr || runs->first_is_deeper;
    const Record& worst = first_is_deeper ? *runs->first : *runs->other;
    const Scene scene =
        read_scene(scene_file_of(worst, study_folder).value_or(study_folder / worst.spec.scene_file), data);
    PlayedFrame deep;
    const Record worst_again = run_again(scene, worst, {.every = 0, .deepest = true}, deep);
    const Cut cut = cut_through(scene.topology, deep);
    const FoundReference found = find_reference(scene);
    const ReferenceSolution& hard = found.reference.hard;
    const std::vector<Index> marked = hard.available ? hard.points : std::vector<Index>();
    WorstTick seen;
    seen.scene = scene.name;
    seen.tick = deep.tick;
    seen.time = deep.time;
    PlayedFrame frame = deep;
    const auto show = [&](const std::string& name, const Record& record) {
        const bool deeper = &record == &worst;
        const Record again = deeper ? worst_again : run_again(scene, record, {.every = 0, .ticks = {deep.tick}}, frame);
        seen.states.push_back(state_of(scene.topology, deeper ? deep : frame, cut, marked, name, record.state_hash));
        seen.force.push_back(force_of(name, again));
    };
    show(runs->first_name, *runs->first);
    if (runs->other != nullptr) show(runs->other_name, *runs->other);
    add_reference(hard, runs->other != nullptr && driven_alike(scene.topology, frame, deep), deep, cut, seen);
    return seen;
}

}  // namespace trocar::app
