#include "report/table_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "geometry/input_error.hpp"
#include "geometry/text.hpp"
#include "report/document.hpp"
#include "report/latex.hpp"
#include "report/run_table.hpp"

namespace trocar {
namespace {

/// "a, b, c"
std::string near_ones(const std::string& word, const std::set<std::string>& known) {
    constexpr std::size_t most = 5;
    return fmt::format("{}", fmt::join(near_names(word, {known.begin(), known.end()}, most), ", "));
}

struct Unit {
    double factor = 1.0;  ///< times the base unit
    std::string base;
};

/// "mm" is 0.001 m, "ns" 1e-9 s, "mm³" 1e-9 m³, "%" 0.01 of 1.
std::optional<Unit> unit_of(const std::string& text) {
    static constexpr std::array<const char*, 12> bases{"1", "m³", "m",  "s",   "N m", "N s",
                                                       "N", "J",  "Pa", "rad", "B",   "kg"};
    static const std::map<std::string, double> prefixes{{"", 1.0},   {"n", 1e-9}, {"u", 1e-6}, {"µ", 1e-6},
                                                        {"m", 1e-3}, {"c", 1e-2}, {"k", 1e3},  {"M", 1e6}};
    if (text == "%") return Unit{0.01, "1"};
    for (const std::string base : bases) {
        if (!text.ends_with(base)) continue;
        const auto prefix = prefixes.find(text.substr(0, text.size() - base.size()));
        if (prefix != prefixes.end()) return Unit{base == "m³" ? std::pow(prefix->second, 3) : prefix->second, base};
    }
    return std::nullopt;
}

/// A column that is wanted, and what its numbers are multiplied by.
struct Wanted {
    std::size_t column = 0;
    std::string unit = {};
    double factor = 1.0;
};

/// The name without the unit at its end: "residual_penetration_max" of "residual_penetration_max_m".
std::string stem_of(const RunColumn& column) {
    std::string name = column.name;
    std::string ending = "_";
    for (const char letter : column.unit) {
        if (std::isalnum(static_cast<unsigned char>(letter)) != 0) {
            ending += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
        }
    }
    if (column.unit == "m³") ending = "_m3";
    if (column.number && name.size() > ending.size() && name.ends_with(ending))
        name.resize(name.size() - ending.size());
    return name;
}

std::string header_for(const RunColumn& column, const std::string& unit) {
    std::string name = stem_of(column);
    std::replace(name.begin(), name.end(), '_', ' ');
    return column.number && unit != "1" ? fmt::format("{} ({})", name, unit) : name;
}

/// For a column's name in CSV.
std::string ascii_unit(const std::string& unit) {
    std::string text;
    for (std::size_t i = 0; i < unit.size(); ++i) {
        if (unit.compare(i, 2, "µ") == 0) {
            text += 'u';
            ++i;
        } else if (unit.compare(i, 2, "³") == 0) {
            text += '3';
            ++i;
        } else {
            text += unit[i] == '%' ? "percent" : unit[i] == ' ' ? "_" : std::string(1, unit[i]);
        }
    }
    return text;
}

class Chooser {
public:
    /// The records outlive the object.
    explicit Chooser(const std::vector<Record>& records) : table_(records) {}

    ChosenTable choose(const TableChoice& choice) {
        ChosenTable chosen;
        choose_rows(choice, chosen.notes);
        std::vector<Wanted> wanted;
        for (const std::string& column : choice.columns.empty() ? default_columns() : choice.columns) {
            wanted.push_back(wanted_column(column));
        }
        for (const Wanted& one : wanted) {
            const RunColumn& column = table_.columns()[one.column];
            const std::string name =
                one.unit == column.unit ? column.name : fmt::format("{}_{}", stem_of(column), ascii_unit(one.unit));
            chosen.columns.push_back({name, one.unit, column.number, header_for(column, one.unit)});
        }
        sort_rows(choice.sort, wanted);
        report_twins(wanted, chosen.notes);
        for (const std::size_t row : rows_) {
            std::vector<ChosenCell> cells;
            for (const Wanted& one : wanted) {
                const RunValue value = table_.value(row, one.column);
                // Dividing keeps round numbers round: 0.003 m are 3 mm.
                cells.push_back(
                    {value.word, one.factor < 1.0 ? value.number * one.factor : value.number / (1.0 / one.factor)});
            }
            chosen.rows.push_back(std::move(cells));
        }
        return chosen;
    }

