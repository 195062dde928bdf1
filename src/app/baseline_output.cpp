#include "app/baseline_output.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/json_values.hpp"
#include "app/junit.hpp"
#include "geometry/input_error.hpp"

namespace trocar::app {
namespace {

using OrderedJson = nlohmann::ordered_json;

/// Without -0.
std::string vector_text(const Vector3& v) {
    return fmt::format("({:.9g}, {:.9g}, {:.9g})", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
}

/// Text of a contact; "none" where there is none.
std::string contact_text(const std::optional<Contact>& contact) {
    if (!contact) return "none";
    std::string text;
    const auto add = [&text](const std::string& part) { text += (text.empty() ? "" : " ") + part; };
    if (contact->kind != ContactCase::unset) add(stored_word(contact->kind));
    if (!std::isnan(contact->depth)) add(fmt::format("depth {:.9g} m", contact->depth + 0.0));
    if (contact->point.allFinite()) add("at " + vector_text(contact->point) + " m");
    if (contact->normal.allFinite()) add("normal " + vector_text(contact->normal));
    return text.empty() ? "a pair" : text;
}

std::string difference_text(const NamedDifference& named) {
    const ContactDifference& one = named.difference;
    std::string text = fmt::format("tick {}, '{}' triangle {}, '{}' triangle {}: ", one.tick, named.bodies[0],
                                   named.triangles[0], named.bodies[1], named.triangles[1]);
    switch (one.what) {
        case ContactDifference::What::missed:
            return text +
                   fmt::format("missed{}, truly: {}", one.touch ? " (they only touch)" : "", contact_text(one.before));
        case ContactDifference::What::untrue:
            return text + fmt::format("reported, but {:.3g} m apart: {}", one.distance, contact_text(one.after));
        case ContactDifference::What::changed:
            text += fmt::format("changed by {:.3g} m of depth, {:.3g} m of point, {:.3g} rad of normal: ", one.depth,
                                one.point, one.angle);
            break;
        default:
            text += fmt::format("{}: ", name_of(one.what));
    }
    return text + contact_text(one.before) + " -> " + contact_text(one.after);
}

std::string truth_text(const TruthFigures& truth) {
    return fmt::format(
        "{} of {} pairs missed{}, {} of {} reported untrue, on {} ticks", truth.false_negatives, truth.pairs,
        truth.false_negatives_touch > 0 ? fmt::format(" ({} only touch)", truth.false_negatives_touch) : "",
        truth.false_positives, truth.reported, truth.ticks);
}

/// One line on one answer.
std::string finding_text(const BaselineFinding& finding) {
    std::string text = finding.reason;
    const auto add = [&text](const std::string& part) { text += (text.empty() ? "" : "; ") + part; };
    if (finding.difference) {
        const AnswerDifference& found = *finding.difference;
        add(
            fmt::format("{} contacts compared, {} missing, {} extra, {} of another kind; worst depth {:.3g} m, point "
                        "{:.3g} m, normal {:.3g} rad",
                        found.compared, found.missing, found.extra, found.other_kind, found.worst_depth,
                        found.worst_point, found.worst_angle));
    }
    if (finding.outcome && finding.outcome_kept && *finding.outcome != *finding.outcome_kept) {
        add("outcome " + *finding.outcome_kept + " -> " + *finding.outcome);
    } else if (finding.outcome && *finding.outcome != "ok") {
        add("outcome " + *finding.outcome);
    }
    if (finding.truth) add("truth: " + truth_text(*finding.truth));
    const bool by_truth = finding.state == FindingState::no_worse || finding.state == FindingState::worse;
    if (by_truth && finding.truth_kept) add("kept: " + truth_text(*finding.truth_kept));
    return text;
}

OrderedJson contact_document(const std::optional<Contact>& contact) {
    if (!contact) return nullptr;
    const auto vector = [](const Vector3& v) {
        return v.allFinite() ? OrderedJson{v.x(), v.y(), v.z()} : OrderedJson(nullptr);
    };
    return {{"kind", contact->kind == ContactCase::unset ? OrderedJson(nullptr) : stored_word(contact->kind)},
            {"point_m", vector(contact->point)},
            {"normal", vector(contact->normal)},
            {"depth_m", json_number(contact->depth)}};
}

OrderedJson truth_document(const std::optional<TruthFigures>& truth) {
    if (!truth) return nullptr;
    return {{"ticks", truth->ticks},
            {"pairs", truth->pairs},
            {"reported", truth->reported},
            {"false_negatives", truth->false_negatives},
            {"false_negatives_touch", truth->false_negatives_touch},
            {"false_positives", truth->false_positives}};
}

OrderedJson difference_document(const NamedDifference& named) {
    const ContactDifference& one = named.difference;
    const bool changed = one.what == ContactDifference::What::changed;
    const auto only = [](bool has, double value) { return has ? json_number(value) : OrderedJson(nullptr); };
    return {{"what", name_of(one.what)},
            {"tick", one.tick},
            {"bodies", named.bodies},
            {"triangles", named.triangles},
            {"before", contact_document(one.before)},
            {"after", contact_document(one.after)},
            {"depth_m", only(changed, one.depth)},
            {"point_m", only(changed, one.point)},
            {"normal_rad", only(changed, one.angle)},
            {"distance_m", only(one.what == ContactDifference::What::untrue, one.distance)},
            {"touch", one.touch}};
}

OrderedJson finding_document(const BaselineFinding& finding) {
    const auto text_or_null = [](const std::optional<std::string>& text) {
        return text ? OrderedJson(*text) : OrderedJson(nullptr);
    };
    OrderedJson document{{"detector", finding.detector},
                         {"state", name_of(finding.state)},
                         {"outcome_kept", text_or_null(finding.outcome_kept)},
                         {"outcome", text_or_null(finding.outcome)},
                         {"difference", nullptr},
                         {"truth_kept", truth_document(finding.truth_kept)},
                         {"truth", truth_document(finding.truth)},
                         {"worst", OrderedJson::array()}};
    if (finding.difference) {
        const AnswerDifference& found = *finding.difference;
        document["difference"] = {{"compared", found.compared},
                                  {"missing", found.missing},
                                  {"extra", found.extra},
                                  {"other_kind", found.other_kind},
                                  {"worst_depth_m", json_number(found.worst_depth)},
                                  {"worst_point_m", json_number(found.worst_point)},
                                  {"worst_normal_rad", json_number(found.worst_angle)}};
    }
    for (const NamedDifference& named : finding.worst) document["worst"].push_back(difference_document(named));
    return document;
}

const char* frames_word(const BaselineReport& report) {
    if (!report.kept) return "none kept";
    return report.same_frames ? "same" : "changed";
}

}  // namespace

const char* name_of(FindingState state) {
    static constexpr std::array names{"same", "changed", "no_worse", "worse", "new", "gone", "missing", "dropped"};
    return names.at(static_cast<std::size_t>(state));
}

bool is_failure(FindingState state) {
    return state == FindingState::changed || state == FindingState::worse || state == FindingState::gone ||
           state == FindingState::no_baseline;
}

std::string baseline_text(const BaselineReport& report) {
    std::string text;
    if (report.kept && !report.same_frames) {
        text += fmt::format("{:<16} the frames are others than those whose contacts are kept: judged by truth alone\n",
                            report.source);
    }
    for (const BaselineFinding& finding : report.findings) {
        text += fmt::format("{:<16} {:<32} {:<8} {}\n", report.source, finding.detector, name_of(finding.state),
                            finding_text(finding));
        for (const NamedDifference& named : finding.worst) {
            text += "    " + printable_line(difference_text(named)) + "\n";
        }
    }
    return text;
}

std::string baseline_json(const std::vector<BaselineReport>& reports, bool written) {
    OrderedJson sources = OrderedJson::array();
    for (const BaselineReport& report : reports) {
        OrderedJson findings = OrderedJson::array();
        for (const BaselineFinding& finding : report.findings) findings.push_back(finding_document(finding));
        sources.push_back({{"source", report.source},
                           {"file", report.file.string()},
                           {"frames", frames_word(report)},
                           {"detectors", std::move(findings)}});
    }
    return OrderedJson{{"written", written}, {"sources", std::move(sources)}}.dump(
        -1, ' ', false, OrderedJson::error_handler_t::replace);
}

std::string baseline_junit(const std::vector<BaselineReport>& reports) {
    std::vector<JUnitSuite> suites;
    for (const BaselineReport& report : reports) {
        JUnitSuite& suite = suites.emplace_back();
        suite.name = report.source;
        for (const BaselineFinding& finding : report.findings) {
            JUnitCase& one = suite.cases.emplace_back();
            one.name = finding.detector;
            one.message = finding_text(finding);
            if (is_failure(finding.state)) {
                one.result = JUnitCase::Result::failed;
                one.type = name_of(finding.state);
                if (finding.state == FindingState::worse)
                    one.details = "the frames are others: judged by truth alone\n";
                for (const NamedDifference& named : finding.worst) one.details += difference_text(named) + "\n";
            } else if (finding.state == FindingState::not_kept) {
                one.result = JUnitCase::Result::skipped;
                one.message = "nothing is kept of it; " + one.message;
            } else {
                one.message = std::string(name_of(finding.state)) + ": " + one.message;
            }
        }
    }
    return junit_text("trocar baseline", suites);
}

}  // namespace trocar::app
