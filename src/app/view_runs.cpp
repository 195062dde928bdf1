#include "app/view_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include "app/shipped.hpp"
#include "geometry/input_error.hpp"
#include "measure/environment.hpp"
#include "method/registry.hpp"
#include "playback/playback.hpp"
#include "reference/reference.hpp"
#include "report/figures.hpp"
#include "report/view_links.hpp"
#include "scene/recording.hpp"

namespace trocar::app {
namespace {

double depth_at_worst(const Record& record) {
    const double depth = value_of(record.summary, Metric::residual_penetration_max_m);
    return std::isfinite(depth) ? depth : std::numeric_limits<double>::infinity();
}

/// Better ones first: what ended well, what left less, the first process.
bool is_better(const Record* a, const Record* b) {
    const auto rank = [](const Record* one) {
        return std::tuple(!one->outcome.ok(), depth_at_worst(*one), one->spec.response, one->spec.contacts,
                          one->spec.detector, one->spec.stepper, one->spec.repetition);
    };
    return rank(a) < rank(b);
}

const Record* best_of(const std::vector<const Record*>& records, const std::function<bool(const Record&)>& fits) {
    const Record* best = nullptr;
    for (const Record* one : records) {
        if (fits(*one) && (best == nullptr || is_better(one, best))) best = one;
    }
    return best;
}

/// What is shown of a run that never moved: the scene at rest.
void add_rest(const Matrix3X& rest, const Topology& topology, ViewedRun& run) {
    if (!run.frames.empty()) return;
    ViewedFrame& frame = run.frames.emplace_back();
    frame.tick = 0;
    frame.position = rest;
    const std::size_t count = tissue_vertices(topology).size();
    frame.depth.assign(count, 0.0);
    frame.strain.assign(count, 0.0);
}

/// The vertex of the first driven instrument that is nearest to its tip; -1 without one.
Index tip_vertex(const Scene& scene) {
    for (std::size_t body = 0; body < scene.bodies.size(); ++body) {
        const BodyRange& range = scene.topology.bodies[body];
        if (range.kind != BodyKind::instrument || !scene.bodies[body].motion || body >= scene.first.pose.size()) {
            continue;
        }
        const Vector3 tip = body < scene.materials.tip.size() ? scene.materials.tip[body] : Vector3::Zero();
        const Pose& pose = scene.first.pose[body];
        const Vector3 place = pose.rotation * tip + pose.translation;
        Index nearest = range.vertices.first;
        for (Index vertex = range.vertices.first; vertex < range.vertices.end(); ++vertex) {
            const auto distance = [&](Index one) { return (scene.first.position.col(one) - place).squaredNorm(); };
            if (distance(vertex) < distance(nearest)) nearest = vertex;
        }
        return nearest;
    }
    return -1;
}

void add_references(const Scene& scene, ViewPage& page) {
    const FoundReference found = find_reference(scene);
    const auto add = [&](const ReferenceSolution& law, const char* name, bool solid) {
        if (!law.available || law.force.cols() == 0) return;
        ViewedReference& reference = page.references.emplace_back();
        reference.name = name;
        reference.solid = solid;
        for (std::int64_t tick = 0; tick < page.ticks; ++tick) {
            const double time = static_cast<double>(tick) * scene.dt;
            const bool valid = !(time > law.until);
            reference.force.push_back(valid ? law.force_at(time).norm() : std::nan(""));
        }
    };
    add(found.reference.equal_k, "reference, equal stiffness", true);
    add(found.reference.hard, "reference, hard", false);
}

std::string made_by() {
    const std::map<std::string, std::string> here = environment();
    return fmt::format("trocar {}, commit {}{}.", here.at("version"), here.at("commit").substr(0, 12),
                       here.at("dirty") == "yes" ? " with changes" : "");
}

std::string methods_of(const RunSpec& spec) {
    std::string text = fmt::format("{}, {} contacts", spec.detector, spec.contacts);
    if (!spec.stepper.empty()) text += ", " + spec.stepper;
    return text;
}

/// Labels distinguish the runs in as few words as possible.
void name_runs(const std::vector<RunSpec>& specs, ViewPage& page) {
    const auto unique = [&page] {
        std::set<std::string> labels;
        for (const ViewedRun& run : page.runs) labels.insert(run.label);
        return labels.size() == page.runs.size();
    };
    for (const auto& part : {&RunSpec::contacts, &RunSpec::detector, &RunSpec::stepper}) {
        if (unique()) return;
        for (std::size_t k = 0; k < specs.size(); ++k) {
            if (!(specs[k].*part).empty()) page.runs[k].label += " · " + specs[k].*part;
        }
    }
}

}  // namespace

std::vector<const Record*> chosen_records(const std::vector<Record>& records, const std::string& scene,
                                          const std::vector<std::string>& responses) {
    std::vector<const Record*> there;
    for (const Record& record : records) {
        if (can_be_viewed(record) && record.spec.scene == scene) there.push_back(&record);
    }
    std::vector<const Record*> chosen;
    for (const std::string& response : responses) {
        const Record* const best = best_of(there, [&response](const Record& one) {
            return one.spec.response == response || parse_method(one.spec.response).name == response;
        });
        if (best == nullptr) {
            std::set<std::string> known;
            for (const Record* one : there) known.insert(one->spec.response);
            throw InputError("command line", "--response",
                             fmt::format("a response of the records of {} ({})", scene, fmt::join(known, ", ")),
                             fmt::format("'{}'", response));
        }
        if (std::find(chosen.begin(), chosen.end(), best) == chosen.end()) chosen.push_back(best);
    }
    if (!responses.empty()) return chosen;
    const auto ours = [](const Record& one) {
        const std::string named = fact_of(one, "study.ours");
        return named.empty() ? fact_of(one, "response.own") == "yes" : one.spec.response == named;
    };
    const Record* const own = best_of(there, ours);
    const Record* const other = best_of(there, [&](const Record& one) {
        return !(own != nullptr && one.spec.response == own->spec.response) &&
               fact_of(one, "response.control") != "yes";
    });
    if (own != nullptr) chosen.push_back(own);
    if (other != nullptr) chosen.push_back(other);
    return chosen;
}

std::optional<std::filesystem::path> scene_file_of(const Record& record, const std::filesystem::path& study_folder) {
    const std::filesystem::path named = (study_folder / record.spec.scene_file).lexically_normal();
    if (std::filesystem::is_regular_file(named)) return named;
    for (const std::filesystem::path& file : shipped_scenes()) {
        if (file.stem() == record.spec.scene) return file;
    }
    return std::nullopt;
}

std::filesystem::path study_folder_of(const Record& record) {
    return std::filesystem::path(fact_of(record, "study.file")).parent_path();
}

ViewPage page_of(const Scene& scene) {
    ViewPage page;
    page.scene = scene.name;
    page.foot = made_by();
    page.dt = scene.dt;
    page.ticks = scene.ticks;
    page.topology = scene.topology;
    page.rest = scene.first.position;
    page.tool_vertex = tip_vertex(scene);
    add_references(scene, page);
    return page;
}

void add_run(const Scene& scene, const RunSpec& spec, const Record* record, const ViewProgress& progress,
             ViewPage& page) {
    ViewedRun run;
    const bool has_end = record == nullptr || !record->state_hash.empty();
    if (has_end) {
        RunSpec judged = spec;
        judged.truth_stride = 1;  // curves are of every tick
        judged.detail_stride = std::max<std::int64_t>(1, scene.ticks);
        const Index tool = page.tool_vertex < 0 ? -1 : scene.topology.body_of_vertex(page.tool_vertex);
        RunCapture capture(scene.topology, viewed_stride, true, tool);
        RunLimits limits;
        limits.progress = [&](std::int64_t done) {
            if (progress) progress(spec.response, done);
            return true;
        };
        const Record again =
            play(scene, judged, limits, {.every = 1}, [&capture](const PlayedFrame& frame) { capture.see(frame); });
        run = capture.finish();
        run.outcome = name_of(again.outcome.kind);
        run.message = again.outcome.message;
        if (record != nullptr && record->state_hash != again.state_hash) {
            run.note = fmt::format(
                "these frames are not those of the record: its last state is {}, this program's {} (recorded by commit "
                "{})",
                record->state_hash, again.state_hash, fact_of(*record, "commit").substr(0, 12));
        }
    } else {
        run.outcome = name_of(record->outcome.kind);
        run.message = record->outcome.message;
    }
    run.label = spec.response;
    run.methods = methods_of(spec);
    add_rest(page.rest, page.topology, run);
    page.ticks = std::max(page.ticks, static_cast<std::int64_t>(run.force.size()));
    page.runs.push_back(std::move(run));
}

void finish_page(const std::vector<RunSpec>& specs, ViewPage& page) {
    page.about = fmt::format("{} bodies, {} triangles, {} ticks of {:g} ms", page.topology.body_count(),
                             page.topology.triangle_count(), page.ticks, 1e3 * page.dt);
    name_runs(specs, page);
}

ViewPage page_of_records(const Scene& scene, const std::vector<const Record*>& records, const ViewProgress& progress) {
    ViewPage page = page_of(scene);
    std::vector<RunSpec> specs;
    const std::string hash = fmt::format("{:016x}", scene.hash);
    for (const Record* record : records) {
        specs.push_back(record->spec);
        add_run(scene, record->spec, record, progress, page);
        if (record->spec.scene_hash != hash) {
            page.runs.back().note =
                fmt::format("the scene's file has changed since the record was made ({} then, {} now)",
                            record->spec.scene_hash, hash);
        }
    }
    finish_page(specs, page);
    return page;
}

ViewPage page_of_frames(const std::string& name, const std::string& what, const Topology& topology,
                        const Matrix3X& first, double dt, std::int64_t frames) {
    ViewPage page;
    const bool timed = std::isfinite(dt);
    page.scene = name;
    page.dt = timed ? dt : 1.0;
    page.ticks = frames;
    page.topology = topology;
    page.rest = first;
    page.about = fmt::format("{}: {} bodies, {} triangles, {} frames {}", what, topology.body_count(),
                             topology.triangle_count(), frames,
                             timed ? fmt::format("{:g} ms apart", 1e3 * dt)
                                   : std::string("of unknown times: the axis counts frames, not seconds"));
    page.foot = made_by();
    return page;
}

ViewPage page_of_recording(const std::filesystem::path& file) {
    RecordingReader reader(file);
    Frame first;
    if (reader.frame_count() == 0) throw InputError(file.string(), "", "at least one frame", "none");
    reader.read(0, first);
    ViewPage page = page_of_frames(file.stem().string(), "recording", reader.topology(), first.position, reader.dt(),
                                   reader.frame_count());
    RunCapture capture(page.topology, viewed_stride, false);
    play_recording(file, {.every = 1}, [&capture](const PlayedFrame& frame) { capture.see(frame); });
    ViewedRun run = capture.finish();
    run.label = "recording";
    run.methods = "depth is that of the vertices";
    page.runs.push_back(std::move(run));
    return page;
}

}  // namespace trocar::app
