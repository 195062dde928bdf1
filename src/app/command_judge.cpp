// `trocar judge`: penetration, passages and sides on the frames of another simulator, with limits for a CI server.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "app/commands.hpp"
#include "app/frame_figures.hpp"
#include "app/junit.hpp"
#include "app/run_choice.hpp"
#include "app/view_runs.hpp"
#include "app/worst_tick.hpp"
#include "export/exporter.hpp"
#include "geometry/input_error.hpp"
#include "geometry/number_text.hpp"
#include "geometry/whole_file.hpp"
#include "measure/metrics.hpp"
#include "playback/frame_fields.hpp"
#include "playback/frame_series.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;
using Units = std::map<std::string, double, std::less<>>;

const Units lengths{{"m", 1.0}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}, {"in", 0.0254}};
const Units times{{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}};

std::string names_of(const Units& units) {
    std::vector<std::string> names;
    for (const auto& [name, size] : units) names.push_back(name);
    return fmt::format("{}", fmt::join(names, ", "));
}

/// A number with its unit, such as 0.5mm, in SI.
double quantity(const std::string& text, const Units& units, const char* flag, bool positive) {
    const std::size_t letters = std::min(text.find_first_not_of("0123456789+-.eE"), text.size());
    const auto unit = units.find(text.substr(letters));
    const std::optional<double> number = number_of_text<double>(text.substr(0, letters));
    if (unit == units.end() || !number || !(positive ? *number > 0.0 : *number >= 0.0) || !std::isfinite(*number)) {
        throw InputError("command line", flag,
                         fmt::format("a number {} 0 with a unit ({})", positive ? ">" : ">=", names_of(units)),
                         fmt::format("'{}'", text));
    }
    return *number * unit->second;
}

/// Metrics that the frames alone give; all others need contacts, forces or a clock.
bool is_known_from_frames(Metric metric) {
    static const std::set<Metric> known{Metric::ticks,
                                        Metric::true_pairs,
                                        Metric::residual_penetration_median_m,
                                        Metric::residual_penetration_max_m,
                                        Metric::residual_penetration_mean_m,
                                        Metric::residual_penetration_final_m,
                                        Metric::wrong_side_max,
                                        Metric::wrong_side_last,
                                        Metric::wrong_side_vertices_max,
                                        Metric::wrong_side_vertices_last,
                                        Metric::side_undecided_max,
                                        Metric::side_undecided_ticks,
                                        Metric::passed_through,
                                        Metric::ticks_to_clear_median,
                                        Metric::ticks_to_clear_max,
                                        Metric::uncleared,
                                        Metric::re_penetrations};
    return known.contains(metric);
}

struct Limit {
    std::string figure;
    double most = 0.0;
    double value = not_known;  ///< NaN: not known, which no limit allows
    std::string unit;          ///< empty or "m"
    [[nodiscard]] bool kept() const { return value <= most; }
    [[nodiscard]] std::string text() const {
        const auto shown = [this](double number) {
            if (std::isnan(number)) return std::string("n/a");
            return unit.empty() ? fmt::format("{:g}", number) : fmt::format("{:.4g} mm", 1e3 * number);
        };
        return fmt::format("{} {}, at most {} allowed", figure, shown(value), shown(most));
    }
};

struct Judged {
    std::string name;
    const FrameSource* frames = nullptr;
    std::vector<FrameFigures> figures;
    Summary summary;
    double self_intersections = not_known;  ///< most in a frame
    std::optional<PlayedFrame> worst;       ///< the deepest frame, where one penetrates
    std::int64_t worst_tick = -1;
    std::vector<Limit> limits;
};

/// `penetration`: m, --max-penetration.
void add_limits(const JudgeOptions& options, const std::optional<double>& penetration, Judged& judged) {
    const auto add = [&](const std::optional<double>& most, const char* figure, double value, const char* unit) {
        if (most) judged.limits.push_back({figure, *most, value, unit});
    };
    const auto value = [&](Metric metric) { return value_of(judged.summary, metric); };
    add(penetration, "residual_penetration_max_m", value(Metric::residual_penetration_max_m), "m");
    add(options.max_passed_through, "passed_through", value(Metric::passed_through), "");
    add(options.max_wrong_side, "wrong_side_max", value(Metric::wrong_side_max), "");
    add(options.max_self_intersections, "self_intersections_max", judged.self_intersections, "");
}

std::string limits_junit(const Judged& judged) {
    JUnitSuite suite{.name = judged.name, .cases = {}};
    for (const Limit& limit : judged.limits) {
        const std::string at = limit.figure == "residual_penetration_max_m" && judged.worst_tick >= 0
                                   ? fmt::format(" (frame {})", judged.worst_tick)
                                   : std::string();
        suite.cases.push_back({.name = limit.figure,
                               .result = limit.kept() ? JUnitCase::Result::passed : JUnitCase::Result::failed,
                               .type = std::isnan(limit.value) ? "unknown" : "limit",
                               .message = limit.text() + at});
    }
    return junit_text("trocar judge", {suite});
}

