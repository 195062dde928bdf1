// `trocar baseline`: keeps the canonical contacts of detectors on scenes or recordings, or holds fresh ones against
// those kept. Only `write` ever changes a stored file, and it tells what it changes.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/commands.hpp"
#include "app/isolated_call.hpp"
#include "contact/derive.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "method/registry.hpp"
#include "scene/recording.hpp"
#include "scene/scene.hpp"
#include "simulate/frame_source.hpp"
#include "study/contact_baseline.hpp"
#include "study/runner.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

/// A scene or a recording as frames that can be had again and again.
class Source {
public:
    Source(const std::filesystem::path& file, const CommonOptions& common) : file_(file) {
        if (file.extension() == ".json") {
            scene_ = std::make_unique<Scene>(read_scene(file, common.data));
            name_ = scene_->name;
            hash_ = fmt::format("{:016x}", scene_->hash);
            ticks_ = scene_->ticks;
        } else {
            const RecordingReader reader(file);
            name_ = file.stem().string();
            hash_ = fmt::format("{:016x}", reader.hash());
            ticks_ = reader.frame_count();
        }
        if (ticks_ < 1) throw InputError(file.string(), "", "at least one frame", "none");
    }
    [[nodiscard]] std::unique_ptr<FrameSource> frames() const {
        return scene_ ? scene_frames(*scene_, ticks_) : recorded_frames(file_);
    }
    [[nodiscard]] ContactBaseline empty_baseline(std::int64_t every) const {
        ContactBaseline baseline{.source = name_, .source_hash = hash_, .frames_hash = {}, .ticks = ticks_};
        baseline.every = every;
        std::uint64_t hash = 14695981039346656037ULL;
        const std::unique_ptr<FrameSource> source = frames();
        Frame frame;
        while (source->next(frame)) hash = (hash ^ frame.hash()) * 1099511628211ULL;
        baseline.frames_hash = fmt::format("{:016x}", hash);
        return baseline;
    }
    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] std::int64_t ticks() const { return ticks_; }

private:
    std::filesystem::path file_;
    std::unique_ptr<Scene> scene_;
    std::string name_;
    std::string hash_;
    std::int64_t ticks_ = 0;
};

/// All frames through one detector; the answer is judged on every `every`-th tick.
BaselineAnswer ask(const MethodSpec& method, const Source& source, std::int64_t every) {
    BaselineAnswer answer;
    const std::unique_ptr<FrameSource> frames = source.frames();
    const std::unique_ptr<Detector> detector = make_detector(method.name, method.parameters);
    ContactSet contacts;
    contacts.native_wanted = false;
    Frame frame;
    for (std::int64_t tick = 0; frames->next(frame); ++tick) {
        if (tick == 0) detector->prepare(frames->topology(), frame);
        contacts.clear();
        detector->update(frame, 0.0);
        if (tick % every != 0) continue;
        detector->detect(frame, contacts);
        if (!contacts.outcome.ok() && answer.outcome == "ok") answer.outcome = name_of(contacts.outcome.kind);
        if (contacts.truncated && answer.outcome == "ok") answer.outcome = "truncated";
        if (contacts.pairs.empty()) continue;
        derive(frames->topology(), frame, contacts);
        answer.ticks.push_back({.tick = tick, .contacts = contacts.contacts});
    }
    round_like_stored(answer);
    return answer;
}

/// The same in a process of its own, since a library may crash on what it is given.
BaselineAnswer ask_isolated(const MethodSpec& method, const Source& source, const ContactBaseline& stream,
                            double time_limit_s) {
    const std::string name = method.text();
    const IsolatedResult result = call_isolated(
        [&] {
            ContactBaseline alone = stream;
            try {
                alone.detectors[name] = ask(method, source, stream.every);
            } catch (const std::exception& error) {
                alone.detectors[name] = {.outcome = std::string("threw: ") + error.what(), .ticks = {}};
            }
            return to_json(alone);
        },
        time_limit_s);
    if (result.kind == IsolatedResult::Kind::crashed) return {.outcome = "crashed", .ticks = {}};
    if (result.kind == IsolatedResult::Kind::timed_out) return {.outcome = "timed_out", .ticks = {}};
    return contact_baseline_from_json(result.bytes, name).detectors.at(name);
}

std::vector<MethodSpec> methods_of(const BaselineOptions& options) {
    std::vector<MethodSpec> methods;
    for (const std::string& text : options.detectors) {
        if (text == "all") {
            for (const DetectorEntry& entry : registry().detectors()) {
                if (!entry.control) methods.push_back({.name = entry.name});
            }
            continue;
        }
        methods.push_back(parse_method(text));
        const MethodSpec& method = methods.back();
        static_cast<void>(make_detector(method.name, method.parameters));  // a wrong name or value ends here
    }
    return methods;
}