    std::vector<const Record*> choose_records(const std::vector<std::string>& where) {
        (void)keep_where(where);
        if (rows_.empty()) throw InputError("--where", "", "a run for which all of these hold", "none");
        std::vector<const Record*> chosen;
        for (const std::size_t row : rows_) chosen.push_back(&table_.record(row));
        return chosen;
    }

private:
    [[nodiscard]] std::size_t column_named(const std::string& name, const char* option) const {
        const std::int64_t found = table_.find(name);
        if (found >= 0) return static_cast<std::size_t>(found);
        std::set<std::string> known;
        for (const RunColumn& column : table_.columns()) known.insert(column.name);
        throw InputError(option, "", fmt::format("a column of the records, such as {}", near_ones(name, known)),
                         fmt::format("'{}'", name));
    }

    [[nodiscard]] Wanted wanted_column(const std::string& text) const {
        const std::size_t colon = text.find(':');
        Wanted wanted{.column = column_named(text.substr(0, colon), "--columns")};
        const RunColumn& column = table_.columns()[wanted.column];
        wanted.unit = column.unit;
        if (colon == std::string::npos) return wanted;
        const std::string unit = text.substr(colon + 1);
        const std::optional<Unit> from = unit_of(column.unit);
        const std::optional<Unit> to = unit_of(unit);
        if (!column.number || !from || !to || from->base != to->base) {
            throw InputError("--columns", "",
                             fmt::format("a unit that {} can be printed in ({})", column.name, column.unit),
                             fmt::format("'{}'", unit));
        }
        wanted.unit = unit;
        wanted.factor = from->factor / to->factor;
        return wanted;
    }

    [[nodiscard]] bool fits(std::size_t row, std::size_t column, const std::string& value) const {
        const RunColumn& about = table_.columns()[column];
        const RunValue cell = table_.value(row, column);
        if (about.number) {
            char* end = nullptr;
            const double number = std::strtod(value.c_str(), &end);
            if (value.empty() || *end != '\0') return cell.word == value && std::isnan(cell.number);
            return cell.number == number;
        }
        const RunSpec& spec = table_.record(row).spec;
        const std::map<std::string, std::string> whole{
            {"detector", spec.detector}, {"response", spec.response}, {"stepper", spec.stepper}};
        const auto method = whole.find(about.name);
        return cell.word == value || (method != whole.end() && method->second == value);
    }

    void keep(std::size_t column, const std::vector<std::string>& values) {
        std::erase_if(rows_, [&](std::size_t row) {
            return std::none_of(values.begin(), values.end(),
                                [&](const std::string& value) { return fits(row, column, value); });
        });
    }

    /// Below 0: the first row comes first. Numbers that are not known come last in either direction.
    [[nodiscard]] int compared(std::size_t a, std::size_t b, std::size_t column, bool descending) const {
        const RunValue first = table_.value(a, column);
        const RunValue second = table_.value(b, column);
        if (!table_.columns()[column].number) {
            const int order = first.word.compare(second.word);
            return descending ? -order : order;
        }
        const bool known = !std::isnan(first.number);
        const bool other_known = !std::isnan(second.number);
        if (!known || !other_known) return static_cast<int>(other_known) - static_cast<int>(known);
        const int order = first.number < second.number ? -1 : first.number > second.number ? 1 : 0;
        return descending ? -order : order;
    }

    void sort_rows(const std::vector<std::string>& sort, const std::vector<Wanted>& shown) {
        std::vector<std::pair<std::size_t, bool>> keys;
        for (const std::string& text : sort) {
            const std::size_t colon = text.find(':');
            const std::string direction = colon == std::string::npos ? "asc" : text.substr(colon + 1);
            if (direction != "asc" && direction != "desc") {
                throw InputError("--sort", "", "NAME, NAME:asc or NAME:desc", fmt::format("'{}'", text));
            }
            keys.emplace_back(column_named(text.substr(0, colon), "--sort"), direction == "desc");
        }
        for (const Wanted& one : shown) keys.emplace_back(one.column, false);
        std::stable_sort(rows_.begin(), rows_.end(), [&](std::size_t a, std::size_t b) {
            for (const auto& [column, descending] : keys) {
                const int order = compared(a, b, column, descending);
                if (order != 0) return order < 0;
            }
            return false;
        });
    }

