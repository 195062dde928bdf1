#include "report/board.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <tuple>

#include "geometry/input_error.hpp"
#include "measure/statistics.hpp"
#include "report/cell.hpp"
#include "report/chart.hpp"
#include "report/figures.hpp"
#include "report/page_assets.hpp"
#include "report/sections.hpp"
#include "web/web.hpp"

namespace trocar {
namespace {

/// A machine with the version of the program that ran there.
struct Place {
    std::string machine;
    std::string version;
    bool last = true;  ///< no later version of the study on this machine
};

/// Records of one study from one place.
struct Batch {
    Place place;
    std::vector<Record> records;
};

/// "AMD EPYC, 4 cores, 3f2a": equal machines differ in the last word.
std::string machine_of(const Record& record) {
    std::string name = fact_of(record, "cpu") + ", " + fact_of(record, "cores") + " cores";
    if (const std::string& hash = fact_of(record, "machine"); !hash.empty()) name += ", " + hash.substr(0, 4);
    return name;
}

/// "fed58e158d3b", with a mark where the sources had changes that no commit has.
std::string version_of(const Record& record) {
    return fact_of(record, "commit").substr(0, 12) + (fact_of(record, "dirty") == "yes" ? " changed" : "");
}

/// A method on a scene.
using MethodOnScene = std::tuple<Method, std::string>;

/// A table that the selects of the page filter: its first columns are the place.
Table placed_table(std::string caption, std::vector<Column> columns) {
    Table table{.caption = std::move(caption), .columns = {{"machine", false}, {"version", false}}};
    table.columns.insert(table.columns.end(), columns.begin(), columns.end());
    return table;
}

std::vector<std::string> placed_cells(const Place& place) { return {place.machine, code(place.version)}; }

std::string status_of(const SceneResult* result, const Place& place) {
    if (result == nullptr) return "missing";
    if (result->not_applicable()) return "excluded";
    std::string status = result->ok() ? "ok" : "failed: " + std::string(name_of(result->failure().kind));
    return place.last ? status : "stale (" + status + ")";
}

/// The method's figures over the scenes on which it ended well.
struct Figures {
    double depth = not_known;            ///< m, worst
    double false_negatives = not_known;  ///< sum
    double median_tick = not_known;      ///< ns, geometric mean over the scenes
};

Figures figures_of(const Results& results, const Method& method) {
    ResultSet ended;
    for (const auto& [scene, result] : results.of(method)) {
        if (result.ok()) ended.results.push_back(&result);
    }
    Figures figures{ended.largest(Metric::residual_penetration_max_m), ended.sum(Metric::false_negatives), not_known};
    std::vector<double> ticks;
    for (const SceneResult* result : ended.results) ticks.push_back(result->of(Metric::total_median_ns).value);
    figures.median_tick = geometric_mean(ticks);
    return figures;
}

struct StatusCounts {
    int ok = 0, failed = 0, excluded = 0, missing = 0;
};

/// Everything of one study.
class StudyBoard {
public:
    StudyBoard(std::string name, const std::vector<Batch>& batches) : name_(std::move(name)), batches_(batches) {
        for (const Batch& batch : batches_) drafts_.push_back(std::make_unique<Draft>(batch.records));
        for (const auto& draft : drafts_) {
            for (const RunFigures& run : draft->results.runs()) {
                const RunSpec& spec = run.record->spec;
                if (!spec.scene.empty() && spec.point.empty()) cells_.insert({method_of(spec), spec.scene});
            }
        }
        for (const auto& [method, scene] : cells_) methods_.insert(method);
    }

    void add_status(Table& table) const {
        for (std::size_t b = 0; b < batches_.size(); ++b) {
            const Place& place = batches_[b].place;
            StatusCounts tally;
            for (const auto& [method, scene] : cells_) {
                const SceneResult* result = drafts_[b]->results.find(method, scene);
                ++(result == nullptr          ? tally.missing
                   : result->not_applicable() ? tally.excluded
                   : result->ok()             ? tally.ok
                                              : tally.failed);
            }
            std::vector<std::string> line = placed_cells(place);
            line.push_back(code(name_));
            line.push_back(place.last ? "" : "stale");
            for (const int count : {tally.ok, tally.failed, tally.missing, tally.excluded})
                line.push_back(std::to_string(count));
            table.rows.push_back({.cells = std::move(line),
                                  .style = tally.failed > 0 ? TableRow::Style::failed
                                           : place.last     ? TableRow::Style::normal
                                                            : TableRow::Style::dominated,
                                  .command = study_command(batches_[b].records)});
        }
    }

