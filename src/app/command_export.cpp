// `trocar export`: the frames of a scene's run or of a recording as files of other programs.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "app/commands.hpp"
#include "app/json_values.hpp"
#include "export/exporter.hpp"
#include "geometry/input_error.hpp"
#include "playback/playback.hpp"
#include "scene/recording.hpp"
#include "scene/scene.hpp"
#include "simulate/step_check.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

ExportFormat format_of(const std::string& name) {
    if (name == "paraview") return ExportFormat::paraview;
    return name == "gltf" ? ExportFormat::gltf : ExportFormat::obj;
}

/// The frames to be written of `ticks`; two more come where the deepest and the last one are none of these.
PlaybackChoice choice_of(const ExportOptions& options, std::int64_t ticks) {
    constexpr std::int64_t about = 60;
    PlaybackChoice choice{.every = options.every.value_or(std::max<std::int64_t>(1, (ticks + about - 1) / about)),
                          .ticks = options.more_ticks,
                          .deepest = true,
                          .last = true};
    if (choice.every < 1) throw InputError("--every", "", "an integer >= 1", fmt::format("{}", choice.every));
    for (const std::int64_t tick : choice.ticks) {
        if (tick >= 0 && tick < ticks) continue;
        throw InputError("--tick", "", fmt::format("a tick from 0 to {}", ticks - 1), fmt::format("{}", tick));
    }
    std::set<std::int64_t> wanted(choice.ticks.begin(), choice.ticks.end());
    for (std::int64_t tick = 0; tick < ticks; tick += choice.every) wanted.insert(tick);
    const auto count = static_cast<std::int64_t>(wanted.size());
    const std::int64_t most = most_frames(format_of(options.to));
    constexpr std::int64_t deepest_and_last = 2;
    if (most > 0 && std::min(ticks, count + deepest_and_last) > most) {
        const std::int64_t room = most - deepest_and_last;
        throw InputError(
            "--every", "",
            fmt::format("at most {} frames for {}, as with --every {}", most, options.to, (ticks + room - 1) / room),
            fmt::format("{} and the deepest and the last", count));
    }
    return choice;
}

/// What was written, for a scene or a recording.
struct Written {
    std::string name;
    std::set<std::int64_t> ticks;
    Record record;  ///< of a scene's run
    bool is_run = false;
    bool stopped = false;
};

Written export_scene(const CommonOptions& common, const ExportOptions& options, const std::filesystem::path& folder) {
    RunSpec spec = spec_of(options.methods);
    check_ticks(options.ticks);
    const Scene scene = read_scene(options.source, common.data);
    for (const std::string& note : scene.notes) {
        fmt::print(stderr, "trocar: {}: {}\n", options.source.string(), note);
    }
    if (const std::string why = why_unstable(scene, check_step(scene, spec.stepper)); !why.empty()) {
        throw InputError(fmt::format("{}: {}", options.source.string(), why));
    }
    set_scene(scene, options.ticks, spec);
    const PlaybackChoice choice = choice_of(options, spec.ticks);
    const auto exporter = make_exporter(format_of(options.to), scene.topology, scene.name, folder);
    Written written{.name = scene.name, .ticks = {}, .record = {}, .is_run = true};
    SignalsHeld signals;
    Progress progress("tick", spec.ticks);
    RunLimits limits;
    limits.progress = until_interrupted(progress, signals, written.stopped);
    written.record = play(scene, spec, limits, choice, [&](const PlayedFrame& frame) {
        exporter->add(frame);
        written.ticks.insert(frame.tick);
    });
    if (!written.ticks.empty()) exporter->finish();
    return written;
}

Written export_recording(const ExportOptions& options, const std::filesystem::path& folder) {
    const RecordingReader reader(options.source);
    check_ticks(options.ticks);
    const std::int64_t ticks = std::min(reader.frame_count(), options.ticks.value_or(reader.frame_count()));
    if (ticks == 0) throw InputError(options.source.string(), "", "at least one frame", "none");
    const PlaybackChoice choice = choice_of(options, ticks);
    Written written{.name = options.source.stem().string(), .ticks = {}, .record = {}};
    const auto exporter = make_exporter(format_of(options.to), reader.topology(), written.name, folder);
    SignalsHeld signals;
    Progress progress("tick", ticks);
    const auto goes_on = until_interrupted(progress, signals, written.stopped);
    play_recording(
        options.source, choice,
        [&](const PlayedFrame& frame) {
            exporter->add(frame);
            written.ticks.insert(frame.tick);
        },
        [&](std::int64_t done) { return done < ticks && goes_on(done); });
    exporter->finish();
    return written;
}

std::vector<std::string> files_in(const std::filesystem::path& folder) {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        files.push_back(entry.path().filename().string());
    }
    std::sort(files.begin(), files.end());
    return files;
}

}  // namespace

int export_frames(const CommonOptions& common, const ExportOptions& options) {
    UnfinishedFolder folder(options.output);
    const Written written = options.source.extension() == ".json" ? export_scene(common, options, folder.path())
                                                                  : export_recording(options, folder.path());
    if (written.stopped) {
        fmt::print(stderr, "trocar: interrupted, nothing is written\n");
        return interrupted;
    }
    const Record& record = written.record;
    if (!written.ticks.empty()) folder.keep();
    const std::vector<std::string> files =
        written.ticks.empty() ? std::vector<std::string>() : files_in(options.output);
    if (common.json) {
        Json document{{"source", options.source.string()},
                      {"to", options.to},
                      {"output", options.output.string()},
                      {"ticks", written.ticks},
                      {"files", files},
                      {"outcome", name_of(record.outcome.kind)},
                      {"message", record.outcome.message}};
        document["detector"] = written.is_run ? Json(record.spec.detector) : Json(nullptr);
        document["response"] = written.is_run ? Json(record.spec.response) : Json(nullptr);
        document["state_hash"] = written.is_run ? Json(record.state_hash) : Json(nullptr);
        print_json_line(document);
    } else {
        fmt::print("{}: {} ticks as {} files in {}\n", written.name, written.ticks.size(), files.size(),
                   options.output.string());
        if (written.is_run) {
            fmt::print("methods    {} + {}, {} contacts\nstate      {} (hash of the last frame, as `run` reports it)\n",
                       record.spec.detector, record.spec.response, record.spec.contacts, record.state_hash);
        }
    }
    if (record.outcome.ok()) return done;
    fmt::print(stderr, "trocar: {} + {} ended as {}: {}\n", record.spec.detector, record.spec.response,
               name_of(record.outcome.kind), record.outcome.message);
    return method_failed;
}

}  // namespace trocar::app
