// `trocar replay`: one or all detectors on the frames of a recording, the same bits for each, held against the exact
// oracle, and so are the contacts that the recording carries.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
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

/// Only where a detector reports contacts that begin between frames. "pair" is null where it names bodies only.
void print_swept(const std::vector<SweptContact>& swept, fmt::memory_buffer& text) {
    const auto out = std::back_inserter(text);
    fmt::format_to(out, ",\"swept\":[");
    for (std::size_t k = 0; k < swept.size(); ++k) {
        const SweptContact& contact = swept[k];
        const char* const kind = contact.kind == SweptKind::edge_edge     ? "\"edge_edge\""
                                 : contact.kind == SweptKind::vertex_face ? "\"vertex_face\""
                                                                          : "null";
        const std::string pair = contact.a < 0 ? "null" : fmt::format("[{},{}]", contact.a, contact.b);
        fmt::format_to(out, "{}{{\"pair\":{},\"bodies\":[{},{}],\"time\":{},\"kind\":{}}}", k > 0 ? "," : "", pair,
                       contact.body_a, contact.body_b, json_number(contact.time).dump(), kind);
    }
    fmt::format_to(out, "]");
}

void print_json(const RecordingReader& recording, const std::vector<DetectorAnswer>& answers, const Truths* truth,
                const std::vector<FrameFigures>& figures, const LongSteps& steps) {
    fmt::memory_buffer text;
    const auto out = std::back_inserter(text);
    fmt::format_to(out, "{{\"hash\":\"{:016x}\",\"detectors\":[", recording.hash());
    for (std::size_t d = 0; d < answers.size(); ++d) {
        const DetectorAnswer& answer = answers[d];
        fmt::format_to(out, "{}{{\"name\":{},\"outcome\":\"{}\",\"message\":{},\"frames\":[", d > 0 ? "," : "",
                       quoted_json(answer.name), name_of(answer.outcome.kind), quoted_json(answer.outcome.message));
        for (std::size_t tick = 0; tick < answer.frames.size(); ++tick) {
            const FrameAnswer& frame = answer.frames[tick];
            fmt::format_to(out, "{}{{\"tick\":{},\"outcome\":\"{}\",\"truncated\":{},", tick > 0 ? "," : "", tick,
                           name_of(frame.outcome.kind), frame.truncated);
            append_json(frame, text);
            if (!frame.swept.empty()) print_swept(frame.swept, text);
            fmt::format_to(out, "}}");
        }
        fmt::format_to(out, "]}}");
    }
    fmt::format_to(out, "],\"truth\":");
    if (truth == nullptr) {
        fmt::format_to(out, "null");
    } else {
        fmt::format_to(out, "[");
        for (std::size_t tick = 0; tick < truth->size(); ++tick) {
            const std::optional<TickTruth>& exact = (*truth)[tick];
            fmt::format_to(out, "{}{}", tick > 0 ? "," : "",
                           exact ? std::to_string(exact->pairs.size()) : std::string("null"));
        }
        fmt::format_to(out, "]");
    }
    if (truth != nullptr) {
        nlohmann::ordered_json rows = nlohmann::ordered_json::array();
        for (const FrameFigures& one : figures) rows.push_back(frame_json(one));
        fmt::format_to(out, ",\"figures\":{}", rows.dump());
    }
    if (steps.frames > 0) {
        fmt::format_to(out, ",\"long_steps\":{{\"frames\":{},\"tick\":{},\"body\":{},\"step_m\":{},\"edge_m\":{}}}",
                       steps.frames, steps.tick,
                       quoted_json(recording.topology().bodies[static_cast<std::size_t>(steps.body)].name),
                       json_number(steps.step).dump(), json_number(steps.edge).dump());
    }
    fmt::format_to(out, "}}\n");
    std::fwrite(text.data(), 1, text.size(), stdout);
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
        print_json(recording, answers, truth, figures, steps);
    } else {
        fmt::print("{} frames of {} triangles in {} bodies, hash {:016x}\n", recording.frame_count(),
                   recording.topology().triangle_count(), recording.topology().body_count(), recording.hash());
        print_answers(answers, truth);
    }
    return status;
}

}  // namespace trocar::app