    void add_to(Document& document) const {
        document.blocks.emplace_back(Heading{2, "Study " + code(name_)});
        document.blocks.emplace_back(methods_table());
        add_history(document);
        document.blocks.emplace_back(cells_table());
    }

private:
    Table methods_table() const {
        Table table = placed_table("Methods over their scenes",
                                   {{"mode", false},
                                    {.header = "method", .wide = true},
                                    {"status", false},
                                    {"scenes ok of N", true},
                                    {"worst penetration (mm)", true, Metric::residual_penetration_max_m},
                                    {"false negatives", true, Metric::false_negatives},
                                    {"tick p50 (µs)", true, Metric::total_median_ns}});
        for (std::size_t b = 0; b < batches_.size(); ++b) {
            for (const Method& method : methods_) {
                int planned = 0;
                int ended = 0;
                std::set<std::string> words;
                for (const auto& [one, scene] : cells_) {
                    if (one != method) continue;
                    const SceneResult* result = drafts_[b]->results.find(method, scene);
                    const std::string status = status_of(result, batches_[b].place);
                    words.insert(status);
                    planned += 1;
                    ended += result != nullptr && result->ok() ? 1 : 0;
                }
                const bool here = ended > 0;
                const Figures figures = here ? figures_of(drafts_[b]->results, method) : Figures{};
                std::vector<std::string> line = placed_cells(batches_[b].place);
                line.insert(line.end(), {method.mode, code(method.label()), fmt::format("{}", fmt::join(words, ", ")),
                                         fmt::format("{} of {}", ended, planned), scaled(figures.depth, mm),
                                         count_text(figures.false_negatives), scaled(figures.median_tick, us)});
                table.rows.push_back({.cells = std::move(line),
                                      .style = ended < planned          ? TableRow::Style::failed
                                               : batches_[b].place.last ? TableRow::Style::normal
                                                                        : TableRow::Style::dominated,
                                      .command = command_of_row(b, method)});
            }
        }
        table.note =
            "Figures are over the scenes that ended well: the worst depth, the sum of false negatives, the geometric "
            "mean "
            "of the ticks' medians. Times of different machines are not set against each other.";
        return table;
    }

    /// On all scenes of the method, or on one.
    std::string command_of_row(std::size_t batch, const Method& method, const std::string& scene = {}) const {
        const Draft& draft = *drafts_[batch];
        std::vector<std::string> scenes{scene};
        if (scene.empty()) scenes = draft.results.scenes(method.mode);
        const std::string one = method.mode == "closed_loop" ? run_command(draft, method, scenes) : std::string();
        return one.empty() ? study_command(batches_[batch].records) : one;
    }

    /// Every cell of the last version of each machine.
    Table cells_table() const {
        Table table = placed_table("Every method on every scene, last version of each machine",
                                   {{"mode", false},
                                    {"scene", false},
                                    {.header = "method", .wide = true},
                                    {"status", false},
                                    {"worst penetration (mm)", true, Metric::residual_penetration_max_m},
                                    {"false negatives", true, Metric::false_negatives},
                                    {"tick p50 (µs)", true, Metric::total_median_ns}});
        table.folded = true;
        for (std::size_t b = 0; b < batches_.size(); ++b) {
            if (!batches_[b].place.last) continue;
            for (const auto& [method, scene] : cells_) {
                const SceneResult* result = drafts_[b]->results.find(method, scene);
                const bool here = result != nullptr && result->ok();
                const auto number = [&](Metric metric, double scale) {
                    return scaled(here ? result->of(metric).value : not_known, scale);
                };
                std::vector<std::string> line = placed_cells(batches_[b].place);
                line.insert(line.end(), {method.mode, scene, code(method.label()), status_of(result, batches_[b].place),
                                         number(Metric::residual_penetration_max_m, mm),
                                         number(Metric::false_negatives, 1.0), number(Metric::total_median_ns, us)});
                table.rows.push_back({.cells = std::move(line),
                                      .style = here ? TableRow::Style::normal : TableRow::Style::failed,
                                      .command = command_of_row(b, method, scene)});
            }
        }
        return table;
    }

