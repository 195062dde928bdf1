#include "report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <stdexcept>

#include "geometry/input_error.hpp"
#include "measure/metrics.hpp"
#include "measure/statistics.hpp"
#include "report/chart.hpp"
#include "report/document.hpp"
#include "report/figures.hpp"
#include "report/verdict.hpp"

namespace trocar {
namespace {

constexpr double us = 1.0e-3;  // ns to µs
constexpr double mm = 1.0e3;   // m to mm

std::string code(const std::string& text) { return text.empty() ? std::string() : "`" + text + "`"; }

std::string method_name(const std::string& text) { return text.substr(0, text.find(':')); }

std::string outcome_text(const Outcome& outcome) {
    std::string text(name_of(outcome.kind));
    if (!outcome.message.empty()) text += " (" + outcome.message + ")";
    return text;
}

std::string joined(const std::vector<std::string>& items) { return fmt::format("{}", fmt::join(items, ", ")); }

double summary_of(const Record& record, const std::string& key) {
    const auto found = record.summary.find(key);
    return found == record.summary.end() ? not_known : found->second;
}

/// "1.000" but "0.99987": a share that is not one never looks like one.
std::string share_text(double part, double whole) {
    if (std::isnan(part) || std::isnan(whole) || whole <= 0.0) return "n/a";
    if (part == whole) return "1";
    const double share = part / whole;
    for (int digits = 3; digits < 9; ++digits) {
        std::string text = fmt::format("{:.{}f}", share, digits);
        if (text.front() != '1') return text;
    }
    return fmt::format("{:.10f}", share);
}

std::string count_text(double value) { return std::isnan(value) ? "n/a" : fmt::format("{:.0f}", value); }

std::string yes_no(bool value) { return value ? "yes" : "no"; }

/// The common value of a fact over all records, or all values when they differ.
std::string common_fact(const std::vector<Record>& records, const std::string& key, bool* mixed = nullptr) {
    std::set<std::string> values;
    for (const Record& record : records) {
        const auto found = record.environment.find(key);
        if (found != record.environment.end()) values.insert(found->second);
    }
    if (values.size() > 1 && mixed != nullptr) *mixed = true;
    return fmt::format("{}", fmt::join(values, " | "));
}

class Composer {
public:
    explicit Composer(const std::vector<Record>& records) : records_(records), results_(records) {
        reference_ = common_fact(records, "study.reference");
        study_ = records.front().spec.study;
        mode_ = !results_.contestants("closed_loop").empty() ? "closed_loop" : "replay";
        document_.title = "trocar study " + code(study_);
    }

    Report compose() {
        const Verdict overall = make_verdict(results_, reference_, mode_, results_.scenes(mode_));
        page_one(overall);
        verdict_by_class();
        environment();
        fairness();
        frames();
        detection();
        latency();
        stages();
        contacts_and_forces();
        failures();
        thesis_table();
        work_profile();
        glossary();
        rebuild();

        Report report;
        for (const Block& block : document_.blocks) {
            if (const auto* figure = std::get_if<Figure>(&block)) report.files[figure->file] = figure->svg;
        }
        report.files["report.md"] = to_markdown(document_);
        report.files["report.html"] = to_html(document_);
        report.files["report.tex"] = to_latex(document_);
        report.files["results.csv"] = results_csv();
        report.page_one = terminal_text(overall);
        return report;
    }

private:
    void heading(int level, const std::string& text) { document_.blocks.emplace_back(Heading{level, text}); }
    void paragraph(const std::string& text, Paragraph::Style style = Paragraph::Style::normal) {
        document_.blocks.emplace_back(Paragraph{text, style});
    }
    void add(Table table) {
        if (!table.rows.empty()) document_.blocks.emplace_back(std::move(table));
    }
    void figure(const std::string& name, const std::string& svg, const std::string& caption) {
        if (!svg.empty()) document_.blocks.emplace_back(Figure{"charts/" + name + ".svg", svg, caption});
    }

    /// Scenes of the verdict's mode by class, classes in alphabetical order.
    [[nodiscard]] std::map<std::string, std::vector<std::string>> scenes_by_class() const {
        std::map<std::string, std::vector<std::string>> classes;
        for (const std::string& scene : results_.scenes(mode_)) {
            if (!results_.class_of(scene).empty()) classes[results_.class_of(scene)].push_back(scene);
        }
        return classes;
    }

    /// Most processes of one contestant, in runs of this mode or (empty) of any.
    [[nodiscard]] int most_processes(const std::string& mode = {}) const {
        std::int64_t most = 0;
        for (const Record& record : records_) {
            if (mode.empty() || record.spec.mode == mode) most = std::max(most, record.spec.repetition + 1);
        }
        return static_cast<int>(most);
    }

    /// The scenes that the quotable sentence speaks of: I2T where there is one, else the class with most scenes.
    [[nodiscard]] std::pair<std::string, std::vector<std::string>> headline_scenes() const {
        const auto classes = scenes_by_class();
        if (classes.empty()) return {};
        const auto tissue = classes.find("I2T");
        if (tissue != classes.end()) return {tissue->first, tissue->second};
        const auto most = std::max_element(classes.begin(), classes.end(), [](const auto& a, const auto& b) {
            return a.second.size() < b.second.size();
        });
        return {most->first, most->second};
    }

    [[nodiscard]] std::string interval_note(const std::string& mode) const {
        const int processes = most_processes(mode);
        if (processes >= processes_for_interval) {
            return fmt::format("Brackets: 95 % bootstrap interval of the median over {} processes.", processes);
        }
        if (processes > 1) {
            return fmt::format(
                "Brackets: minimum to maximum over {} processes (95 % intervals need {}); they are no confidence "
                "intervals.",
                processes, processes_for_interval);
        }
        return "One process per contestant here: no interval can be given.";
    }

    [[nodiscard]] std::string origin() const {
        std::string text = fmt::format("Study {}, commit {}, {}, seed {}, {} runs.", code(study_),
                                       code(common_fact(records_, "commit")), common_fact(records_, "cpu"),
                                       records_.front().spec.seed, records_.size());
        const std::string frames = frames_digest();
        if (!frames.empty()) text += " Frames " + code(frames) + ".";
        text += " This page from its records: " + code("trocar report reports/" + study_) +
                "; the records anew: " + code("trocar study " + common_fact(records_, "study.file")) + ".";
        return text;
    }

