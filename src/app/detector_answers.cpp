#include "app/detector_answers.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <tuple>

#include "app/commands.hpp"
#include "app/isolated_call.hpp"
#include "geometry/input_error.hpp"
#include "measure/statistics.hpp"

namespace trocar::app {
namespace {

template <typename Number>
void append(const Number& number, std::string& bytes) {
    std::array<char, sizeof(Number)> raw{};
    std::memcpy(raw.data(), &number, sizeof(Number));
    bytes.append(raw.data(), raw.size());
}

template <typename Number>
void append_list(const std::vector<Number>& list, std::string& bytes) {
    append(list.size(), bytes);
    for (const Number& number : list) append(number, bytes);
}

/// Deserializes the output of append.
class AnswerBytes {
public:
    explicit AnswerBytes(std::string_view bytes) : rest_(bytes) {}
    template <typename Number>
    void take(Number& number) {
        if (sizeof(Number) > rest_.size()) throw std::runtime_error("a child's answer ends early");
        std::memcpy(&number, rest_.data(), sizeof(Number));
        rest_.remove_prefix(sizeof(Number));
    }
    template <typename Number>
    void take_list(std::vector<Number>& list) {
        std::size_t size = 0;
        take(size);
        list.resize(size);
        for (Number& number : list) take(number);
    }

private:
    std::string_view rest_;
};

/// The frame that prepare sees: the first without a hole, so that one bad frame costs one tick.
void read_first_finite(const AskedFrames& frames, Frame& frame) {
    for (std::int64_t tick = 0; tick < frames.count; ++tick) {
        frames.read(tick, frame);
        if (frame.all_finite()) return;
    }
    if (frames.count > 0) frames.read(0, frame);
}

/// All frames through one detector, as bytes: this runs in the child.
std::string answer_bytes(const MethodSpec& method, const AskedFrames& frames) {
    std::string bytes;
    ContactSet contacts;
    Frame frame;
    std::unique_ptr<Detector> detector;
    Outcome prepared;
    try {
        detector = make_detector(method.name, method.parameters);
        read_first_finite(frames, frame);
        if (frames.count > 0) detector->prepare(frames.topology, frame);
    } catch (const std::exception& error) {
        prepared = {OutcomeKind::threw, error.what()};
    }
    for (std::int64_t tick = 0; tick < frames.count; ++tick) {
        frames.read(tick, frame);
        FrameAnswer answer{.outcome = prepared};
        if (prepared.ok()) answer = answer_here(*detector, frame, contacts);
        const std::string& message = answer.outcome.message;
        append(answer.outcome.kind, bytes);
        append_list(std::vector<char>(message.begin(), message.end()), bytes);
        append(answer.truncated, bytes);
        append(answer.update_ns, bytes);
        append(answer.detect_ns, bytes);
        if (!answer.outcome.ok()) continue;
        append_list(answer.pairs, bytes);
        append_list(answer.swept, bytes);
    }
    return bytes;
}

/// Over the frames that no limit cut.
PairErrors sum_of_errors(const DetectorAnswer& answer) {
    PairErrors sum;
    for (const FrameAnswer& frame : answer.frames) {
        if (!frame.errors || frame.truncated) continue;
        sum.false_negatives += frame.errors->false_negatives;
        sum.false_positives += frame.errors->false_positives;
    }
    return sum;
}

}  // namespace

std::vector<MethodSpec> detectors_named(const std::string& text) {
    std::vector<MethodSpec> methods;
    if (text != "all") {
        methods.push_back(parse_method(text));
        const DetectorEntry& entry = registry().detector(methods.front().name);
        static_cast<void>(ParameterValues(entry.name, entry.parameters, methods.front().parameters));
        return methods;
    }
    for (const DetectorEntry& entry : registry().detectors()) {
        if (!entry.control) methods.push_back({.name = entry.name});
    }
    return methods;
}

void check_time_limit(double seconds) {
    if (!(seconds > 0.0)) throw InputError("command line", "--time-limit", "seconds > 0", fmt::format("{}", seconds));
}

FrameAnswer answer_here(Detector& detector, const Frame& frame, ContactSet& contacts) {
    using Clock = std::chrono::steady_clock;
    contacts.clear();
    FrameAnswer answer;
    try {
        const Clock::time_point start = Clock::now();
        detector.update(frame, 0.0);
        const Clock::time_point updated = Clock::now();
        detector.detect(frame, contacts);
        const Clock::time_point detected = Clock::now();
        answer.update_ns = std::chrono::nanoseconds(updated - start).count();
        answer.detect_ns = std::chrono::nanoseconds(detected - updated).count();
    } catch (const std::exception& error) {
        contacts.outcome = {OutcomeKind::threw, error.what()};
    }
    answer.outcome = contacts.outcome;
    answer.truncated = contacts.truncated;
    if (!answer.outcome.ok()) return answer;
    answer.pairs = contacts.pairs;
    answer.swept = contacts.swept;
    return answer;
}

DetectorAnswer ask(const MethodSpec& method, const AskedFrames& frames, double time_limit_s) {
    DetectorAnswer answer{.name = method.text(), .claims_exact = registry().detector(method.name).claims_exact};
    const IsolatedResult result =
        call_isolated([&method, &frames] { return answer_bytes(method, frames); }, time_limit_s);
    answer.outcome = result.outcome;
    if (!answer.outcome.ok()) return answer;
    AnswerBytes bytes(result.bytes);
    for (std::int64_t tick = 0; tick < frames.count; ++tick) {
        FrameAnswer& frame = answer.frames.emplace_back();
        std::vector<char> message;
        bytes.take(frame.outcome.kind);
        bytes.take_list(message);
        frame.outcome.message.assign(message.begin(), message.end());
        bytes.take(frame.truncated);
        bytes.take(frame.update_ns);
        bytes.take(frame.detect_ns);
        if (frame.outcome.ok()) {
            bytes.take_list(frame.pairs);
            bytes.take_list(frame.swept);
        } else if (answer.outcome.ok()) {
            answer.outcome = {frame.outcome.kind, fmt::format("frame {}: {}", tick, frame.outcome.message)};
        }
    }
    return answer;
}

void judge(const Topology& topology, const Frame& frame, const TickTruth* truth,
           const std::function<Index(Index)>& number, FrameAnswer& answer) {
    if (!answer.outcome.ok()) return;
    std::sort(answer.pairs.begin(), answer.pairs.end());
    answer.pairs.erase(std::unique(answer.pairs.begin(), answer.pairs.end()), answer.pairs.end());
    if (truth != nullptr) answer.errors = compare_pairs(answer.pairs, truth->pairs, truth->touch);
    const bool is_truth = truth != nullptr && answer.pairs == truth->pairs;
    std::vector<std::pair<TrianglePair, bool>> numbered;
    numbered.reserve(answer.pairs.size());
    for (const TrianglePair& pair : answer.pairs) numbered.push_back({{number(pair.a), number(pair.b)}, false});
    for (const Index k : is_truth ? truth->touch : touching_pairs(topology, frame, answer.pairs)) {
        numbered[static_cast<std::size_t>(k)].second = true;
    }
    std::sort(numbered.begin(), numbered.end());
    for (std::size_t k = 0; k < numbered.size(); ++k) {
        answer.pairs[k] = numbered[k].first;
        if (numbered[k].second) answer.touch.push_back(static_cast<Index>(k));
    }
    for (SweptContact& contact : answer.swept) {
        if (contact.a < 0) continue;
        contact.a = number(contact.a);
        contact.b = number(contact.b);
    }
    std::sort(answer.swept.begin(), answer.swept.end(), [](const SweptContact& x, const SweptContact& y) {
        return std::tie(x.a, x.b, x.body_a, x.body_b) < std::tie(y.a, y.b, y.body_a, y.body_b);
    });
}

int conclude(bool all, std::vector<DetectorAnswer>& answers) {
    int status = done;
    for (const DetectorAnswer& answer : answers) {
        const PairErrors errors = sum_of_errors(answer);
        if (!answer.claims_exact || (errors.false_negatives == 0 && errors.false_positives == 0)) continue;
        status = comparison_failed;
        fmt::print(stderr,
                   "trocar: {} claims exactness and differs from the oracle: {} false negatives, {} false positives\n",
                   answer.name, errors.false_negatives, errors.false_positives);
    }
    if (all) {
        for (const AbsentMethod& absent : registry().absent_detectors()) {
            answers.push_back({.name = absent.name, .outcome = {OutcomeKind::absent, absent.reason}});
        }
    } else if (const DetectorAnswer& answer = answers.front(); !answer.outcome.ok()) {
        status = method_failed;
        fmt::print(stderr, "trocar: {}: {}: {}\n", answer.name, name_of(answer.outcome.kind), answer.outcome.message);
    }
    return status;
}

void append_json(const FrameAnswer& answer, fmt::memory_buffer& text) {
    const auto out = std::back_inserter(text);
    fmt::format_to(out, "\"pairs\":[");
    for (std::size_t k = 0; k < answer.pairs.size(); ++k) {
        fmt::format_to(out, "{}[{},{}]", k > 0 ? "," : "", answer.pairs[k].a, answer.pairs[k].b);
    }
    fmt::format_to(out, "],\"touch\":[{}]", fmt::join(answer.touch, ","));
    const auto number = [](bool known, std::int64_t value) { return known ? fmt::format("{}", value) : "null"; };
    const PairErrors errors = answer.errors.value_or(PairErrors{});
    const bool timed = answer.outcome.ok() && answer.update_ns >= 0;
    fmt::format_to(out, ",\"false_negatives\":{},\"false_positives\":{},\"update_ns\":{},\"detect_ns\":{}",
                   number(answer.errors.has_value(), errors.false_negatives),
                   number(answer.errors.has_value(), errors.false_positives), number(timed, answer.update_ns),
                   number(timed, answer.detect_ns));
}

std::string quoted_json(const std::string& text) {
    return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void print_answers(const std::vector<DetectorAnswer>& answers, const Truths* truths) {
    constexpr const char* row = "{:<24} {:<12} {:>7} {:>10} {:>8} {:>8} {:>8} {:>11} {:>11}  {}\n";
    fmt::print(fmt::runtime(row), "detector", "outcome", "frames", "pairs", "touch", "FN", "FP", "update ms",
               "detect ms", "message");
    if (truths != nullptr) {
        std::size_t pairs = 0;
        std::size_t touch = 0;
        for (const std::optional<TickTruth>& frame : *truths) {
            pairs += frame ? frame->pairs.size() : 0;
            touch += frame ? frame->touch.size() : 0;
        }
        fmt::print(fmt::runtime(row), "exact oracle", "ok", truths->size(), pairs, touch, "-", "-", "-", "-", "truth");
    }
    const auto median_ms = [](const std::vector<double>& ns) {
        return ns.empty() ? "-" : fmt::format("{:.3f}", median(ns) * 1e-6);
    };
    for (const DetectorAnswer& answer : answers) {
        std::int64_t good = 0;
        std::size_t pairs = 0;
        std::size_t touch = 0;
        PairErrors errors;
        bool judged = false;
        std::vector<double> update;
        std::vector<double> detect;
        for (const FrameAnswer& frame : answer.frames) {
            if (!frame.outcome.ok()) continue;
            ++good;
            pairs += frame.pairs.size();
            touch += frame.touch.size();
            if (frame.update_ns >= 0) update.push_back(static_cast<double>(frame.update_ns));
            if (frame.detect_ns >= 0) detect.push_back(static_cast<double>(frame.detect_ns));
            if (!frame.errors) continue;
            judged = true;
            errors.false_negatives += frame.errors->false_negatives;
            errors.false_positives += frame.errors->false_positives;
        }
        // Of who gave no answer nothing is counted, and 0 would be an answer.
        const auto count = [](bool known, auto number) { return known ? std::to_string(number) : std::string("-"); };
        fmt::print(fmt::runtime(row), answer.name, name_of(answer.outcome.kind), good, count(good > 0, pairs),
                   count(good > 0, touch), count(judged, errors.false_negatives), count(judged, errors.false_positives),
                   median_ms(update), median_ms(detect), answer.outcome.message);
    }
    fmt::print("Sums over the frames that ended ok; times are medians over them. A study measures many ticks.\n");
}

}  // namespace trocar::app