    /// A chart per machine and figure over the versions; none of a machine with one version.
    void add_history(Document& document) const {
        std::map<std::string, std::vector<std::size_t>> of_machine;
        for (std::size_t b = 0; b < batches_.size(); ++b) of_machine[batches_[b].place.machine].push_back(b);
        struct Kind {
            const char* title;
            double Figures::*figure;
            double scale;
        };
        for (const auto& [machine, versions] : of_machine) {
            if (versions.size() < 2) continue;
            for (const Kind& kind : {Kind{"worst penetration (mm)", &Figures::depth, mm},
                                     Kind{"false negatives", &Figures::false_negatives, 1.0},
                                     Kind{"tick p50 (µs)", &Figures::median_tick, us}}) {
                LineChart chart{.x_title = "version, in the order given", .y_title = kind.title, .small = true};
                for (const Method& method : methods_) {
                    LineChart::Line line{.name = method.label()};
                    for (std::size_t v = 0; v < versions.size(); ++v) {
                        const double value =
                            kind.scale * (figures_of(drafts_[versions[v]]->results, method).*kind.figure);
                        if (!std::isnan(value)) line.points.emplace_back(static_cast<double>(v + 1), value);
                    }
                    if (line.points.size() < 2) continue;
                    line.colour = line.dash = static_cast<int>(chart.lines.size());
                    chart.lines.push_back(std::move(line));
                }
                const std::string description = interactive(chart);
                if (description.empty()) continue;
                std::vector<std::string> order;
                for (const std::size_t b : versions) order.push_back(code(batches_[b].place.version));
                document.blocks.emplace_back(Figure{fmt::format("charts/history_{}.svg", document.blocks.size()),
                                                    draw(chart),
                                                    fmt::format("{} on {}: {} over the versions {}.", code(name_),
                                                                machine, kind.title, fmt::join(order, ", ")),
                                                    description});
            }
        }
    }

    std::string name_;
    const std::vector<Batch>& batches_;
    std::vector<std::unique_ptr<Draft>> drafts_;
    std::set<MethodOnScene> cells_;
    std::set<Method> methods_;  ///< of the cells
};

/// By study, in the order of the sources.
std::map<std::string, std::vector<Batch>> batches_of(const std::vector<std::vector<Record>>& sources) {
    std::map<std::string, std::vector<Batch>> studies;
    for (const std::vector<Record>& records : sources) {
        for (const Record& record : records) {
            std::vector<Batch>& batches = studies[record.spec.study];
            const Place place{machine_of(record), version_of(record)};
            auto batch = std::find_if(batches.begin(), batches.end(), [&place](const Batch& one) {
                return one.place.machine == place.machine && one.place.version == place.version;
            });
            if (batch == batches.end()) batch = batches.insert(batches.end(), {place, {}});
            batch->records.push_back(record);
        }
    }
    for (auto& [study, batches] : studies) {
        for (auto batch = batches.begin(); batch != batches.end(); ++batch) {
            batch->place.last = std::none_of(batch + 1, batches.end(), [&batch](const Batch& later) {
                return later.place.machine == batch->place.machine;
            });
            std::set<std::string> seen;
            for (const Record& record : batch->records) {
                const std::string run = run_id(record.spec);
                if (seen.insert(run).second) continue;
                throw InputError(fmt::format("study {}", study), "run " + run, "one record per machine and version",
                                 fmt::format("two of {}, version {}", batch->place.machine, batch->place.version));
            }
        }
    }
    return studies;
}

}  // namespace

std::map<std::string, std::string> make_board(const std::vector<std::vector<Record>>& sources) {
    const std::map<std::string, std::vector<Batch>> studies = batches_of(sources);
    Document document{.title = "trocar board", .blocks = {}, .page_filters = {"machine", "version"}};
    Table status = placed_table(
        "Studies by machine and version",
        {{"study", false}, {"", false}, {"ok", true}, {"failed", true}, {"missing", true}, {"excluded", true}});
    status.note =
        "Counts of a method on a scene. ok: every repetition ended well. failed: some did not. missing: no record, "
        "though "
        "another machine or version has one. excluded: absent, or does not support the scene. stale: not the last "
        "version "
        "of its machine.";
    std::vector<StudyBoard> boards;
    boards.reserve(studies.size());
    for (const auto& [name, batches] : studies) boards.emplace_back(name, batches);
    for (const StudyBoard& board : boards) board.add_status(status);
    document.blocks.emplace_back(std::move(status));
    for (const StudyBoard& board : boards) board.add_to(document);

    std::map<std::string, std::string> files;
    for (const Block& block : document.blocks) {
        if (const auto* figure = std::get_if<Figure>(&block)) files[figure->file] = figure->svg;
    }
    if (!files.empty()) {
        document.charts_js = fmt::format("{}/{}", own_assets, web::charts_name);
        files[document.charts_js] = web::charts_script();
    }
    files["index.html"] = to_html(document);
    return files;
}

}  // namespace trocar