    /// Rows with the same words stand for different runs: names the columns that would distinguish them.
    void report_twins(const std::vector<Wanted>& shown, std::vector<std::string>& notes) const {
        std::map<std::string, std::size_t> first_of;
        std::vector<std::string> differing;
        for (const std::size_t row : rows_) {
            std::string words;
            for (const Wanted& one : shown) {
                if (!table_.columns()[one.column].number) words += table_.text(row, one.column) + '\n';
            }
            const auto [twin, is_first] = first_of.emplace(words, row);
            if (is_first) continue;
            for (std::size_t column = 0; column < table_.columns().size(); ++column) {
                const std::string& name = table_.columns()[column].name;
                const bool reports =
                    is_about_methods(name) && table_.text(row, column) != table_.text(twin->second, column);
                if (reports && std::find(differing.begin(), differing.end(), name) == differing.end()) {
                    differing.push_back(name);
                }
            }
        }
        if (!differing.empty()) {
            notes.push_back(fmt::format("rows with the same words are runs that differ in {} (--columns, --where)",
                                        fmt::join(differing, ", ")));
        }
    }

    static bool is_about_methods(const std::string& name) {
        for (const char* const one :
             {"scene", "detector", "response", "contacts", "stepper", "knob", "point", "mode"}) {
            if (name == one || name.starts_with(std::string(one) + ".")) return true;
        }
        return name.starts_with("device.") || name.starts_with("overrides.");
    }

    /// Keeps the rows that fit the conditions, and those of the usual mode and process where no condition names one.
    void choose_rows(const TableChoice& choice, std::vector<std::string>& notes) {
        const std::set<std::string> named = keep_where(choice.where);
        if (!named.contains("mode")) keep_main_mode(notes);
        const bool shown =
            std::find(choice.columns.begin(), choice.columns.end(), "repetition") != choice.columns.end();
        if (!named.contains("repetition") && !shown) {
            const std::size_t before = rows_.size();
            keep(column_named("repetition", "--where"), {"0"});
            if (rows_.size() < before) {
                notes.push_back(
                    fmt::format("the first process of every run, {} more left out (--where repetition=N, or "
                                "the column repetition)",
                                before - rows_.size()));
            }
        }
        if (rows_.empty()) throw InputError("--where", "", "a run for which all of these hold", "none");
    }

    /// Names that some condition asks a value of.
    std::set<std::string> keep_where(const std::vector<std::string>& where) {
        rows_.resize(table_.row_count());
        std::iota(rows_.begin(), rows_.end(), std::size_t{0});
        std::map<std::string, std::vector<std::string>> values;
        std::vector<std::pair<std::size_t, std::string>> excluded;
        for (const std::string& condition : where) {
            const std::size_t equals = condition.find('=');
            if (equals == std::string::npos) {
                throw InputError("--where", "", "NAME=VALUE or NAME!=VALUE", fmt::format("'{}'", condition));
            }
            const bool excludes = equals > 0 && condition[equals - 1] == '!';
            const std::string name = condition.substr(0, excludes ? equals - 1 : equals);
            const std::string value = condition.substr(equals + 1);
            const std::size_t column = column_named(name, "--where");
            std::set<std::string> known;
            bool any = false;
            for (const std::size_t row : rows_) {
                any = any || fits(row, column, value);
                known.insert(table_.text(row, column));
            }
            known.erase("");
            if (!any && !value.empty()) {
                throw InputError("--where", "",
                                 fmt::format("a value that {} has, such as {}", name, near_ones(value, known)),
                                 fmt::format("'{}'", value));
            }
            if (excludes) {
                excluded.emplace_back(column, value);
            } else {
                values[name].push_back(value);
            }
        }
        for (const auto& [name, wanted] : values) keep(column_named(name, "--where"), wanted);
        std::erase_if(rows_, [&](std::size_t row) {
            return std::any_of(excluded.begin(), excluded.end(),
                               [&](const auto& one) { return fits(row, one.first, one.second); });
        });
        std::set<std::string> named;
        for (const auto& [name, wanted] : values) named.insert(name);
        return named;
    }