std::string json_text(const JudgeOptions& options, const Judged& judged) {
    const Topology& topology = judged.frames->topology();
    Json document{{"frames", Json::array()},
                  {"frame_time_s", json_number(judged.frames->dt())},
                  {"start", options.start},
                  {"bodies", Json::array()},
                  {"rows", Json::array()},
                  {"summary", Json::object()},
                  {"worst_frame", judged.worst_tick < 0 ? Json(nullptr) : Json(judged.worst_tick)},
                  {"limits", Json::array()}};
    for (const std::filesystem::path& input : options.inputs) document["frames"].push_back(input.string());
    for (const BodyRange& body : topology.bodies) {
        document["bodies"].push_back({{"name", body.name},
                                      {"kind", body_kind_words[static_cast<std::size_t>(body.kind)]},
                                      {"closed", body.closed},
                                      {"vertices", body.vertices.count},
                                      {"triangles", body.triangles.count}});
    }
    for (const FrameFigures& one : judged.figures) document["rows"].push_back(frame_json(one));
    for (const auto& [metric, value] : judged.summary) {
        document["summary"][std::string(info_of(metric).name)] =
            is_known_from_frames(metric) ? json_number(value) : Json(nullptr);
    }
    document["summary"]["self_intersections_max"] = json_number(judged.self_intersections);
    for (const Limit& limit : judged.limits) {
        document["limits"].push_back({{"figure", limit.figure},
                                      {"most", limit.most},
                                      {"value", json_number(limit.value)},
                                      {"kept", limit.kept()}});
    }
    return document.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

void print_text(const JudgeOptions& options, const Judged& judged) {
    const Topology& topology = judged.frames->topology();
    const auto plain = [&](Metric metric) {
        const double value = value_of(judged.summary, metric);
        return std::isnan(value) ? std::string("n/a") : fmt::format("{:.4g}", value);
    };
    const auto mm = [&](Metric metric) {
        const double value = value_of(judged.summary, metric);
        return std::isnan(value) ? std::string("n/a") : fmt::format("{:.4g} mm", 1e3 * value);
    };
    const double dt = judged.frames->dt();
    fmt::print("frames     {}: {} of {} triangles in {} bodies, {}\n", judged.name, judged.figures.size(),
               topology.triangle_count(), topology.body_count(),
               std::isnan(dt) ? std::string("times n/a (--frame-time)") : fmt::format("{:g} ms apart", 1e3 * dt));
    constexpr std::size_t most_bodies_shown = 10;
    for (std::size_t b = 0; b < std::min(topology.bodies.size(), most_bodies_shown); ++b) {
        const BodyRange& body = topology.bodies[b];
        fmt::print("body       {}: {}, {} triangles{}\n", printable_line(body.name, 80),
                   body.closed ? "closed" : "open sheet", body.triangles.count,
                   body.kind == BodyKind::rigid ? ", stands still or rigid" : "");
    }
    if (topology.bodies.size() > most_bodies_shown) {
        fmt::print("           and {} more\n", topology.bodies.size() - most_bodies_shown);
    }
    fmt::print("pairs      {} true ones in all frames\n", plain(Metric::true_pairs));
    fmt::print("residual   penetration of a frame: median {}, largest {}{}; at the end {}\n",
               mm(Metric::residual_penetration_median_m), mm(Metric::residual_penetration_max_m),
               judged.worst_tick < 0 ? std::string() : fmt::format(" in frame {}", judged.worst_tick),
               mm(Metric::residual_penetration_final_m));
    fmt::print("wrong side at most {} samples, {} of them vertices; at the end {}; undecided at most {}\n",
               plain(Metric::wrong_side_max), plain(Metric::wrong_side_vertices_max), plain(Metric::wrong_side_last),
               plain(Metric::side_undecided_max));
    fmt::print("passed     a body through another: {} times\n", plain(Metric::passed_through));
    const double uncleared = value_of(judged.summary, Metric::uncleared);
    fmt::print("cleared    depths above 0.1 mm: {} frames at most, median {}; back {} times; left at the end: {}\n",
               plain(Metric::ticks_to_clear_max), plain(Metric::ticks_to_clear_median), plain(Metric::re_penetrations),
               std::isnan(uncleared) ? "n/a" : (uncleared > 0.0 ? "yes" : "no"));
    fmt::print("self       {} self-intersecting pairs at most{}\n",
               std::isnan(judged.self_intersections) ? "n/a" : fmt::format("{:g}", judged.self_intersections),
               options.self ? "" : " (--self)");
    fmt::print("contacts   n/a, and forces: frames have neither\n");
    for (const Limit& limit : judged.limits) {
        fmt::print("limit      {}: {}\n", limit.kept() ? "kept" : "BROKEN", limit.text());
    }
}

/// Why figures of open sheets are not known; empty where they are.
std::string start_note(const JudgeOptions& options, const Topology& topology) {
    const bool open =
        std::any_of(topology.bodies.begin(), topology.bodies.end(), [](const BodyRange& body) { return !body.closed; });
    if (frame_start(options.start) == FrameStart::clean || !open || topology.body_pairs.empty()) return {};
    return "sides of open sheets are n/a, and penetration is that into closed bodies alone, unless the frames start "
           "clean "
           "(--start clean)";
}

/// Reads and judges all frames. Fills page and worst frame if they are wanted.
void judge_frames(const JudgeOptions& options, FrameSource& frames, ViewPage* page,
                  const std::function<bool(std::int64_t)>& goes_on, Judged& judged) {
    const Topology& topology = frames.topology();
    const std::string place = options.inputs.front().string();
    if (topology.body_pairs.empty() && !options.self) {
        throw InputError(place, "", "two bodies that can meet (--bodies), or --self",
                         fmt::format("{} bodies that are not tested against each other", topology.body_count()));
    }
    std::optional<FrameJudge> judge;
    std::optional<FrameFields> fields;
    std::optional<RunCapture> capture;
    PlayedFrame played;
    std::vector<StepRow> rows;
    double deepest = 0.0;
    Frame frame;
    while (goes_on(static_cast<std::int64_t>(rows.size())) && frames.next(frame)) {
        if (!frame.all_finite()) {
            throw InputError(place, fmt::format("frame {}", frame.tick), "finite positions", "one that is not");
        }
        if (!judge) {
            judge.emplace(topology, frame, frame_start(options.start), options.self, place);
            if (page != nullptr) {
                *page =
                    page_of_frames(judged.name, "frames", topology, frame.position, frames.dt(), frames.frame_count());
                fields.emplace(topology, frame, edges_at_rest(topology, frame), &judge->depth_truth());
                constexpr std::int64_t frames_shown = 100;
                capture.emplace(page->topology, 1 + frames.frame_count() / frames_shown, true);
            }
        }
        const FrameFigures& figures = judged.figures.emplace_back(judge->judge(frame));
        rows.push_back(figures.row);
        if (figures.self_intersections >= 0) {
            judged.self_intersections =
                std::fmax(judged.self_intersections, static_cast<double>(figures.self_intersections));
        }
        const bool is_worst = figures.row.residual_penetration > deepest;
        if (is_worst) {
            deepest = figures.row.residual_penetration;
            judged.worst_tick = frame.tick;
        }
        if (!fields) continue;
        fields->fill(frame, played);
        played.row = figures.row;
        played.row.contacts_offered = -1;  // not known
        capture->see(played);
        if (is_worst) judged.worst = played;
    }
    if (rows.empty()) throw InputError(place, "", "at least one frame", "none");
    judged.summary = summarize(rows);
    // A sum that leaves out frames of which nothing is known would be too small.
    if (rows.back().passed_through < 0) judged.summary[Metric::passed_through] = not_known;
    if (!capture) return;
    ViewedRun run = capture->finish();
    run.label = "frames";
    run.methods = "of another simulator; forces are not known";
    page->runs.push_back(std::move(run));
}

}  // namespace