    /// One hash over the frame hashes of all replayed scenes, in order of their names.
    [[nodiscard]] std::string frames_digest() const {
        std::map<std::string, std::string> by_scene;
        for (const Record& record : records_) {
            if (!record.frames_hash.empty()) by_scene[record.spec.scene] = record.frames_hash;
        }
        if (by_scene.empty()) return {};
        std::uint64_t hash = 0xCBF29CE484222325ULL;
        for (const auto& [scene, frames] : by_scene) {
            for (const char c : scene + frames) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3ULL;
        }
        return fmt::format("{:016x}", hash);
    }

    void warnings() {
        if (common_fact(records_, "dirty").find("yes") != std::string::npos) {
            paragraph("The source tree had uncommitted changes: these numbers belong to no commit.",
                      Paragraph::Style::warning);
        }
        if (results_.noise_floor() > 1.25) {
            paragraph(fmt::format("Noisy machine: two processes of the same contestant differ by up to a factor {} in "
                                  "their medians (95 % of all pairs of processes). Smaller ratios mean nothing here.",
                                  format_number(results_.noise_floor())),
                      Paragraph::Style::warning);
        }
        bool mixed = false;
        for (const char* key : {"binary", "cpu", "kernel"}) (void)common_fact(records_, key, &mixed);
        if (mixed) {
            paragraph("The records come from more than one binary or machine; see the environment.",
                      Paragraph::Style::warning);
        }
    }

    void page_one(const Verdict& overall) {
        const auto [class_name, scenes] = headline_scenes();
        const Verdict headline = make_verdict(results_, reference_, mode_, scenes);
        sentence_ = verdict_sentence(headline, fmt::format("the {} scenes ({})", class_name, joined(headline.scenes)),
                                     reference_);
        if (!sentence_.empty()) paragraph(sentence_, Paragraph::Style::quote);
        warnings();
        if (overall.rows.empty()) {
            paragraph("No run of a detector or response could be made; see the failures and what is absent.");
            return;
        }
        Table table = verdict_table(overall, fmt::format("Verdict over all {} scenes", overall.scenes.size()),
                                    results_.noise_floor());
        table.note = verdict_note();
        add(std::move(table));
        figure("speed_error", verdict_chart(overall),
               "Speed against error over all scenes; numbers are the rows of the table. Colour: detector; shape: "
               "response; hollow: native contacts. Lines join settings of one method. An error of exactly 0 stands on "
               "its own band, since a logarithmic axis has no place for it.");
        paragraph(origin(), Paragraph::Style::small);
    }

    [[nodiscard]] std::string verdict_note() const {
        return "Rows are sorted by the depth left at worst, the fastest of equals first; † = another row is at least "
               "as "
               "fast and as good, and better in one of the two. Times are geometric means over the scenes of the "
               "medians (p50) and 99 % values (p99) of a tick; a row that failed on a scene has none. Depths: median "
               "over scenes / worst of all. " +
               interval_note(mode_) +
               fmt::format(
                   " Ratio: median tick over that of {} with the same response and canonical contacts, process "
                   "by process; ≈ = within the noise floor of {} (factor between processes of the same "
                   "contestant, 95 %). \"identical to\": the same motion, bit by bit. n/a = does not apply; "
                   "\"no reference\" = no reference solution in this study. The rule for the sentence: first own "
                   "against first foreign row.",
                   code(reference_), format_number(results_.noise_floor()));
    }

    void verdict_by_class() {
        const auto classes = scenes_by_class();
        if (classes.size() < 2) return;
        heading(2, "Verdict per class");
        for (const auto& [name, scenes] : classes) {
            const Verdict verdict = make_verdict(results_, reference_, mode_, scenes);
            add(verdict_table(verdict, fmt::format("{}: {}", name, joined(verdict.scenes)), results_.noise_floor()));
        }
        paragraph(
            "In I2I and I2R scenes the instruments are led by a simulated operator and pushed back by the contact; a "
            "scene whose bodies all follow a script has no depth of its own making, so it is n/a there. Columns as on "
            "page 1.",
            Paragraph::Style::small);
    }

    void environment() {
        heading(2, "Environment");
        Table table;
        table.columns = {{"fact", false}, {"value", false}};
        std::set<std::string> keys;
        for (const Record& record : records_) {
            for (const auto& [key, value] : record.environment) {
                const std::string head = key.substr(0, key.find('.'));
                if (head != "detector" && head != "response" && head != "absent" && head != "run") keys.insert(key);
            }
        }
        for (const std::string& key : keys) table.rows.push_back({.cells = {key, common_fact(records_, key)}});
        table.rows.push_back({.cells = {"processes per contestant", fmt::format("up to {}", most_processes())}});
        table.rows.push_back(
            {.cells = {"noise floor (factor)", format_number(results_.noise_floor()) +
                                                   ": 95 % of the ratios between medians of processes of the same "
                                                   "contestant on the same scene (A/A)"}});
        add(std::move(table));
    }

