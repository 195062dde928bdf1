// `trocar replay`: one or all detectors on the frames of a recording, the same bits for each, held against the exact
// oracle, and so are the contacts that the recording carries.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.hpp"
#include "app/detector_answers.hpp"
#include "app/frame_figures.hpp"
#include "app/json_values.hpp"
#include "app/long_steps.hpp"
#include "geometry/input_error.hpp"
#include "scene/recording.hpp"
#include "study/contact_baseline.hpp"

namespace trocar::app {
namespace {

using Json = nlohmann::ordered_json;

/// Pairs that a recording reports as apart (depth below 0), by frame: they are found if they truly meet.
using PairsApart = std::vector<std::vector<TrianglePair>>;

/// What the recording carries, as the answer of somebody who was not timed.
DetectorAnswer as_answer(const std::vector<RecordedTick>& ticks, std::int64_t frames, PairsApart& apart) {
    DetectorAnswer answer{.name = recorded_answer};
    answer.outcome.message = fmt::format("carried by the recording, of {} of {} frames", ticks.size(), frames);
    FrameAnswer unreported;
    unreported.outcome = {OutcomeKind::unsupported, "the recording reports no contacts of this frame"};
    answer.frames.assign(static_cast<std::size_t>(frames), unreported);
    apart.resize(answer.frames.size());
    for (const RecordedTick& tick : ticks) {
        const auto number = static_cast<std::size_t>(tick.tick);
        answer.frames[number].outcome = {};
        for (const RecordedContact& contact : tick.contacts) {
            (contact.depth < 0.0 ? apart[number] : answer.frames[number].pairs).push_back({contact.a, contact.b});
        }
        std::sort(apart[number].begin(), apart[number].end());
    }
    return answer;
}

/// Judges all answers, with the oracle where there are `truths` to be filled; likewise the frames themselves, with
/// `figures`. Reports the steps that are longer than a feature.
LongSteps judge_all(RecordingReader& recording, const PairsApart& apart, std::vector<DetectorAnswer>& answers,
                    Truths* truths, FrameStart start, const std::string& place, std::vector<FrameFigures>* figures) {
    const Topology& topology = recording.topology();
    const auto number_in_file = [&recording](Index triangle) { return recording.file_triangle(triangle); };
    LongStepWatch watch(topology);
    std::optional<FrameJudge> frame_judge;
    Frame frame;
    for (std::int64_t tick = 0; tick < recording.frame_count(); ++tick) {
        const auto number = static_cast<std::size_t>(tick);
        recording.read(tick, frame);
        watch.observe(frame);
        const bool known = frame.all_finite();
        if (figures != nullptr) {
            if (!frame_judge && known) frame_judge.emplace(topology, frame, start, false, place);
            FrameFigures unknown;
            unknown.row.tick = tick;
            unknown.row.time = frame.time;
            figures->push_back(frame_judge ? frame_judge->judge(frame) : unknown);
        }
        const TickTruth truth = truths != nullptr && known ? truth_of(topology, frame) : TickTruth{};
        for (DetectorAnswer& answer : answers) {
            if (answer.frames.empty()) continue;
            FrameAnswer& said = answer.frames[number];
            if (answer.name == recorded_answer) {
                std::set_intersection(apart[number].begin(), apart[number].end(), truth.pairs.begin(),
                                      truth.pairs.end(), std::back_inserter(said.pairs));
            }
            judge(topology, frame, truths != nullptr ? &truth : nullptr, number_in_file, said);
        }
        if (truths != nullptr) truths->push_back(known ? std::optional(truth) : std::nullopt);
    }
    return watch.steps();
}

/// "pair" is null where the detector names bodies only.
Json swept_json(const std::vector<SweptContact>& swept) {
    Json list = Json::array();
    for (const SweptContact& contact : swept) {
        const Json kind = contact.kind == SweptKind::edge_edge     ? Json("edge_edge")
                          : contact.kind == SweptKind::vertex_face ? Json("vertex_face")
                                                                   : Json(nullptr);
        list.push_back({{"pair", contact.a < 0 ? Json(nullptr) : Json{contact.a, contact.b}},
                        {"bodies", {contact.body_a, contact.body_b}},
                        {"time", contact.time},
                        {"kind", kind}});
    }
    return list;
}

Json replay_json(const RecordingReader& recording, const std::vector<DetectorAnswer>& answers, const Truths* truths,
                 const std::vector<FrameFigures>& figures, const LongSteps& steps) {
    Json document{{"hash", fmt::format("{:016x}", recording.hash())}, {"detectors", Json::array()}};
    for (const DetectorAnswer& answer : answers) {
        Json frames = Json::array();
        for (const FrameAnswer& frame : answer.frames) {
            Json one{{"tick", frames.size()}, {"outcome", name_of(frame.outcome.kind)}, {"truncated", frame.truncated}};
            one.update(answer_json(frame));
            // Only where a detector reports contacts that begin between frames.
            if (!frame.swept.empty()) one["swept"] = swept_json(frame.swept);
            frames.push_back(std::move(one));
        }
        document["detectors"].push_back({{"name", answer.name},
                                         {"outcome", name_of(answer.outcome.kind)},
                                         {"message", answer.outcome.message},
                                         {"frames", std::move(frames)}});
    }
    document["truth"] = nullptr;
    if (truths != nullptr) {
        Json& counts = document["truth"] = Json::array();
        for (const std::optional<TickTruth>& exact : *truths) {
            counts.push_back(exact ? Json(exact->pairs.size()) : Json(nullptr));
        }
        document["figures"] = Json::array();
        for (const FrameFigures& one : figures) document["figures"].push_back(frame_json(one));
    }
    if (steps.frames > 0) {
        document["long_steps"] = {{"frames", steps.frames},
                                  {"tick", steps.tick},
                                  {"body", recording.topology().bodies[static_cast<std::size_t>(steps.body)].name},
                                  {"step_m", json_number(steps.step)},
                                  {"edge_m", json_number(steps.edge)}};
    }
    return document;
}

}  // namespace

int replay(const CommonOptions& common, const ReplayOptions& options) {
    const bool all = options.detector == "all";
    const bool only_recorded = options.detector == recorded_answer;
    const std::vector<MethodSpec> methods =
        only_recorded ? std::vector<MethodSpec>() : detectors_named(options.detector);
    check_time_limit(options.time_limit_s);
    RecordingReader recording(options.recording);
    if (only_recorded && !recording.has_contacts()) {
        throw InputError(options.recording.string(), "", "a recording that carries contacts, for --detector recorded",
                         "none");
    }
    const std::vector<RecordedTick> recorded = recording.contacts();  // malformed ones end here
    const AskedFrames frames{recording.topology(), recording.frame_count(),
                             [&recording](std::int64_t tick, Frame& frame) { recording.read(tick, frame); }};
    std::vector<DetectorAnswer> answers;
    answers.reserve(methods.size() + 1);
    for (const MethodSpec& method : methods) answers.push_back(ask(method, frames, options.time_limit_s));
    PairsApart apart;
    if (recording.has_contacts() && (all || only_recorded)) {
        answers.push_back(as_answer(recorded, recording.frame_count(), apart));
    }
    Truths exact;
    Truths* const truth = all || options.truth ? &exact : nullptr;
    std::vector<FrameFigures> figures;
    const LongSteps steps = judge_all(recording, apart, answers, truth, frame_start(options.start),
                                      options.recording.string(), truth != nullptr && common.json ? &figures : nullptr);
    if (const std::string note = long_step_note(steps, recording.topology()); !note.empty()) {
        fmt::print(stderr, "trocar: {}: {}\n", options.recording.string(), note);
    }
    const int status = conclude(all, answers);
    if (common.json) {
        print_json_line(replay_json(recording, answers, truth, figures, steps));
    } else {
        fmt::print("{} frames of {} triangles in {} bodies, hash {:016x}\n", recording.frame_count(),
                   recording.topology().triangle_count(), recording.topology().body_count(), recording.hash());
        print_answers(answers, truth);
    }
    return status;
}

}  // namespace trocar::app