    void keep_main_mode(std::vector<std::string>& notes) {
        std::set<std::string> modes;
        for (const std::size_t row : rows_) modes.insert(table_.record(row).spec.mode);
        if (modes.size() < 2) return;
        const std::string main = modes.contains("closed_loop") ? "closed_loop" : *modes.begin();
        keep(column_named("mode", "--where"), {main});
        notes.push_back(fmt::format("runs of mode {}; there are others (--where mode=…)", main));
    }

    /// Up to eight.
    [[nodiscard]] std::vector<std::string> default_columns() const {
        std::vector<std::string> columns;
        for (const char* name : {"scene", "detector", "response"}) {
            const auto column = static_cast<std::size_t>(table_.find(name));
            if (std::any_of(rows_.begin(), rows_.end(),
                            [&](std::size_t row) { return !table_.text(row, column).empty(); })) {
                columns.emplace_back(name);
            }
        }
        const auto known = [&](const char* name) {
            const std::int64_t column = table_.find(name);
            return column >= 0 && std::any_of(rows_.begin(), rows_.end(), [&](std::size_t row) {
                       return std::isfinite(table_.value(row, static_cast<std::size_t>(column)).number);
                   });
        };
        const bool fail =
            std::any_of(rows_.begin(), rows_.end(), [&](std::size_t row) { return !table_.record(row).outcome.ok(); });
        if (fail) columns.emplace_back("outcome");
        static const std::vector<std::pair<const char*, const char*>> figures{{"residual_penetration_median_m", "mm"},
                                                                              {"residual_penetration_max_m", "mm"},
                                                                              {"force_error_rms_hard", ""},
                                                                              {"position_error_worst_hard", "mm"},
                                                                              {"false_negatives", ""},
                                                                              {"false_positives", ""},
                                                                              {"total_median_ns", "µs"},
                                                                              {"total_p99_ns", "µs"}};
        constexpr std::size_t most = 8;
        for (const auto& [name, unit] : figures) {
            if (columns.size() < most && known(name)) {
                columns.push_back(*unit == '\0' ? std::string(name) : fmt::format("{}:{}", name, unit));
            }
        }
        return columns;
    }

    RunTable table_;
    std::vector<std::size_t> rows_;
};

Table as_table(const ChosenTable& chosen) {
    Table table;
    for (const ChosenColumn& column : chosen.columns) {
        table.caption += (table.caption.empty() ? "" : ", ") + column.header;
        table.columns.push_back({.header = column.header, .number = column.number});
    }
    for (const std::vector<ChosenCell>& row : chosen.rows) {
        table.rows.emplace_back();
        for (std::size_t c = 0; c < row.size(); ++c) {
            table.rows.back().cells.push_back(chosen.columns[c].number ? format_number(row[c].number) : row[c].word);
        }
    }
    return table;
}

}  // namespace

ChosenTable choose_table(const std::vector<Record>& records, const TableChoice& choice) {
    return Chooser(records).choose(choice);
}

std::vector<const Record*> choose_runs(const std::vector<Record>& records, const std::vector<std::string>& where) {
    return Chooser(records).choose_records(where);
}

std::string table_as_markdown(const ChosenTable& table) { return to_markdown(as_table(table)); }

std::string table_as_latex(const ChosenTable& table) { return latex_table(as_table(table)); }

std::string table_as_csv(const ChosenTable& table) {
    std::vector<std::string> fields;
    for (const ChosenColumn& column : table.columns) fields.push_back(column.name);
    std::string text = csv_line(fields);
    for (const std::vector<ChosenCell>& row : table.rows) {
        for (std::size_t c = 0; c < row.size(); ++c) {
            fields[c] = table.columns[c].number ? format_exact(row[c].number) : row[c].word;
        }
        text += csv_line(fields);
    }
    return text;
}

}  // namespace trocar