    void fairness() {
        heading(2, "Fairness manifest");
        paragraph(
            "Every method of this study with every setting it ran with. Methods run in an order shuffled by the seed, "
            "interleaved, each run in a fresh process, one thread.");
        struct Method {
            std::string kind;
            std::string text;
            const Record* record = nullptr;
        };
        std::map<std::pair<std::string, std::string>, const Record*> methods;
        for (const Record& record : records_) {
            if (!record.spec.detector.empty()) methods.try_emplace({"detector", record.spec.detector}, &record);
            if (!record.spec.response.empty()) methods.try_emplace({"response", record.spec.response}, &record);
        }
        const auto fact = [](const Record& record, const std::string& key) {
            const auto found = record.environment.find(key);
            return found == record.environment.end() ? std::string() : found->second;
        };
        Table table;
        table.caption = "Methods and their settings";
        table.columns = {{"kind", false},
                         {"method", false},
                         {"library", false},
                         {"build of the library", false},
                         {"all settings in force", false},
                         {"setting", false}};
        std::map<std::pair<std::string, std::string>, std::map<std::string, std::vector<std::string>>> by_name;
        for (const auto& [key, record] : methods) {
            const std::string prefix = key.first + ".";
            const std::string absent = fact(*record, prefix + "absent");
            const std::string setting = fact(*record, prefix + "setting");
            const std::string basis = fact(*record, prefix + "basis");
            by_name[{key.first, method_name(key.second)}][setting.empty() ? "default" : setting].push_back(
                code(key.second) + (basis.empty() ? "" : ": " + basis));
            const std::string library = fact(*record, prefix + "library") + " " + fact(*record, prefix + "version");
            const std::string settings = fact(*record, prefix + "settings");
            table.rows.push_back(
                {.cells = {key.first, code(key.second), absent.empty() ? library : "absent (" + absent + ")",
                           fact(*record, prefix + "configuration"), settings.empty() ? "none declared" : settings,
                           setting.empty() ? "default" : setting}});
        }
        add(std::move(table));
        Table columns;
        columns.caption = "Default, recommended and tuned settings";
        columns.columns = {{"kind", false},
                           {"method", false},
                           {"default", false},
                           {"recommended", false},
                           {"tuned (search and budget)", false}};
        for (const auto& [key, settings] : by_name) {
            const auto cell = [&settings](const std::string& name, const char* none) {
                const auto found = settings.find(name);
                return found == settings.end() ? std::string(none) : fmt::format("{}", fmt::join(found->second, "; "));
            };
            columns.rows.push_back({.cells = {key.first, code(key.second), cell("default", "not run"),
                                              cell("recommended", "not run"), cell("tuned", "not tuned")}});
        }
        add(std::move(columns));
        Table absent;
        absent.caption = "Methods that this build lacks";
        absent.columns = {{"kind", false}, {"method", false}, {"reason", false}};
        std::map<std::pair<std::string, std::string>, std::string> reasons;
        for (const Record& record : records_) {
            for (const auto& [key, reason] : record.environment) {
                if (key.rfind("absent.", 0) != 0) continue;
                const std::size_t dot = key.find('.', 7);
                reasons[{key.substr(7, dot - 7), key.substr(dot + 1)}] = reason;
            }
        }
        for (const auto& [key, reason] : reasons) {
            absent.rows.push_back({.cells = {key.first, code(key.second), reason}});
        }
        if (absent.rows.empty()) paragraph("No method known to this build is absent from it.");
        add(std::move(absent));
    }

    void frames() {
        const std::vector<std::string> scenes = results_.scenes("replay");
        if (scenes.empty()) return;
        heading(2, "Frames");
        Table table;
        table.caption = "Replayed scenes: every detector must have seen the same bits";
        table.columns = {{"scene", false},       {"class", false},
                         {"ticks", true},        {"scene hash", false},
                         {"frames hash", false}, {"same for all detectors and processes", false}};
        for (const std::string& scene : scenes) {
            std::set<std::string> hashes;
            std::set<std::string> scene_hashes;
            std::set<std::int64_t> ticks;
            for (const Record& record : records_) {
                if (record.spec.scene != scene || record.spec.mode != "replay") continue;
                if (!record.frames_hash.empty() && record.outcome.ok()) hashes.insert(record.frames_hash);
                if (!record.spec.scene_hash.empty()) scene_hashes.insert(record.spec.scene_hash);
                ticks.insert(record.spec.ticks);
            }
            table.rows.push_back({.cells = {scene, results_.class_of(scene).empty() ? "n/a" : results_.class_of(scene),
                                            fmt::format("{}", fmt::join(ticks, " | ")),
                                            code(fmt::format("{}", fmt::join(scene_hashes, " | "))),
                                            code(fmt::format("{}", fmt::join(hashes, " | "))),
                                            hashes.empty() ? "n/a" : yes_no(hashes.size() == 1)}});
            if (hashes.size() > 1) table.rows.back().style = TableRow::Style::failed;
        }
        add(std::move(table));
    }

    struct PairSums {
        double truth = 0.0;
        double touch = 0.0;
        double missing = 0.0;
        double missing_touch = 0.0;
        double extra = 0.0;
        bool known = false;
        void take(const SceneResult& result) {
            const double value = result.first(&RunFigures::true_pairs);
            if (std::isnan(value)) return;
            known = true;
            truth += value;
            touch += result.first(&RunFigures::true_touch);
            missing += result.first(&RunFigures::missing);
            missing_touch += result.first(&RunFigures::missing_touch);
            extra += result.first(&RunFigures::extra);
        }
        [[nodiscard]] double found() const { return truth - missing; }
    };

    static std::vector<std::string> pair_cells(const PairSums& sums) {
        if (!sums.known) return {"n/a", "n/a", "n/a", "n/a", "n/a", "n/a", "n/a"};
        const double reported = sums.found() + sums.extra;
        const double firm = sums.truth - sums.touch;
        const double firm_found = firm - (sums.missing - sums.missing_touch);
        return {count_text(sums.truth),
                count_text(sums.touch),
                share_text(sums.found(), reported),
                share_text(sums.found(), sums.truth),
                share_text(firm_found, firm),
                share_text(2.0 * sums.found(), sums.truth + reported),
                count_text(sums.missing) + " / " + count_text(sums.extra)};
    }

    void detection() {
        const std::vector<Contestant> detectors = results_.contestants("replay");
        const std::vector<std::string> scenes = results_.scenes("replay");
        if (detectors.empty()) return;
        heading(2, "Detection against the exact oracle");
        paragraph(
            "Replay: the same frames for every detector. Truth is decided by exact arithmetic on the frame's own "
            "doubles; pairs that only touch in a vertex or an edge count, and recall is given with and without them.");
        const std::vector<Column> pair_columns{
            {"true pairs", true},    {"of these touching", true},      {"precision", true},
            {"recall", true},        {"recall without touches", true}, {"F1", true},
            {"missed / extra", true}};
        Table table;
        table.caption = "All replayed scenes together";
        table.columns = {{"detector", false}};
        table.columns.insert(table.columns.end(), pair_columns.begin(), pair_columns.end());
        table.columns.push_back({"scenes ok", true});
        table.columns.push_back({"same pairs in every process", false});
        Table by_scene;
        by_scene.caption = "The same per scene";
        by_scene.folded = true;
        by_scene.columns = {{"scene", false}, {"detector", false}};
        by_scene.columns.insert(by_scene.columns.end(), pair_columns.begin(), pair_columns.end());
        Table matrix;
        matrix.caption = "Scene × detector: ok, or what went wrong";
        matrix.columns = {{"scene", false}};
        for (const Contestant& detector : detectors) {
            PairSums sums;
            int ok = 0;
            int planned = 0;
            bool repeatable = true;
            for (const std::string& scene : scenes) {
                const SceneResult* result = results_.find(detector, scene);
                if (result == nullptr || result->not_applicable()) continue;
                ++planned;
                ok += result->ok() ? 1 : 0;
                sums.take(*result);
                repeatable = repeatable && result->repeatable();
            }
            std::vector<std::string> cells{code(detector.detector)};
            const std::vector<std::string> pairs = pair_cells(sums);
            cells.insert(cells.end(), pairs.begin(), pairs.end());
            cells.push_back(fmt::format("{} of {}", ok, planned));
            cells.push_back(most_processes() < 2 ? "n/a (one process)" : yes_no(repeatable));
            table.rows.push_back({.cells = cells});
            matrix.columns.push_back({code(detector.detector), false});
        }
        for (const std::string& scene : scenes) {
            std::vector<std::string> verdicts{scene};
            for (const Contestant& detector : detectors) {
                const SceneResult* result = results_.find(detector, scene);
                PairSums sums;
                if (result != nullptr) sums.take(*result);
                verdicts.push_back(result == nullptr ? "not run" : case_text(*result, sums));
                if (result == nullptr || result->not_applicable()) continue;
                std::vector<std::string> cells{scene, code(detector.detector)};
                const std::vector<std::string> pairs = pair_cells(sums);
                cells.insert(cells.end(), pairs.begin(), pairs.end());
                by_scene.rows.push_back({.cells = cells});
            }
            matrix.rows.push_back({.cells = verdicts});
        }
        add(std::move(table));
        add(std::move(matrix));
        add(std::move(by_scene));
        figure("detection_time", detection_chart(detectors, scenes),
               "Time per tick of each detector (update + detect) per scene: mark = median, whisker to the 99 % value "
               "where there are 1000 ticks. Red: 1 ms.");
    }