int judge(const CommonOptions& common, const JudgeOptions& options) {
    SeriesChoice choice;
    choice.bodies = options.bodies == "components" ? BodyRule::components
                    : options.bodies == "objects"  ? BodyRule::objects
                                                   : BodyRule::given;
    if (!options.unit.empty()) choice.unit = lengths.at(options.unit);
    if (!options.frame_time.empty()) choice.frame_time = quantity(options.frame_time, times, "--frame-time", true);
    std::optional<double> penetration;
    if (!options.max_penetration.empty()) {
        penetration = quantity(options.max_penetration, lengths, "--max-penetration", false);
    }
    Judged judged;
    const std::unique_ptr<FrameSource> frames = frame_series(options.inputs, choice);
    judged.frames = frames.get();
    judged.name = (options.inputs.front() / "").parent_path().stem().string();
    std::optional<UnfinishedFolder> folder;
    if (options.output) folder.emplace(*options.output);
    ViewPage page;
    bool stopped = false;
    {
        SignalsHeld signals;
        Progress progress("frame", frames->frame_count());
        judge_frames(options, *frames, folder ? &page : nullptr, until_interrupted(progress, signals, stopped), judged);
    }
    if (stopped) {
        fmt::print(stderr, "trocar: interrupted, nothing is written\n");
        return interrupted;
    }
    add_limits(options, penetration, judged);
    const std::string document = json_text(options, judged);
    if (folder) {
        write_whole(folder->path() / "frames.json", document);
        write_whole(folder->path() / "replay.html", view_html(page, ""));
        if (judged.worst) {
            write_whole(folder->path() / "worst_frame.svg",
                        draw(cut_frame(frames->topology(), *judged.worst, judged.name)));
        }
        folder->keep();
    }
    if (options.junit) write_whole(*options.junit, limits_junit(judged));
    if (common.json) {
        fmt::print("{}", document);
    } else {
        print_text(options, judged);
    }
    if (const std::string note = start_note(options, frames->topology()); !note.empty()) {
        fmt::print(stderr, "trocar: {}: {}\n", judged.name, note);
    }
    const bool kept =
        std::all_of(judged.limits.begin(), judged.limits.end(), [](const Limit& limit) { return limit.kept(); });
    return kept ? done : comparison_failed;
}

}  // namespace trocar::app
