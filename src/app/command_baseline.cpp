// `trocar baseline`: keeps contacts on scenes or recordings, those of detectors and those that a recording carries, or
// holds fresh ones against those kept and against exact truth. Only `write` ever changes a stored file, and it reports
// what it changes.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "app/baseline_output.hpp"
#include "app/baseline_source.hpp"
#include "app/commands.hpp"
#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "method/registry.hpp"
#include "study/baseline_comparison.hpp"
#include "study/contact_baseline.hpp"

namespace trocar::app {
namespace {

/// One answer that is asked for.
struct Asked {
    std::string name;
    std::optional<MethodSpec> method;  ///< none: what the recording carries
    std::string gone;                  ///< why it cannot be had; empty: it can
};

void expect_usable(const MethodSpec& method) { static_cast<void>(make_detector(method.name, method.parameters)); }

std::vector<Asked> all_detectors() {
    std::vector<Asked> asked;
    for (const DetectorEntry& entry : registry().detectors()) {
        if (!entry.control) asked.push_back({entry.name, MethodSpec{.name = entry.name}, ""});
    }
    return asked;
}

/// What a file of kept contacts names; its detectors may have left.
Asked as_kept(const std::string& name, const BaselineSource& source) {
    if (name == recorded_answer) {
        return {name, std::nullopt, source.recorded() ? "" : "contacts are kept, but the recording carries none"};
    }
    try {
        const MethodSpec method = parse_method(name);
        expect_usable(method);
        return {name, method, ""};
    } catch (const InputError&) {
        return {name, std::nullopt, "contacts are kept, but this build has no such detector"};
    }
}

/// Without --detector: what is kept, else what the recording carries, else every detector.
std::vector<Asked> answers_asked(const std::vector<std::string>& texts, const std::optional<ContactBaseline>& before,
                                 const BaselineSource& source) {
    std::vector<Asked> asked;
    const bool carries = source.recorded().has_value();
    const bool all = std::find(texts.begin(), texts.end(), "all") != texts.end();
    if (all || (texts.empty() && !before && !carries)) asked = all_detectors();
    if (carries && (all || texts.empty())) asked.push_back({recorded_answer, std::nullopt, ""});
    if (before && (all || texts.empty())) {
        for (const auto& [name, answer] : before->detectors) {
            Asked one = as_kept(name, source);
            if (all && one.gone.empty()) one.gone = "contacts are kept, but this detector was not asked";
            asked.push_back(one);
        }
    }
    for (const std::string& text : texts) {
        if (text == "all") continue;
        if (text != recorded_answer) {
            const MethodSpec method = parse_method(text);
            asked.push_back({method.text(), method, ""});
        } else if (carries || (before && before->detectors.contains(text))) {
            asked.push_back(as_kept(text, source));
        } else {
            throw InputError(source.file().string(), "", "a recording that carries contacts, for --detector recorded",
                             "none");
        }
    }
    std::set<std::string> names;
    std::erase_if(asked, [&names](const Asked& one) { return !names.insert(one.name).second; });
    return asked;
}

/// How many ticks of the stream an answer may speak of.
std::int64_t ticks_of(const ContactBaseline& baseline, const std::string& name) {
    const std::int64_t every = baseline.every_of(name);
    return (baseline.ticks + every - 1) / every;
}

/// Fills state, difference and reason of a finding whose answer is in both.
void compare_with_kept(const ContactBaseline& before, const ContactBaseline& after, bool same_frames,
                       const BaselineTolerance& tolerance, BaselineFinding& finding) {
    const std::string& name = finding.detector;
    BaselineAnswer old = before.detectors.at(name);
    BaselineAnswer now = after.detectors.at(name);
    finding.outcome_kept = old.outcome;
    finding.truth_kept = old.truth;
    if (!same_frames) {
        const bool as_good = old.outcome == now.outcome && (now.truth ? is_no_worse(old.truth, ticks_of(before, name),
                                                                                    *now.truth, ticks_of(after, name))
                                                                      : !old.truth);
        finding.state = as_good ? FindingState::no_worse : FindingState::worse;
        return;
    }
    const bool same_ticks = before.every_of(name) == after.every_of(name);
    keep_every(after.every_of(name), old);
    keep_every(before.every_of(name), now);
    finding.difference = compare_answers(old, now, tolerance);
    finding.state = finding.difference->within(tolerance) ? FindingState::same : FindingState::changed;
    if (same_ticks && old.truth && now.truth && old.truth->ticks != now.truth->ticks) {
        finding.state = FindingState::changed;
        finding.reason =
            fmt::format("contacts are recorded for {} frames, before for {}", now.truth->ticks, old.truth->ticks);
    }
}

/// Asks, judges and compares; `after` gets the answers.
BaselineReport guard(const BaselineSource& source, const std::vector<Asked>& asked,
                     const std::optional<ContactBaseline>& before, const BaselineOptions& options,
                     ContactBaseline& after) {
    const ContactBaseline stream = after;
    for (const Asked& one : asked) {
        if (!one.gone.empty()) continue;
        if (one.method) {
            after.detectors[one.name] = ask_detector(*one.method, source, stream, options.time_limit_s);
            continue;
        }
        // What a recording reports costs nothing to examine, so that every tick of it is kept.
        const bool kept = before && before->detectors.contains(one.name);
        const std::int64_t every = options.every.value_or(kept ? before->every_of(one.name) : 1);
        BaselineAnswer& answer = after.detectors[one.name];
        answer = recorded_as_answer(source, every);
        if (every != after.every) answer.every = every;
    }
    const std::map<std::string, TruthComparison> truth = hold_against_truth(after, source);
    BaselineReport report{.source = source.name(), .file = {}, .kept = before.has_value()};
    report.same_frames = before && before->source_hash == after.source_hash && before->frames_hash == after.frames_hash;
    for (const Asked& one : asked) {
        BaselineFinding& finding = report.findings.emplace_back();
        finding.detector = one.name;
        if (!one.gone.empty()) {
            finding.state = FindingState::gone;
            finding.reason = one.gone;
            continue;
        }
        BaselineAnswer& answer = after.detectors[one.name];
        finding.outcome = answer.outcome;
        const std::vector<ContactDifference>* worst = nullptr;
        if (const auto found = truth.find(one.name); found != truth.end()) {
            answer.truth = found->second.figures();
            worst = &found->second.worst();
        } else if (answer.outcome == "ok") {
            answer.truth.emplace();  // there was no frame that it speaks of
        }
        finding.truth = answer.truth;
        if (before && before->detectors.contains(one.name)) {
            compare_with_kept(*before, after, report.same_frames, {.length = options.tolerance}, finding);
        } else {
            finding.state = FindingState::not_kept;
        }
        if (finding.difference) worst = &finding.difference->worst;
        if (worst == nullptr) continue;
        for (const ContactDifference& difference : *worst) finding.worst.push_back(source.named(difference));
    }
    return report;
}

/// Answers that were not asked keep what was kept of them on these frames. All others are reported as gone.
void keep_others(const ContactBaseline& before, bool all, BaselineReport& report, ContactBaseline& after) {
    for (const auto& [name, answer] : before.detectors) {
        if (after.detectors.contains(name)) continue;
        std::erase_if(report.findings,
                      [&name = name](const BaselineFinding& finding) { return finding.detector == name; });
        if (!all && report.same_frames) {
            BaselineAnswer& kept = after.detectors[name];
            kept = answer;
            kept.every.reset();
            if (before.every_of(name) != after.every) kept.every = before.every_of(name);
            continue;
        }
        BaselineFinding& finding = report.findings.emplace_back();
        finding.detector = name;
        finding.state = FindingState::dropped;
        finding.outcome_kept = answer.outcome;
        finding.truth_kept = answer.truth;
        finding.reason = report.same_frames ? "it is not in this build or recording, and no longer kept"
                                            : "it was not asked, and what was kept is of other frames";
    }
}

/// `check` without a file of kept contacts has nothing to do, and a CI that lost its file must see that.
BaselineReport nothing_kept(const BaselineSource& source, const std::vector<Asked>& asked) {
    BaselineReport report{.source = source.name(), .file = {}, .kept = false};
    for (const Asked& one : asked) {
        BaselineFinding& finding = report.findings.emplace_back();
        finding.detector = one.name;
        finding.state = FindingState::no_baseline;
        finding.reason = "no contacts are kept (trocar baseline write)";
    }
    return report;
}

void expect_usable(const BaselineOptions& options) {
    if (options.every && *options.every < 1) {
        throw InputError("command line", "--every", "an integer >= 1", fmt::format("{}", *options.every));
    }
    if (!(options.tolerance >= 0.0)) {
        throw InputError("command line", "--tolerance", "metres >= 0", fmt::format("{}", options.tolerance));
    }
    if (options.junit && options.what == "write") {
        throw InputError("command line", "--junit", "what check finds", "write");
    }
    for (const std::string& text : options.detectors) {
        if (text != "all" && text != recorded_answer) expect_usable(parse_method(text));  // a wrong name ends here
    }
}

}  // namespace

int baseline(const CommonOptions& common, const BaselineOptions& options) {
    expect_usable(options);
    const bool write = options.what == "write";
    const bool all = std::find(options.detectors.begin(), options.detectors.end(), "all") != options.detectors.end();
    constexpr std::int64_t samples = 20;
    std::vector<BaselineReport> reports;
    bool failed = false;
    for (const std::filesystem::path& file : options.sources) {
        const BaselineSource source(file, common.data);
        const std::filesystem::path folder = options.folder.value_or(file.parent_path() / "baseline");
        const std::filesystem::path kept = folder / (source.name() + ".json");
        std::optional<ContactBaseline> before;
        if (std::filesystem::exists(kept)) before = read_contact_baseline(kept);
        const std::vector<Asked> asked = answers_asked(options.detectors, before, source);
        BaselineReport report;
        if (!before && !write) {
            report = nothing_kept(source, asked);
        } else {
            ContactBaseline after = source.empty_baseline(
                options.every.value_or(before ? before->every : std::max<std::int64_t>(1, source.ticks() / samples)));
            report = guard(source, asked, before, options, after);
            if (write) {
                if (before) keep_others(*before, all, report, after);
                std::filesystem::create_directories(folder);
                write_whole(kept, to_json(after));
            }
        }
        report.file = kept;
        for (const BaselineFinding& finding : report.findings) failed = failed || is_failure(finding.state);
        if (!common.json) {
            fmt::print("{}", baseline_text(report));
            if (write) fmt::print("{:<16} written: {}\n", report.source, kept.string());
        }
        reports.push_back(std::move(report));
    }
    if (common.json) fmt::print("{}\n", baseline_json(reports, write));
    if (options.junit) write_whole(*options.junit, baseline_junit(reports));
    return write || !failed ? done : comparison_failed;
}

}  // namespace trocar::app