    static std::string case_text(const SceneResult& result, const PairSums& sums) {
        for (const RunFigures& run : result.runs) {
            if (!run.ok()) return outcome_text(run.record->outcome);
        }
        if (!sums.known) return "not judged";
        if (sums.missing == 0.0 && sums.extra == 0.0) return "ok";
        std::string text;
        if (sums.missing > 0.0) text += fmt::format("misses {:.0f} of {:.0f}", sums.missing, sums.truth);
        if (sums.extra > 0.0) text += (text.empty() ? "" : ", ") + fmt::format("adds {:.0f}", sums.extra);
        return text;
    }

    [[nodiscard]] std::string detection_chart(const std::vector<Contestant>& detectors,
                                              const std::vector<std::string>& scenes) const {
        DotChart chart;
        chart.x_title = "time per tick (µs), update + detect";
        chart.x_limit = 1000.0;
        chart.x_limit_name = "1 ms";
        chart.categories = scenes;
        int style = 0;
        for (const Contestant& detector : detectors) {
            DotChart::Series series;
            series.name = detector.detector;
            series.style = {.colour = style, .shape = style};
            ++style;
            for (const std::string& scene : scenes) {
                const SceneResult* result = results_.find(detector, scene);
                if (result == nullptr || !result->ok()) {
                    series.dots.emplace_back();
                    continue;
                }
                const double p50 = result->of(&RunFigures::tick_p50).value * us;
                const double p99 = result->of(&RunFigures::tick_p99).value * us;
                series.dots.emplace_back(DotChart::Dot{
                    .value = p50,
                    .upper = p99,
                    .name = fmt::format("{} on {}: median {} µs, p99 {}", detector.detector, scene, format_number(p50),
                                        std::isnan(p99) ? "n too small" : format_number(p99) + " µs")});
            }
            chart.series.push_back(std::move(series));
        }
        return draw(chart);
    }

    Table latency_table(const std::string& mode) {
        Table table;
        table.columns = {{"scene", false},
                         {mode == "replay" ? "detector" : "detector + response (contact source)", false},
                         {"n per process (ticks)", true},
                         {"p50 (µs)", true},
                         {"p90 (µs)", true},
                         {"p99 (µs)", true},
                         {"max (µs)", true},
                         {"first contact (µs)", true},
                         {"misses at 1 ms", true},
                         {"longest burst (ticks)", true},
                         {"work, max / median", true},
                         {"allocations per tick", true}};
        table.folded = true;
        for (const std::string& scene : results_.scenes(mode)) {
            for (const Contestant& contestant : results_.contestants(mode)) {
                const SceneResult* result = results_.find(contestant, scene);
                if (result == nullptr || !result->ok()) continue;
                const auto time = [result](double RunFigures::*figure) {
                    return estimate_text(result->of(figure), us);
                };
                const Estimate p99 = result->of(&RunFigures::tick_p99);
                double misses = 0.0;
                double ticks = 0.0;
                double burst = 0.0;
                for (const RunFigures& run : result->runs) {
                    misses += run.deadline_misses;
                    ticks += run.timed_ticks;
                    burst = std::max(burst, run.longest_burst);
                }
                const double work = result->first(&RunFigures::work_max) / result->first(&RunFigures::work_p50);
                const double largest = result->of(&RunFigures::tick_max).high;
                table.rows.push_back(
                    {.cells = {scene, code(contestant.label()), count_text(result->first(&RunFigures::timed_ticks)),
                               time(&RunFigures::tick_p50), time(&RunFigures::tick_p90),
                               std::isnan(p99.value) ? "n too small" : estimate_text(p99, us),
                               format_number(largest * us), time(&RunFigures::tick_cold),
                               fmt::format("{:.0f} of {:.0f}", misses, ticks), count_text(burst),
                               std::isfinite(work) ? format_number(work) : "n/a",
                               format_number(result->first(&RunFigures::allocations))}});
            }
        }
        return table;
    }

    void latency() {
        heading(2, "Haptic table");
        paragraph("Latency of single ticks in the back-to-back loop. " + interval_note("") +
                  " p99 needs 1000 ticks, p99.9 a hundred thousand: a long study. The paced 1 kHz loop is not part of "
                  "this study: misses here are ticks that took longer than 1 ms. First contact: the first tick with a "
                  "pair, warm-up or not. \"max\" is the machine's too: judge a method by its work column.");
        Table replay = latency_table("replay");
        replay.caption = "Detectors (update + detect)";
        replay.folded = false;
        add(std::move(replay));
        Table closed = latency_table("closed_loop");
        closed.caption = "Whole ticks in the closed loop";
        add(std::move(closed));
    }

