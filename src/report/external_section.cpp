// Detectors on data of other groups: errors against answers that come with the data, or against the exact oracle where
// the source has poses alone. Every part names its source, licence and command.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "report/metric_table.hpp"

namespace trocar {
namespace {

constexpr const char* external_mode = "external";

/// One format of external data.
struct ExternalPart {
    const char* format;
    const char* heading;
    const char* of_what;  ///< that are missed
    const char* files;    ///< name of the inputs
    bool between = false;
    bool timed = false;
    const char* text;
};

constexpr std::array external_parts{
    ExternalPart{"scalable_ccd", "Contacts that begin between two frames", "beginnings", "scenes", true, true,
                 "Two frames of one mesh, every vertex on a straight line between them; connected components are the "
                 "bodies. A pair of triangles of two bodies begins to meet when one of its vertex-face or edge-edge "
                 "candidates collides by the source's symbolic answer, and the two do not meet at the first frame. "
                 "Missed: reported neither between the frames nor at the second one. Invented: reported between the "
                 "frames, and no such pair. A detector without a swept answer sees the second frame alone."},
    ExternalPart{"fcl_scenario", "Pairs that meet in FCL's test models", "pairs", "scenarios", false, true,
                 "Two objects at every pose of a scenario, in the numbers of the file. The data are from outside; the "
                 "source has no list of pairs, so that truth is the exact oracle of this project."},
    ExternalPart{"triangle_pairs", "Triangle pairs", "pairs that meet", "files", false, false,
                 "Each pair is a scene of two triangles. The answers are in the files, by exact rational arithmetic; "
                 "touching counts as meeting."},
    ExternalPart{"ccd_queries", "Continuous queries", "queries that collide", "files", false, false,
                 "A vertex against a face or an edge against an edge, on straight lines: each a scene of two "
                 "triangles, of which a vertex and an edge are degenerate ones. The answers are the source's. A "
                 "query is found when the pair is reported at one of the two frames or between them."}};

/// Of one method on the inputs of one part.
struct ExternalRow {
    Method method;
    ResultSet results = {};
    double missed = 0.0;
    double invented = 0.0;
    double failed = 0.0;
    double ratio = not_known;  ///< geometric mean over the inputs
};

bool belongs_to(const ExternalPart& part, const Record& record) {
    return fact_of(record, "case.format") == part.format;
}

/// First record of the part; null without one.
const Record* example_of(const Draft& draft, const ExternalPart& part) {
    const auto found = std::find_if(draft.records.begin(), draft.records.end(),
                                    [&part](const Record& record) { return belongs_to(part, record); });
    return found == draft.records.end() ? nullptr : &*found;
}

/// Median time over that of the part's reference on the same input.
double time_ratio(const Draft& draft, const SceneResult& result) {
    const std::string& reference = fact_of(result.record(), "case.reference");
    const SceneResult* const other = draft.results.find(
        {.mode = external_mode, .detector = reference, .response = "", .contacts = ""}, result.scene());
    if (other == nullptr || !other->ok() || !result.ok()) return not_known;
    return result.first(Metric::total_median_ns) / other->first(Metric::total_median_ns);
}

Metric missed_metric(const ExternalPart& part) {
    return part.between ? Metric::swept_false_negatives : Metric::false_negatives;
}
Metric invented_metric(const ExternalPart& part) {
    return part.between ? Metric::swept_false_positives : Metric::false_positives;
}
Metric truth_metric(const ExternalPart& part) { return part.between ? Metric::true_swept : Metric::true_pairs; }

ExternalRow external_row(const Draft& draft, const ExternalPart& part, const Method& method) {
    ExternalRow row{.method = method};
    double log_sum = 0.0;
    for (const SceneResult* result : possible(draft.results, method).results) {
        if (!belongs_to(part, result->record())) continue;
        row.results.results.push_back(result);
        log_sum += std::log(time_ratio(draft, *result));
    }
    row.missed = row.results.sum(missed_metric(part));
    row.invented = row.results.sum(invented_metric(part));
    row.failed = part.timed ? row.results.failed_runs() : row.results.sum(Metric::failed_ticks);
    if (part.timed) row.ratio = std::exp(log_sum / static_cast<double>(row.results.count()));
    return row;
}

/// Fewest failures, then fewest errors, then the fastest.
std::vector<ExternalRow> external_rows(const Draft& draft, const ExternalPart& part) {
    std::vector<ExternalRow> rows;
    for (const Method& method : draft.results.methods(external_mode)) {
        ExternalRow row = external_row(draft, part, method);
        if (row.results.count() > 0) rows.push_back(std::move(row));
    }
    std::stable_sort(rows.begin(), rows.end(), [](const ExternalRow& a, const ExternalRow& b) {
        const auto key = [](const ExternalRow& row) {
            return std::array{row.failed, or_last(row.missed + row.invented), or_last(row.ratio)};
        };
        return key(a) < key(b);
    });
    return rows;
}

bool is_free_of_errors(const ExternalPart& part, const SceneResult& result) {
    return result.ok() && result.first(missed_metric(part)) == 0.0 && result.first(invented_metric(part)) == 0.0;
}

std::vector<MetricColumn> external_columns(const Draft& draft, const ExternalPart& part) {
    std::vector<MetricColumn> columns;
    columns.push_back({.header = fmt::format("missed of N {}", part.of_what),
                       .metric = missed_metric(part),
                       .text = [&part](const ResultSet& results) {
                           return of_text(results.sum(missed_metric(part)), results.sum(truth_metric(part)));
                       }});
    columns.push_back(count_column("invented", invented_metric(part), Processes::first, Over::sum));
    columns.push_back(text_column(fmt::format("{} without an error", part.files), [&part](const ResultSet& results) {
        const auto right =
            std::count_if(results.results.begin(), results.results.end(),
                          [&part](const SceneResult* result) { return is_free_of_errors(part, *result); });
        return fmt::format("{} of {}", right, results.count());
    }));
    if (part.between) {
        for (const std::string& scene : draft.results.scenes(external_mode)) {
            const auto is_here = [&](const Record& record) {
                return belongs_to(part, record) && record.spec.scene == scene;
            };
            if (std::none_of(draft.records.begin(), draft.records.end(), is_here)) continue;
            columns.push_back(text_column("time ratio, " + scene, [&draft, scene](const ResultSet& results) {
                for (const SceneResult* result : results.results) {
                    if (result->scene() == scene) return scaled(time_ratio(draft, *result));
                }
                return std::string(unknown_text);
            }));
        }
    } else if (part.timed) {
        columns.push_back(text_column("time ratio", [&draft, &part](const ResultSet& results) {
            return scaled(external_row(draft, part, method_of(results.results.front()->record().spec)).ratio);
        }));
    }
    columns.push_back(text_column("failed", [&part](const ResultSet& results) {
        return part.timed ? std::to_string(results.failed_runs()) : count_text(results.sum(Metric::failed_ticks));
    }));
    return columns;
}

/// Inputs that the data folder lacked, and methods that the build lacks.
std::string not_run_text(const Draft& draft, const ExternalPart& part) {
    std::set<std::string> paths;
    std::set<std::string> absent;
    for (const Record& record : draft.records) {
        if (!belongs_to(part, record)) continue;
        if (record.outcome.kind == OutcomeKind::absent) absent.insert(record.spec.detector);
        if (record.outcome.message == "no data") paths.insert(fact_of(record, "case.path"));
    }
    std::string text;
    if (!paths.empty()) {
        text += " Skipped: no data folder (TROCAR_DATA) with " +
                joined_code(std::vector<std::string>(paths.begin(), paths.end())) + ".";
    }
    if (!absent.empty()) {
        text += " Absent from this build: " + joined_code(std::vector<std::string>(absent.begin(), absent.end())) + ".";
    }
    return text;
}

/// Foreign detectors whose pairs our own exact test decides: no second opinion on a pair.
std::string decided_here_text(const Draft& draft, const ExternalPart& part) {
    std::set<std::string> names;
    for (const Record& record : draft.records) {
        const bool here = fact_of(record, "detector.configuration").find("trocar's exact test") != std::string::npos;
        if (here && belongs_to(part, record) && !never_ran(record)) names.insert(record.spec.detector);
    }
    if (names.empty()) return {};
    return " Candidates decided by trocar's exact test: " +
           joined_code(std::vector<std::string>(names.begin(), names.end())) + ".";
}

/// How the table is to be read.
std::string reading_text(const ExternalPart& part, const Record& example) {
    const std::string& reference = fact_of(example, "case.reference");
    std::string order = "Order: failed, errors, time. ";
    if (!part.timed || reference.empty()) return order;
    return "Time ratio: median CPU time of update and detect over that of " + code(reference) +
           ", in turns in one process" + (part.between ? "" : "; geometric mean over the scenarios") + ". " + order;
}

/// Source, licence and command.
std::string origin_text(const Draft& draft, const ExternalPart& part, const Record& example) {
    return "Source: " + fact_of(example, "case.source") + ". Licence: " + fact_of(example, "case.licence") +
           ". Command: " + code("TROCAR_DATA=FOLDER " + study_command(draft.records)) + "." +
           decided_here_text(draft, part) + not_run_text(draft, part);
}

Table external_table(const Draft& draft, const ExternalPart& part, const std::vector<ExternalRow>& rows) {
    std::vector<MetricRow> lines;
    lines.reserve(rows.size());
    for (const ExternalRow& row : rows) {
        const bool own = draft.results.fact(row.method, "detector.own") == "yes";
        lines.push_back({.names = {code(row.method.detector)},
                         .results = row.results,
                         .style = own ? TableRow::Style::own : TableRow::Style::normal});
    }
    return table_of({.caption = part.heading, .columns = {{.header = "detector", .wide = true}}},
                    external_columns(draft, part), lines);
}

}  // namespace

std::vector<Table> external_tables(const Draft& draft) {
    std::vector<Table> tables;
    for (const ExternalPart& part : external_parts) {
        const std::vector<ExternalRow> rows = external_rows(draft, part);
        if (!rows.empty()) tables.push_back(external_table(draft, part, rows));
    }
    return tables;
}

std::string external_sentence(const Draft& draft) {
    std::vector<std::string> sentences;
    for (const ExternalPart& part : external_parts) {
        const std::vector<ExternalRow> rows = external_rows(draft, part);
        if (rows.empty()) continue;
        std::vector<std::string> right;
        for (const ExternalRow& row : rows) {
            if (row.failed == 0.0 && row.missed == 0.0 && row.invented == 0.0) right.push_back(row.method.detector);
        }
        sentences.push_back(fmt::format("{} ({} {}): without an error {}.", part.heading,
                                        count_text(rows.front().results.sum(truth_metric(part))), part.of_what,
                                        right.empty() ? "none" : joined_code(right)));
    }
    return joined(sentences, " ");
}

void add_external(Draft& draft) {
    for (const ExternalPart& part : external_parts) {
        const Record* const example = example_of(draft, part);
        if (example == nullptr) continue;
        draft.heading(2, part.heading);
        draft.paragraph(part.text);
        const std::vector<ExternalRow> rows = external_rows(draft, part);
        if (!rows.empty()) {
            Table table = external_table(draft, part, rows);
            table.caption.clear();  // the heading says it
            draft.add(std::move(table));
        }
        const std::string origin = origin_text(draft, part, *example);
        draft.paragraph(rows.empty() ? origin : reading_text(part, *example) + origin, Paragraph::Style::small);
    }
}

}  // namespace trocar