/// One line of the answer.
struct Finding {
    std::string detector;
    std::string state;  ///< same, changed, missing, extra, stale, new, removed
    std::string told;
};

std::string told(const AnswerDifference& difference) {
    std::string text = fmt::format(
        "{} contacts compared, {} missing, {} extra, {} of another kind; worst depth {:.3g} m, point {:.3g} m, normal "
        "{:.3g} rad",
        difference.compared, difference.missing, difference.extra, difference.other_kind, difference.worst_depth,
        difference.worst_point, difference.worst_angle);
    if (!difference.outcome.empty()) text += "; outcome " + difference.outcome;
    if (!difference.example.empty()) text += "; " + difference.example;
    return text;
}

std::vector<Finding> compare(const std::optional<ContactBaseline>& before, const ContactBaseline& after, bool all,
                             const BaselineTolerance& tolerance) {
    std::vector<Finding> findings;
    const bool comparable = before && before->source_hash == after.source_hash &&
                            before->frames_hash == after.frames_hash && before->every == after.every;
    for (const auto& [name, answer] : after.detectors) {
        if (!before || !before->detectors.contains(name)) {
            findings.push_back({name, "missing", "no contacts of this detector are kept"});
        } else if (!comparable) {
            findings.push_back({name, "stale",
                                before->source_hash != after.source_hash
                                    ? "the scene or recording is another than the one whose contacts are kept"
                                    : "the frames are others than those whose contacts are kept"});
        } else {
            const AnswerDifference difference = compare_answers(before->detectors.at(name), answer, tolerance);
            findings.push_back({name, difference.within(tolerance) ? "same" : "changed", told(difference)});
        }
    }
    if (!before || !all) return findings;
    for (const auto& [name, answer] : before->detectors) {
        if (after.detectors.contains(name)) continue;
        findings.push_back(
            {name, "extra", "contacts are kept, but this detector was not asked or is not in this build"});
    }
    return findings;
}

}  // namespace

int baseline(const CommonOptions& common, const BaselineOptions& options) {
    if (options.every && *options.every < 1) {
        throw InputError("command line", "--every", "an integer >= 1", fmt::format("{}", *options.every));
    }
    if (!(options.tolerance >= 0.0)) {
        throw InputError("command line", "--tolerance", "metres >= 0", fmt::format("{}", options.tolerance));
    }
    const bool write = options.what == "write";
    const bool all = std::find(options.detectors.begin(), options.detectors.end(), "all") != options.detectors.end();
    const std::vector<MethodSpec> methods = methods_of(options);
    const BaselineTolerance tolerance{.length = options.tolerance};
    constexpr std::int64_t samples = 20;
    Json answers = Json::array();
    bool all_same = true;
    for (const std::filesystem::path& file : options.sources) {
        const Source source(file, common);
        const std::filesystem::path folder = options.folder.value_or(file.parent_path() / "baseline");
        const std::filesystem::path kept = folder / (source.name() + ".json");
        std::optional<ContactBaseline> before;
        if (std::filesystem::exists(kept)) before = read_contact_baseline(kept);
        const std::int64_t every =
            options.every.value_or(before ? before->every : std::max<std::int64_t>(1, source.ticks() / samples));
        ContactBaseline after = source.empty_baseline(every);
        const ContactBaseline stream = after;
        for (const MethodSpec& method : methods) {
            after.detectors[method.text()] = ask_isolated(method, source, stream, options.time_limit_s);
        }
        const std::vector<Finding> findings = compare(before, after, all, tolerance);
        if (write) {
            std::filesystem::create_directories(folder);
            // Detectors that were not asked keep what was kept of them on these frames.
            if (before && !all && before->frames_hash == after.frames_hash && before->every == after.every) {
                after.detectors.merge(std::map(before->detectors));
            }
            write_whole(kept, to_json(after));
        }
        Json list = Json::array();
        for (const Finding& finding : findings) {
            all_same = all_same && finding.state == "same";
            list.push_back({{"detector", finding.detector}, {"state", finding.state}, {"message", finding.told}});
            if (!common.json) {
                fmt::print("{:<16} {:<32} {:<8} {}\n", source.name(), finding.detector, finding.state, finding.told);
            }
        }
        answers.push_back({{"source", source.name()}, {"file", kept.string()}, {"detectors", list}});
        if (write && !common.json) fmt::print("{:<16} written: {}\n", source.name(), kept.string());
    }
    if (common.json) fmt::print("{}\n", Json{{"written", write}, {"sources", answers}}.dump());
    return write || all_same ? done : comparison_failed;
}

}  // namespace trocar::app