    void stages() {
        Table table;
        table.caption = "Median time per stage, mean over the scenes (µs)";
        table.columns = {{"detector + response (contact source)", false}};
        BarChart chart;
        chart.x_title = "median time per stage, mean over the scenes (µs)";
        for (const char* name : stage_names) {
            table.columns.push_back({name, true});
            chart.parts.emplace_back(name);
        }
        table.columns.push_back({"sum (µs)", true});
        for (const std::string mode : {"closed_loop", "replay"}) {
            for (const Contestant& contestant : results_.contestants(mode)) {
                std::array<std::vector<double>, stage_count> values;
                bool failed = false;
                for (const std::string& scene : results_.scenes(mode)) {
                    const SceneResult* result = results_.find(contestant, scene);
                    if (result == nullptr || result->not_applicable()) continue;
                    failed = failed || !result->ok();
                    for (std::size_t s = 0; s < stage_count; ++s) {
                        std::vector<double> by_process;
                        for (const RunFigures& run : result->runs) by_process.push_back(run.stage_p50.at(s));
                        const double value = across_processes(by_process).value;
                        if (!std::isnan(value)) values.at(s).push_back(value * us);
                    }
                }
                BarChart::Bar bar{.name = contestant.label(), .parts = {}};
                std::vector<std::string> cells{code(contestant.label()) + (mode == "replay" ? " (replay)" : "")};
                double sum = 0.0;
                for (const auto& stage : values) {
                    const double mean = stage.empty() ? not_known
                                                      : std::accumulate(stage.begin(), stage.end(), 0.0) /
                                                            static_cast<double>(stage.size());
                    bar.parts.push_back(mean);
                    sum += std::isnan(mean) ? 0.0 : mean;
                    cells.push_back(format_number(mean));
                }
                if (sum == 0.0) continue;
                cells.push_back(format_number(sum) + (failed ? " (some scenes failed)" : ""));
                table.rows.push_back({.cells = std::move(cells)});
                if (mode == mode_) chart.bars.push_back(std::move(bar));
            }
        }
        if (table.rows.empty()) return;
        heading(2, "Stage split");
        table.note =
            "n/a: the stage does not exist in that kind of run. move and derive are the same code for every method; "
            "derive runs even where native contacts are used, so that both can be judged. A stage that exists only in "
            "some scenes (advance needs tissue) is averaged over those.";
        if (!chart.bars.empty()) {
            figure("stages", draw(chart), "Where the time of a tick goes; numbers in the table below.");
        }
        add(std::move(table));
    }

    void contacts_and_forces() {
        const std::vector<Contestant> contestants = results_.contestants("closed_loop");
        if (contestants.empty()) return;
        heading(2, "Contacts, depth and force");
        Table depth;
        depth.caption = "Depth error of contacts on the frame that detect saw: canonical beside native";
        depth.columns = {{"detector", false},
                         {"canonical, median / worst (mm)", true},
                         {"native, median / worst (mm)", true},
                         {"native contacts per tick", true}};
        std::set<std::string> detectors;
        for (const Contestant& contestant : contestants) detectors.insert(contestant.detector);
        for (const std::string& detector : detectors) {
            std::vector<std::string> cells{code(detector)};
            double native_contacts = not_known;
            for (const std::string source : {"canonical", "native"}) {
                std::vector<double> medians;
                double worst = not_known;
                for (const Contestant& contestant : contestants) {
                    if (contestant.detector != detector || contestant.contacts != source) continue;
                    for (const std::string& scene : results_.scenes("closed_loop")) {
                        const SceneResult* result = results_.find(contestant, scene);
                        if (result == nullptr || !result->ok()) continue;
                        const double median_error = result->first(&RunFigures::depth_error_p50);
                        if (std::isnan(median_error)) continue;
                        medians.push_back(median_error);
                        const double error = result->first(&RunFigures::depth_error_max);
                        worst = std::isnan(worst) ? error : std::max(worst, error);
                        if (source == "native") {
                            const double mean = result->first(&RunFigures::native_mean);
                            if (!std::isnan(mean)) {
                                native_contacts = std::isnan(native_contacts) ? mean : std::max(native_contacts, mean);
                            }
                        }
                    }
                }
                const double value = quantile(medians, 0.5);
                cells.push_back(std::isnan(value) ? (source == "native" ? "n/a" : "not judged")
                                                  : format_number(value * mm) + " / " + format_number(worst * mm));
            }
            cells.push_back(format_number(native_contacts));
            depth.rows.push_back({.cells = cells});
        }
        if (std::all_of(depth.rows.begin(), depth.rows.end(),
                        [](const TableRow& row) { return row.cells.back() == "n/a"; })) {
            depth.columns.pop_back();
            for (TableRow& row : depth.rows) row.cells.pop_back();
        }
        depth.note =
            "Per tick: the worst |depth that a contact states - true depth at the contact's point|. Median over ticks "
            "and scenes / worst of all. Depths of the libraries refer to infinite planes of triangles and are often "
            "large on purpose; the error says how far they are from geometric depth, not that the library is broken.";
        add(std::move(depth));

        Table force;
        force.caption = "Outcome of every closed-loop run (first process)";
        force.folded = true;
        force.columns = {{"scene", false},
                         {"detector + response (contact source)", false},
                         {"pairs per tick, mean / max", true},
                         {"left, median / max / last (mm)", true},
                         {"largest force (N)", true},
                         {"force jump, p99 / max (N per tick)", true},
                         {"force flips (ticks)", true},
                         {"largest strain", true},
                         {"ruptures", true},
                         {"same state in every process", false}};
        for (const std::string& scene : results_.scenes("closed_loop")) {
            std::map<std::string, std::string> seen;  // state hash -> label
            for (const Contestant& contestant : contestants) {
                const SceneResult* result = results_.find(contestant, scene);
                if (result == nullptr || !result->ok()) continue;
                const RunFigures& f = result->runs.front();
                const std::string same = result->runs.size() < 2 ? "n/a (one process)" : yes_no(result->repeatable());
                const std::string& hash = f.record->state_hash;
                const auto twin = hash.empty() ? seen.end() : seen.find(contestant.response + hash);
                if (twin != seen.end()) {
                    force.rows.push_back({.cells = {scene, code(contestant.label()),
                                                    format_number(f.pairs_mean) + " / " + count_text(f.pairs_max),
                                                    "identical to " + code(twin->second), "", "", "", "", "", same}});
                    continue;
                }
                if (!hash.empty()) seen.emplace(contestant.response + hash, contestant.label());
                force.rows.push_back(
                    {.cells = {scene, code(contestant.label()),
                               format_number(f.pairs_mean) + " / " + count_text(f.pairs_max),
                               std::isnan(f.left_max)
                                   ? "n/a"
                                   : format_number(f.left_p50 * mm) + " / " + format_number(f.left_max * mm) + " / " +
                                         format_number(f.left_last * mm),
                               format_number(f.force_max),
                               (std::isnan(f.force_jump_p99) ? "n too small" : format_number(f.force_jump_p99)) +
                                   " / " + format_number(f.force_jump_max),
                               count_text(f.force_flips), format_number(f.strain_max), count_text(f.ruptures), same}});
            }
        }
        add(std::move(force));
        course_charts(contestants);
    }

