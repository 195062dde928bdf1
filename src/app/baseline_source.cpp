#include "app/baseline_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <tuple>

#include "app/isolated_call.hpp"
#include "contact/derive.hpp"
#include "geometry/fnv_hash.hpp"
#include "geometry/input_error.hpp"

namespace trocar::app {
namespace {

/// All frames through one detector; the answer is judged on every `every`-th tick.
BaselineAnswer answer_of(const MethodSpec& method, const BaselineSource& source, std::int64_t every) {
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

}  // namespace

BaselineSource::BaselineSource(const std::filesystem::path& file, const std::optional<std::filesystem::path>& data)
    : file_(file) {
    if (file.extension() == ".json") {
        scene_ = std::make_unique<Scene>(read_scene(file, data));
        name_ = scene_->name;
        hash_ = fmt::format("{:016x}", scene_->hash);
        ticks_ = scene_->ticks;
    } else {
        recording_ = std::make_unique<RecordingReader>(file);
        name_ = file.stem().string();
        hash_ = fmt::format("{:016x}", recording_->hash());
        ticks_ = recording_->frame_count();
        if (recording_->has_contacts()) recorded_ = recording_->contacts();
    }
    if (ticks_ < 1) throw InputError(file.string(), "", "at least one frame", "none");
}

std::unique_ptr<FrameSource> BaselineSource::frames() const {
    return scene_ ? scene_frames(*scene_, ticks_) : recorded_frames(file_);
}

ContactBaseline BaselineSource::empty_baseline(std::int64_t every) const {
    ContactBaseline baseline{.source = name_, .source_hash = hash_, .frames_hash = {}, .ticks = ticks_};
    baseline.every = every;
    FnvHash hash;
    const std::unique_ptr<FrameSource> source = frames();
    Frame frame;
    while (source->next(frame)) hash.add(frame.hash());
    if (!source->outcome().ok()) {
        throw InputError(file_.string(), "", fmt::format("{} frames that can be made", ticks_),
                         source->outcome().message);
    }
    baseline.frames_hash = hash.text();
    return baseline;
}

NamedDifference BaselineSource::named(const ContactDifference& difference) const {
    const Topology& topology = scene_ ? scene_->topology : recording_->topology();
    NamedDifference named{.difference = difference, .bodies = {"?", "?"}, .triangles = {}};
    const std::array<Index, 2> triangles{difference.a, difference.b};
    for (std::size_t i = 0; i < 2; ++i) {
        named.triangles[i] = triangles[i];
        if (triangles[i] >= topology.triangle_count()) continue;  // a stored file that somebody has edited
        const Index body = topology.body_of_triangle[static_cast<std::size_t>(triangles[i])];
        named.bodies[i] = topology.bodies[static_cast<std::size_t>(body)].name;
        if (recording_) named.triangles[i] = recording_->file_triangle(triangles[i]);
    }
    return named;
}

BaselineAnswer ask_detector(const MethodSpec& method, const BaselineSource& source, const ContactBaseline& stream,
                            double time_limit_s) {
    const std::string name = method.text();
    const IsolatedResult result = call_isolated(
        [&] {
            ContactBaseline alone = stream;
            try {
                alone.detectors[name] = answer_of(method, source, stream.every);
            } catch (const std::exception& error) {
                alone.detectors[name] = {.outcome = std::string("threw: ") + error.what(), .ticks = {}};
            }
            return to_json(alone);
        },
        time_limit_s);
    if (!result.outcome.ok()) return {.outcome = std::string(name_of(result.outcome.kind)), .ticks = {}};
    return contact_baseline_from_json(result.bytes, name).detectors.at(name);
}

BaselineAnswer recorded_as_answer(const BaselineSource& source, std::int64_t every) {
    BaselineAnswer answer;
    for (const RecordedTick& reported : *source.recorded()) {
        if (reported.tick % every != 0 || reported.contacts.empty()) continue;
        BaselineTick& tick = answer.ticks.emplace_back();
        tick.tick = reported.tick;
        for (const RecordedContact& contact : reported.contacts) {
            Contact& kept = tick.contacts.emplace_back();
            kept.a = contact.a;
            kept.b = contact.b;
            kept.point = contact.point;
            kept.normal = contact.normal;
            kept.depth = contact.depth;
        }
        std::stable_sort(tick.contacts.begin(), tick.contacts.end(), [](const Contact& one, const Contact& other) {
            return std::tie(one.a, one.b) < std::tie(other.a, other.b);
        });
    }
    round_like_stored(answer);
    return answer;
}

std::map<std::string, TruthComparison> hold_against_truth(const ContactBaseline& answers,
                                                          const BaselineSource& source) {
    struct Judged {
        const BaselineAnswer* answer;
        std::set<std::int64_t> reported;  ///< of what a recording carries
        std::size_t next = 0;             ///< in answer->ticks
    };
    std::map<std::string, Judged> open;
    for (const auto& [name, answer] : answers.detectors) {
        const std::set<std::string_view> with_pairs{"ok", "truncated", name_of(OutcomeKind::not_finite)};
        if (!with_pairs.contains(answer.outcome)) continue;
        Judged& one = open[name];
        one.answer = &answer;
        if (name != recorded_answer) continue;
        for (const RecordedTick& tick : *source.recorded()) one.reported.insert(tick.tick);
    }
    std::map<std::string, TruthComparison> judged;
    const std::unique_ptr<FrameSource> frames = source.frames();
    Frame frame;
    for (std::int64_t tick = 0; !open.empty() && frames->next(frame); ++tick) {
        std::optional<TickTruth> truth;
        for (auto& [name, one] : open) {
            if (tick % answers.every_of(name) != 0 || (name == recorded_answer && !one.reported.contains(tick)))
                continue;
            const std::vector<BaselineTick>& ticks = one.answer->ticks;
            while (one.next < ticks.size() && ticks[one.next].tick < tick) ++one.next;
            if (!frame.all_finite()) continue;
            if (!truth) truth = truth_of(frames->topology(), frame);
            const bool has_contacts = one.next < ticks.size() && ticks[one.next].tick == tick;
            judged[name].add(frames->topology(), frame, *truth,
                             has_contacts ? ticks[one.next].contacts : std::vector<Contact>());
        }
    }
    return judged;
}

}  // namespace trocar::app
