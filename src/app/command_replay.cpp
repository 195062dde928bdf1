// `trocar replay`: one or all detectors on the frames of a recording, the same bits for each, held against the exact
// oracle, and so are the contacts that the recording carries. Each detector works in a child process, since a library
// may crash on what it is given.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "app/answer_bytes.hpp"
#include "app/commands.hpp"
#include "app/isolated_call.hpp"
#include "app/json_values.hpp"
#include "app/long_steps.hpp"
#include "app/pair_answer.hpp"
#include "geometry/input_error.hpp"
#include "measure/pair_truth.hpp"
#include "method/registry.hpp"
#include "scene/recording.hpp"
#include "study/contact_baseline.hpp"

namespace trocar::app {
namespace {

/// One detector on one frame.
struct FrameAnswer {
    Outcome outcome;
    bool truncated = false;
    std::vector<TrianglePair> pairs;
    std::vector<TrianglePair> apart;  ///< of recorded contacts: pairs found, but reported apart (depth below 0)
    std::vector<Index> touch;         ///< positions in pairs
    std::vector<SweptContact> swept;
    std::int64_t update_ns = -1;  ///< below 0: nobody was timed
    std::int64_t detect_ns = -1;
    std::optional<PairErrors> errors;
};

struct DetectorAnswer {
    std::string name;
    bool claims_exact = false;
    Outcome outcome;  ///< the first that was not ok
    std::vector<FrameAnswer> frames;
};

struct Truth {
    std::vector<TrianglePair> pairs;
    std::vector<Index> touch;
    bool known = true;  ///< false: the frame holds a number that is not finite, so there is no truth about it
};

/// The frame that prepare sees: the first without a hole, so that one bad frame costs one tick.
void read_first_finite(RecordingReader& recording, Frame& frame) {
    for (std::int64_t tick = 0; tick < recording.frame_count(); ++tick) {
        recording.read(tick, frame);
        if (frame.all_finite()) return;
    }
    if (recording.frame_count() > 0) recording.read(0, frame);
}

/// All frames through one detector, as bytes: this runs in the child.
std::string answer_bytes(const MethodSpec& method, RecordingReader& recording) {
    using Clock = std::chrono::steady_clock;
    std::string bytes;
    ContactSet contacts;
    Frame frame;
    std::unique_ptr<Detector> detector;
    Outcome prepared;
    try {
        detector = make_detector(method.name, method.parameters);
        read_first_finite(recording, frame);
        if (recording.frame_count() > 0) detector->prepare(recording.topology(), frame);
    } catch (const std::exception& error) {
        prepared = {OutcomeKind::threw, error.what()};
    }
    for (std::int64_t tick = 0; tick < recording.frame_count(); ++tick) {
        recording.read(tick, frame);
        contacts.clear();
        contacts.outcome = prepared;
        Clock::time_point start;
        Clock::time_point updated;
        Clock::time_point detected;
        if (prepared.ok()) {
            try {
                start = Clock::now();
                detector->update(frame, 0.0);
                updated = Clock::now();
                detector->detect(frame, contacts);
                detected = Clock::now();
            } catch (const std::exception& error) {
                contacts.outcome = {OutcomeKind::threw, error.what()};
            }
        }
        append(contacts.outcome.kind, bytes);
        append(contacts.outcome.message, bytes);
        append(contacts.truncated, bytes);
        append(std::int64_t{std::chrono::nanoseconds(updated - start).count()}, bytes);
        append(std::int64_t{std::chrono::nanoseconds(detected - updated).count()}, bytes);
        append(static_cast<std::uint64_t>(contacts.outcome.ok() ? contacts.pairs.size() : 0), bytes);
        if (!contacts.outcome.ok()) continue;
        for (const TrianglePair& pair : contacts.pairs) append(pair, bytes);
        append(static_cast<std::uint64_t>(contacts.swept.size()), bytes);
        for (const SweptContact& contact : contacts.swept) append(contact, bytes);
    }
    return bytes;
}

DetectorAnswer ask(const MethodSpec& method, RecordingReader& recording, double time_limit_s) {
    const DetectorEntry& entry = registry().detector(method.name);
    // Checks the values here, where bad input ends the program.
    static_cast<void>(ParameterValues(entry.name, entry.parameters, method.parameters));
    DetectorAnswer answer{.name = method.text(), .claims_exact = entry.claims_exact, .outcome = {}, .frames = {}};
    const IsolatedResult result =
        call_isolated([&method, &recording] { return answer_bytes(method, recording); }, time_limit_s);
    if (result.kind != IsolatedResult::Kind::complete) {
        const bool crashed = result.kind == IsolatedResult::Kind::crashed;
        answer.outcome = {crashed ? OutcomeKind::crashed : OutcomeKind::timed_out, result.message};
        return answer;
    }
    AnswerBytes bytes(result.bytes);
    for (std::int64_t tick = 0; tick < recording.frame_count(); ++tick) {
        FrameAnswer& frame = answer.frames.emplace_back();
        frame.outcome.kind = bytes.number<OutcomeKind>();
        frame.outcome.message = bytes.text();
        frame.truncated = bytes.number<bool>();
        frame.update_ns = bytes.number<std::int64_t>();
        frame.detect_ns = bytes.number<std::int64_t>();
        frame.pairs.resize(bytes.number<std::uint64_t>());
        for (TrianglePair& pair : frame.pairs) pair = bytes.number<TrianglePair>();
        if (frame.outcome.ok()) frame.swept.resize(bytes.number<std::uint64_t>());
        for (SweptContact& contact : frame.swept) contact = bytes.number<SweptContact>();
        if (!frame.outcome.ok() && answer.outcome.ok()) {
            answer.outcome = {frame.outcome.kind, fmt::format("frame {}: {}", tick, frame.outcome.message)};
        }
    }
    return answer;
}

void sort_once(std::vector<TrianglePair>& pairs) {
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

/// What the recording carries, as the answer of somebody who was not timed.
DetectorAnswer as_answer(const std::vector<RecordedTick>& ticks, std::int64_t frames) {
    DetectorAnswer answer{.name = recorded_answer, .claims_exact = false, .outcome = {}, .frames = {}};
    answer.outcome.message = fmt::format("carried by the recording, of {} of {} frames", ticks.size(), frames);
    FrameAnswer unreported;
    unreported.outcome = {OutcomeKind::unsupported, "the recording reports no contacts of this frame"};
    answer.frames.assign(static_cast<std::size_t>(frames), unreported);
    for (const RecordedTick& tick : ticks) {
        FrameAnswer& frame = answer.frames[static_cast<std::size_t>(tick.tick)];
        frame.outcome = {};
        for (const RecordedContact& contact : tick.contacts) {
            (contact.depth < 0.0 ? frame.apart : frame.pairs).push_back({contact.a, contact.b});
        }
        sort_once(frame.pairs);
    }
    return answer;
}

/// Fills touch and, where truth is known, errors; then turns triangle numbers into those of the file. Reports the steps
/// that are longer than a feature.
LongSteps judge(RecordingReader& recording, std::vector<DetectorAnswer>& answers, std::vector<Truth>* truth) {
    const Topology& topology = recording.topology();
    LongStepWatch watch(topology);
    Frame frame;
    for (std::int64_t tick = 0; tick < recording.frame_count(); ++tick) {
        recording.read(tick, frame);
        watch.observe(frame);
        Truth exact;
        exact.known = frame.all_finite();
        if (truth != nullptr && exact.known) {
            true_pairs(topology, frame, exact.pairs);
            exact.touch = touching_pairs(topology, frame, exact.pairs);
        }
        for (DetectorAnswer& answer : answers) {
            if (answer.frames.empty()) continue;
            FrameAnswer& said = answer.frames[static_cast<std::size_t>(tick)];
            if (!said.outcome.ok()) continue;
            for (const TrianglePair& pair : said.apart) {
                if (std::binary_search(exact.pairs.begin(), exact.pairs.end(), pair)) said.pairs.push_back(pair);
            }
            sort_once(said.pairs);
            if (truth != nullptr) said.errors = compare_pairs(said.pairs, exact.pairs, exact.touch);
            const bool is_truth = truth != nullptr && said.pairs == exact.pairs;
            const std::vector<Index> touch = is_truth ? exact.touch : touching_pairs(topology, frame, said.pairs);
            std::vector<std::pair<TrianglePair, bool>> numbered;
            for (const TrianglePair& pair : said.pairs) {
                numbered.push_back({{recording.file_triangle(pair.a), recording.file_triangle(pair.b)}, false});
            }
            for (const Index k : touch) numbered[static_cast<std::size_t>(k)].second = true;
            std::sort(numbered.begin(), numbered.end());
            for (std::size_t k = 0; k < numbered.size(); ++k) {
                said.pairs[k] = numbered[k].first;
                if (numbered[k].second) said.touch.push_back(static_cast<Index>(k));
            }
            for (SweptContact& contact : said.swept) {
                if (contact.a < 0) continue;
                contact.a = recording.file_triangle(contact.a);
                contact.b = recording.file_triangle(contact.b);
            }
            std::sort(said.swept.begin(), said.swept.end(), [](const SweptContact& x, const SweptContact& y) {
                return std::tie(x.a, x.b, x.body_a, x.body_b) < std::tie(y.a, y.b, y.body_a, y.body_b);
            });
        }
        if (truth != nullptr) truth->push_back(std::move(exact));
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
                       contact.body_a, contact.body_b, contact.time, kind);
    }
    fmt::format_to(out, "]");
}

void print_json(const RecordingReader& recording, const std::vector<DetectorAnswer>& answers,
                const std::vector<Truth>* truth, const LongSteps& steps) {
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
            const bool timed = frame.outcome.ok() && frame.update_ns >= 0;
            append_json({.pairs = frame.pairs,
                         .touch = frame.touch,
                         .errors = frame.errors,
                         .update_ns = timed ? std::optional(frame.update_ns) : std::nullopt,
                         .detect_ns = timed ? std::optional(frame.detect_ns) : std::nullopt},
                        text);
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
            const Truth& exact = (*truth)[tick];
            fmt::format_to(out, "{}{}", tick > 0 ? "," : "",
                           exact.known ? std::to_string(exact.pairs.size()) : std::string("null"));
        }
        fmt::format_to(out, "]");
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

std::string median_ms(std::vector<std::int64_t> ns) {
    if (ns.empty()) return "-";
    std::sort(ns.begin(), ns.end());
    const std::size_t half = ns.size() / 2;
    const double middle = ns.size() % 2 == 1
                              ? static_cast<double>(ns[half])
                              : 0.5 * (static_cast<double>(ns[half - 1]) + static_cast<double>(ns[half]));
    return fmt::format("{:.3f}", middle * 1e-6);
}

void print_table(const RecordingReader& recording, const std::vector<DetectorAnswer>& answers,
                 const std::vector<Truth>* truth) {
    fmt::print("{} frames of {} triangles in {} bodies, hash {:016x}\n", recording.frame_count(),
               recording.topology().triangle_count(), recording.topology().body_count(), recording.hash());
    constexpr const char* row = "{:<24} {:<12} {:>7} {:>10} {:>8} {:>8} {:>8} {:>11} {:>11}  {}\n";
    fmt::print(fmt::runtime(row), "detector", "outcome", "frames", "pairs", "touch", "FN", "FP", "update ms",
               "detect ms", "message");
    if (truth != nullptr) {
        std::size_t pairs = 0;
        std::size_t touch = 0;
        for (const Truth& frame : *truth) {
            pairs += frame.pairs.size();
            touch += frame.touch.size();
        }
        fmt::print(fmt::runtime(row), "exact oracle", "ok", truth->size(), pairs, touch, "-", "-", "-", "-", "truth");
    }
    for (const DetectorAnswer& answer : answers) {
        std::int64_t good = 0;
        std::size_t pairs = 0;
        std::size_t touch = 0;
        PairErrors errors;
        std::vector<std::int64_t> update;
        std::vector<std::int64_t> detect;
        for (const FrameAnswer& frame : answer.frames) {
            if (!frame.outcome.ok()) continue;
            ++good;
            pairs += frame.pairs.size();
            touch += frame.touch.size();
            if (frame.update_ns >= 0) update.push_back(frame.update_ns);
            if (frame.detect_ns >= 0) detect.push_back(frame.detect_ns);
            if (!frame.errors) continue;
            errors.false_negatives += frame.errors->false_negatives;
            errors.false_positives += frame.errors->false_positives;
        }
        const bool judged = truth != nullptr && !answer.frames.empty();
        fmt::print(fmt::runtime(row), answer.name, name_of(answer.outcome.kind), good, pairs, touch,
                   judged ? std::to_string(errors.false_negatives) : "-",
                   judged ? std::to_string(errors.false_positives) : "-", median_ms(update), median_ms(detect),
                   answer.outcome.message);
    }
    fmt::print("Sums over the frames that ended ok; times are medians over them.\n");
}

}  // namespace

int replay(const CommonOptions& common, const ReplayOptions& options) {
    const bool all = options.detector == "all";
    const bool only_recorded = options.detector == recorded_answer;
    std::vector<MethodSpec> methods;
    if (all) {
        for (const DetectorEntry& entry : registry().detectors()) {
            if (!entry.control) methods.push_back({.name = entry.name});
        }
    } else if (!only_recorded) {
        methods.push_back(parse_method(options.detector));
        static_cast<void>(registry().detector(methods.front().name));  // an unknown name ends here
    }
    if (!(options.time_limit_s > 0.0)) {
        throw InputError("command line", "--time-limit", "seconds > 0", fmt::format("{}", options.time_limit_s));
    }
    RecordingReader recording(options.recording);
    if (only_recorded && !recording.has_contacts()) {
        throw InputError(options.recording.string(), "", "a recording that carries contacts, for --detector recorded",
                         "none");
    }
    const std::vector<RecordedTick> recorded = recording.contacts();  // malformed ones end here
    std::vector<DetectorAnswer> answers;
    answers.reserve(methods.size() + 1);
    for (const MethodSpec& method : methods) answers.push_back(ask(method, recording, options.time_limit_s));
    if (recording.has_contacts() && (all || only_recorded)) {
        answers.push_back(as_answer(recorded, recording.frame_count()));
    }
    std::vector<Truth> exact;
    std::vector<Truth>* const truth = all || options.truth ? &exact : nullptr;
    const LongSteps steps = judge(recording, answers, truth);
    if (const std::string note = long_step_note(steps, recording.topology()); !note.empty()) {
        fmt::print(stderr, "trocar: {}: {}\n", options.recording.string(), note);
    }

    int status = done;
    for (const DetectorAnswer& answer : answers) {
        PairErrors errors;
        for (const FrameAnswer& frame : answer.frames) {
            if (!frame.errors || frame.truncated) continue;
            errors.false_negatives += frame.errors->false_negatives;
            errors.false_positives += frame.errors->false_positives;
        }
        if (!answer.claims_exact || (errors.false_negatives == 0 && errors.false_positives == 0)) continue;
        status = comparison_failed;
        fmt::print(stderr,
                   "trocar: {} claims exactness and differs from the oracle: {} false negatives, {} false positives\n",
                   answer.name, errors.false_negatives, errors.false_positives);
    }
    if (all) {
        for (const AbsentMethod& absent : registry().absent_detectors()) {
            answers.push_back({.name = absent.name,
                               .claims_exact = false,
                               .outcome = {OutcomeKind::absent, absent.reason},
                               .frames = {}});
        }
    } else if (const DetectorAnswer& answer = answers.front(); !answer.outcome.ok()) {
        status = method_failed;
        fmt::print(stderr, "trocar: {}: {}: {}\n", answer.name, name_of(answer.outcome.kind), answer.outcome.message);
    }
    if (common.json) {
        print_json(recording, answers, truth, steps);
    } else {
        print_table(recording, answers, truth);
    }
    return status;
}

}  // namespace trocar::app