    /// Depth left and tool force over time on the scene of the headline class where most is left.
    void course_charts(const std::vector<Contestant>& contestants) {
        const auto [class_name, scenes] = headline_scenes();
        std::string chosen;
        double most = -1.0;
        for (const std::string& scene : scenes) {
            for (const Contestant& contestant : contestants) {
                const SceneResult* result = results_.find(contestant, scene);
                if (result == nullptr || !result->ok()) continue;
                if (result->first(&RunFigures::left_max) > most) {
                    most = result->first(&RunFigures::left_max);
                    chosen = scene;
                }
            }
        }
        if (chosen.empty()) return;
        LineChart depth{.x_title = "time (s), " + chosen, .y_title = "left after the tick (mm)", .lines = {}};
        LineChart force{.x_title = "time (s), " + chosen, .y_title = "tool force (N)", .lines = {}};
        std::set<std::string> seen;
        int style = 0;
        for (const Contestant& contestant : contestants) {
            const SceneResult* result = results_.find(contestant, chosen);
            if (result == nullptr || !result->ok()) continue;
            const Record& record = *result->runs.front().record;
            if (!record.state_hash.empty() && !seen.insert(contestant.response + record.state_hash).second) continue;
            LineChart::Line line{.name = contestant.label(), .colour = style, .dash = style / 8, .points = {}};
            ++style;
            LineChart::Line force_line = line;
            // At most 250 points a line: the largest value of each stretch, so that no peak is lost.
            const std::size_t stretch = std::max<std::size_t>(1, record.rows.size() / 250);
            for (std::size_t from = 0; from < record.rows.size(); from += stretch) {
                double largest_depth = not_known;
                double largest_force = not_known;
                for (std::size_t i = from; i < std::min(from + stretch, record.rows.size()); ++i) {
                    const StepRow& row = record.rows[i];
                    if (std::isfinite(row.max_depth)) largest_depth = std::fmax(largest_depth, row.max_depth * mm);
                    if (row.tool_force.allFinite()) largest_force = std::fmax(largest_force, row.tool_force.norm());
                }
                if (!std::isnan(largest_depth)) line.points.emplace_back(record.rows[from].time, largest_depth);
                if (!std::isnan(largest_force)) force_line.points.emplace_back(record.rows[from].time, largest_force);
            }
            depth.lines.push_back(std::move(line));
            force.lines.push_back(std::move(force_line));
        }
        const std::string rule = " on " + code(chosen) + ", the " + class_name +
                                 " scene where most is left. One line per different motion: contestants with identical "
                                 "motion share one. Largest value of each stretch of ticks.";
        figure("depth_over_time", draw(depth), "Interpenetration left" + rule);
        figure("force_over_time", draw(force), "Tool force" + rule);
    }

    void failures() {
        heading(2, "Failures");
        struct Key {
            std::string mode;
            std::string who;
            std::string scene;
            std::string outcome;
            auto operator<=>(const Key&) const = default;
        };
        std::map<Key, int> failed;
        std::map<Key, int> not_run;
        std::map<Key, int> truncated;
        for (const RunFigures& run : results_.runs()) {
            const RunSpec& spec = run.record->spec;
            const Contestant contestant{spec.mode, spec.detector, spec.response, spec.contacts};
            const Key key{spec.mode, contestant.label(), spec.scene.empty() ? "all scenes" : spec.scene,
                          outcome_text(run.record->outcome)};
            const OutcomeKind kind = run.record->outcome.kind;
            if (kind == OutcomeKind::absent || kind == OutcomeKind::unsupported) {
                ++not_run[key];
            } else if (kind != OutcomeKind::ok) {
                ++failed[key];
            } else if (run.truncated_ticks > 0.0) {
                ++truncated[{key.mode, key.who, key.scene, fmt::format("{:.0f} ticks truncated", run.truncated_ticks)}];
            }
        }
        if (failed.empty()) {
            paragraph(
                fmt::format("No run failed: none of {} crashed, threw, timed out, became unstable or ended on a "
                            "number that is not finite.",
                            records_.size()));
        }
        const auto table_of = [](const std::string& caption, const std::map<Key, int>& entries) {
            Table table;
            table.caption = caption;
            table.columns = {
                {"kind of run", false}, {"contestant", false}, {"scene", false}, {"outcome", false}, {"runs", true}};
            for (const auto& [key, count] : entries) {
                table.rows.push_back(
                    {.cells = {key.mode, code(key.who), key.scene, key.outcome, std::to_string(count)}});
            }
            return table;
        };
        Table table = table_of("Failed runs", failed);
        for (TableRow& row : table.rows) row.style = TableRow::Style::failed;
        add(std::move(table));
        add(table_of("Answers cut by a limit (\"unknown\", never \"free\")", truncated));
        add(table_of("Not run: neither a failure nor a zero", not_run));
    }

    void thesis_table() {
        std::vector<const Record*> runs;
        for (const Record& record : records_) {
            if (record.spec.mode == "triangle_pair" && record.outcome.ok()) runs.push_back(&record);
        }
        if (runs.empty()) return;
        heading(2, "The thesis' own table");
        paragraph(
            "Time of the response per triangle pair and per iteration (tick), without and with the triangle-triangle "
            "test. \"Without\": the response alone with the intersections given. \"With\": the test inside the span. "
            "2005: figures 5.1 to 5.6 and § 5.2 of the thesis (dual Xeon 2.80 GHz, Windows 2000, Visual C++ .NET).");
        struct Figure2005 {
            const char* pair_class;
            double pair_without;
            double iteration_without;
            double pair_with;
            double iteration_with;
        };
        static constexpr std::array<Figure2005, 3> published{{{"I2I", 0.034, 0.124, 0.039, 0.236},
                                                              {"I2R", 0.030, 2.845, 0.031, 1.938},
                                                              {"I2T", 0.032, 1.416, 0.034, 1.495}}};
        Table table;
        table.columns = {{"class", false},
                         {"scene", false},
                         {"response", false},
                         {"pairs per iteration", true},
                         {"per pair, without (µs)", true},
                         {"per pair, with (µs)", true},
                         {"per iteration, without: p50 / p99 (µs)", true},
                         {"per iteration, with: p50 / p99 (µs)", true}};
        for (const Figure2005& old : published) {
            table.rows.push_back(
                {.cells = {old.pair_class, "2005 (published)", "thesis",
                           fmt::format("{} | {} (derived)", format_number(old.iteration_without / old.pair_without),
                                       format_number(old.iteration_with / old.pair_with)),
                           format_number(old.pair_without * 1e3), format_number(old.pair_with * 1e3),
                           format_number(old.iteration_without * 1e3) + " (mean)",
                           format_number(old.iteration_with * 1e3) + " (mean)"},
                 .style = TableRow::Style::dominated});
            std::map<std::pair<std::string, std::string>, std::vector<const Record*>> groups;
            for (const Record* record : runs) {
                if (record->spec.pair_class == old.pair_class) {
                    groups[{record->spec.scene, record->spec.response}].push_back(record);
                }
            }
            for (const auto& [key, group] : groups) {
                const auto cell = [&group](const std::string& name, double scale) {
                    std::vector<double> values;
                    for (const Record* record : group) values.push_back(summary_of(*record, name));
                    const Estimate estimate = across_processes(values);
                    return estimate_text(estimate, scale);
                };
                const auto tail = [&cell](const std::string& name) {
                    const std::string text = cell(name, us);
                    return text == "n/a" ? std::string("n too small") : text;
                };
                table.rows.push_back(
                    {.cells = {
                         old.pair_class, key.first, code(key.second), cell("pairs_per_iteration", 1.0),
                         cell("without_per_pair_median_ns", us), cell("with_per_pair_median_ns", us),
                         cell("without_per_iteration_median_ns", us) + " / " + tail("without_per_iteration_p99_ns"),
                         cell("with_per_iteration_median_ns", us) + " / " + tail("with_per_iteration_p99_ns")}});
            }
        }
        table.note =
            "The published runs with and without the test were different workloads (pairs per iteration, derived from "
            "the thesis' own means, differ), so its two columns cannot be subtracted. 1.4 to 2.8 ms per iteration does "
            "not meet the 1 ms of a haptic loop that the thesis claims.";
        add(std::move(table));
    }

    void work_profile() {
        const std::vector<Contestant> detectors = results_.contestants("replay");
        const std::vector<std::string> scenes = results_.scenes("replay");
        if (detectors.size() < 2) return;
        LineChart chart{.x_title = "factor over the fastest detector of the scene",
                        .y_title = "share of scenes",
                        .lines = {},
                        .steps = true,
                        .log_x = true};
        std::map<std::string, double> best;
        std::set<std::string> judged;
        for (const std::string& scene : scenes) {
            double fastest = std::numeric_limits<double>::infinity();
            for (const Contestant& detector : detectors) {
                const SceneResult* result = results_.find(detector, scene);
                if (result == nullptr || !result->ok()) continue;
                fastest = std::min(fastest, result->of(&RunFigures::tick_p50).value);
            }
            if (!std::isfinite(fastest)) continue;
            best[scene] = fastest;
            judged.insert(scene);
        }
        if (judged.empty()) return;
        double widest = 1.0;
        std::vector<std::vector<double>> factors;
        for (const Contestant& detector : detectors) {
            std::vector<double> list;
            for (const std::string& scene : judged) {
                const SceneResult* result = results_.find(detector, scene);
                if (result == nullptr || !result->ok()) continue;
                list.push_back(result->of(&RunFigures::tick_p50).value / best.at(scene));
                widest = std::max(widest, list.back());
            }
            std::sort(list.begin(), list.end());
            factors.push_back(std::move(list));
        }
        for (std::size_t d = 0; d < detectors.size(); ++d) {
            // A detector that was not planned on every scene has no share of them.
            if (std::any_of(judged.begin(), judged.end(),
                            [&](const std::string& scene) { return results_.find(detectors[d], scene) == nullptr; })) {
                continue;
            }
            LineChart::Line line{.name = detectors[d].detector,
                                 .colour = static_cast<int>(d),
                                 .dash = static_cast<int>(d) % 4,
                                 .points = {{1.0, 0.0}}};
            double share = 0.0;
            for (const double factor : factors[d]) {
                share += 1.0 / static_cast<double>(judged.size());
                line.points.emplace_back(factor, share);
            }
            line.points.emplace_back(widest * 1.2, share);
            chart.lines.push_back(std::move(line));
        }
        heading(2, "Performance profile");
        figure("profile", draw(chart),
               "Dolan–Moré profile of the detectors: share of the replayed scenes on which a detector's median tick is "
               "within a factor of the fastest; a failed run counts as infinitely slow. The order among detectors that "
               "are not the best can change when the best is removed.");
    }

    void glossary() {
        heading(2, "What the words mean");
        Table table;
        table.caption = "Columns of results.csv";
        table.columns = {{"column", false}, {"meaning", false}};
        table.folded = true;
        for (const FigureColumn& column : figure_columns()) {
            table.rows.push_back({.cells = {code(std::string(column.key)), std::string(column.meaning)}});
        }
        const std::set<std::string> used = summary_keys();
        for (const SummaryFigure& figure : summary_figures()) {
            if (!used.contains(figure.name)) continue;
            table.rows.push_back(
                {.cells = {code(figure.name), figure.meaning + (figure.unit == "1" ? "" : " (" + figure.unit + ")")}});
        }
        add(std::move(table));
        paragraph(
            "n/a: the figure does not apply. 0: it applies and is exactly zero. n too small: too few ticks for the "
            "quantile. absent, unsupported: not run, with the reason under Failures. Every other outcome than ok is a "
            "failure: it stays in every table and has no time. Quantiles are linear between order statistics (type 7 "
            "of "
            "Hyndman and Fan). Touch: triangles that share points but do not pass through each other.");
    }

    void rebuild() {
        heading(2, "Files and how to rebuild");
        document_.blocks.emplace_back(CodeBlock{
            fmt::format("trocar report DIR    # this report from DIR/records.jsonl, byte for byte\n"
                        "trocar study {}    # the records: other times on another machine, same pairs and motion",
                        common_fact(records_, "study.file"))});
        paragraph(
            "`records.jsonl`: every run with its specification, environment and every tick. `results.csv`: one row per "
            "run. `report.tex`: the tables for LaTeX. `charts/`: the drawings.");
    }

    [[nodiscard]] std::set<std::string> summary_keys() const {
        std::set<std::string> keys;
        for (const Record& record : records_) {
            for (const auto& [key, value] : record.summary) keys.insert(key);
        }
        for (const FigureColumn& column : figure_columns()) keys.erase(std::string(column.key));
        return keys;
    }

    [[nodiscard]] std::string results_csv() const {
        std::string csv =
            "study,mode,scene,class,detector,response,contacts,setting,repetition,seed,ticks,outcome,message,"
            "scene_hash,frames_hash,state_hash";
        const std::set<std::string> keys = summary_keys();
        for (const FigureColumn& column : figure_columns()) csv += "," + std::string(column.key);
        for (const std::string& key : keys) csv += "," + csv_field(key);
        csv += "\n";
        for (const RunFigures& run : results_.runs()) {
            const Record& record = *run.record;
            const RunSpec& spec = record.spec;
            for (const std::string& text : {spec.study, spec.mode, spec.scene, spec.pair_class, spec.detector,
                                            spec.response, spec.contacts, spec.setting}) {
                csv += csv_field(text) + ",";
            }
            csv += fmt::format("{},{},{},{},{},{},{},{}", spec.repetition, spec.seed, spec.ticks,
                               name_of(record.outcome.kind), csv_field(record.outcome.message), spec.scene_hash,
                               record.frames_hash, record.state_hash);
            const bool measured = !record.rows.empty();
            for (const FigureColumn& column : figure_columns()) {
                csv += "," + (measured ? format_exact(column.of(run)) : std::string());
            }
            for (const std::string& key : keys) csv += "," + format_exact(summary_of(record, key));
            csv += "\n";
        }
        return csv;
    }

    [[nodiscard]] std::string terminal_text(const Verdict& verdict) const {
        std::string text;
        if (!sentence_.empty()) {
            std::string plain = sentence_;
            plain.erase(std::remove(plain.begin(), plain.end(), '`'), plain.end());
            text += plain + "\n\n";
        }
        const Table table = verdict_table(verdict, "", results_.noise_floor());
        // What fits a terminal; the columns are found by their headers.
        constexpr std::array<const char*, 10> wanted{"row",
                                                     "detector",
                                                     "response",
                                                     "contact source",
                                                     "pairs missed / extra of true",
                                                     "left after the tick, median / max (mm)",
                                                     "tick p50 (µs)",
                                                     "tick p99 (µs)",
                                                     "ratio to ",
                                                     "failures"};
        constexpr std::array<const char*, 10> short_names{
            "row",           "detector",      "response", "contacts", "missed / extra of true", "left p50 / max (mm)",
            "tick p50 (µs)", "tick p99 (µs)", "ratio",    "failures"};
        std::vector<std::size_t> shown;
        std::vector<std::string> headers;
        for (std::size_t w = 0; w < wanted.size(); ++w) {
            for (std::size_t c = 0; c < table.columns.size(); ++c) {
                if (table.columns[c].header.rfind(wanted.at(w), 0) != 0) continue;
                shown.push_back(c);
                headers.emplace_back(short_names.at(w));
            }
        }
        std::vector<std::vector<std::string>> lines{headers};
        for (const TableRow& row : table.rows) {
            std::vector<std::string> line;
            for (const std::size_t column : shown) {
                std::string cell = row.cells.at(column);
                cell.erase(std::remove(cell.begin(), cell.end(), '`'), cell.end());
                line.push_back(std::move(cell));
            }
            lines.push_back(std::move(line));
        }
        std::vector<std::size_t> widths(shown.size());
        const auto width_of = [](const std::string& cell) {
            return static_cast<std::size_t>(std::count_if(
                cell.begin(), cell.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
        };
        for (const auto& line : lines) {
            for (std::size_t i = 0; i < line.size(); ++i) widths.at(i) = std::max(widths.at(i), width_of(line[i]));
        }
        for (const auto& line : lines) {
            for (std::size_t i = 0; i < line.size(); ++i) {
                const std::string padding(widths.at(i) - width_of(line[i]), ' ');
                const bool left_aligned = !table.columns[shown[i]].number;
                text += left_aligned ? line[i] + padding : padding + line[i];
                text += i + 1 < line.size() ? "  " : "\n";
            }
        }
        return text;
    }

    const std::vector<Record>& records_;
    Results results_;
    Document document_;
    std::string reference_;
    std::string study_;
    std::string mode_;
    std::string sentence_;
};

}  // namespace

Report make_report(const std::vector<Record>& records) {
    if (records.empty()) {
        const Document document{.title = "trocar study",
                                .blocks = {Paragraph{"There are no records.", Paragraph::Style::normal}}};
        return {.files = {{"report.md", to_markdown(document)},
                          {"report.html", to_html(document)},
                          {"report.tex", to_latex(document)}},
                .page_one = "There are no records.\n"};
    }
    return Composer(records).compose();
}

std::vector<Record> read_records(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream || !std::filesystem::is_regular_file(file)) {
        throw InputError(file.string(), "", "the records of a study", "no such file");
    }
    std::vector<Record> records;
    std::string line;
    for (std::int64_t number = 1; std::getline(stream, line); ++number) {
        if (!line.empty()) records.push_back(record_from_json_line(line, file.string(), number));
    }
    return records;
}

Report write_report(const std::filesystem::path& directory) {
    if (!std::filesystem::is_directory(directory)) {
        throw InputError(directory.string(), "", "a folder that holds records.jsonl", "no such folder");
    }
    Report report = make_report(read_records(directory / "records.jsonl"));
    std::filesystem::create_directories(directory / "charts");
    for (const auto& entry : std::filesystem::directory_iterator(directory / "charts")) {
        if (entry.path().extension() == ".svg" &&
            !report.files.contains("charts/" + entry.path().filename().string())) {
            std::filesystem::remove(entry.path());
        }
    }
    for (const auto& [name, content] : report.files) {
        const std::filesystem::path beside = directory / (name + ".part");
        {
            std::ofstream stream(beside, std::ios::binary | std::ios::trunc);
            stream << content;
            stream.flush();
            if (!stream) throw std::runtime_error("cannot write " + beside.string());
        }
        std::filesystem::rename(beside, directory / name);
    }
    return report;
}

}  // namespace trocar
