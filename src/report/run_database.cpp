#include "report/run_database.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <cmath>
#include <memory>
#include <new>
#include <string>

#include "geometry/input_error.hpp"
#include "geometry/whole_file.hpp"
#include "report/run_table.hpp"

namespace trocar {
namespace {

/// A database in memory.
class Database {
public:
    explicit Database(std::string file) : file_(std::move(file)) {
        sqlite3* opened = nullptr;
        const int status = sqlite3_open(":memory:", &opened);
        handle_.reset(opened);
        check(status);
    }

    void execute(const std::string& sql) { check(sqlite3_exec(handle_.get(), sql.c_str(), nullptr, nullptr, nullptr)); }

    [[nodiscard]] std::string bytes() const {
        sqlite3_int64 size = 0;
        const std::unique_ptr<unsigned char, decltype(&sqlite3_free)> image(
            sqlite3_serialize(handle_.get(), "main", &size, 0), &sqlite3_free);
        if (image == nullptr) throw std::bad_alloc();
        return {reinterpret_cast<const char*>(image.get()), static_cast<std::size_t>(size)};
    }

    [[nodiscard]] sqlite3* handle() const { return handle_.get(); }

    void check(int status) const {
        if (status == SQLITE_OK || status == SQLITE_DONE) return;
        throw InputError(file_, "", "runs that an SQLite database can hold", sqlite3_errmsg(handle_.get()));
    }

private:
    std::string file_;
    std::unique_ptr<sqlite3, decltype(&sqlite3_close)> handle_{nullptr, &sqlite3_close};
};

/// Inserts rows into a table of `columns` columns.
class Insertion {
public:
    Insertion(const Database& database, const char* table, std::size_t columns) : database_(database) {
        std::string places = "?";
        for (std::size_t i = 1; i < columns; ++i) places += ",?";
        sqlite3_stmt* prepared = nullptr;
        const std::string sql = fmt::format("INSERT INTO {} VALUES ({})", table, places);
        database_.check(sqlite3_prepare_v2(database_.handle(), sql.c_str(), -1, &prepared, nullptr));
        statement_.reset(prepared);
    }

    void add(double number) { database_.check(sqlite3_bind_double(statement_.get(), ++column_, number)); }
    void add_null() { database_.check(sqlite3_bind_null(statement_.get(), ++column_)); }
    void add(const std::string& text) {
        database_.check(
            sqlite3_bind_text64(statement_.get(), ++column_, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
    }
    void finish_row() {
        database_.check(sqlite3_step(statement_.get()));
        database_.check(sqlite3_reset(statement_.get()));
        column_ = 0;
    }

private:
    const Database& database_;
    std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> statement_{nullptr, &sqlite3_finalize};
    int column_ = 0;
};

std::string sql_name(const std::string& name) {
    std::string text = "\"";
    for (const char letter : name) text += letter == '"' ? std::string("\"\"") : std::string(1, letter);
    return text + "\"";
}

void add_results(Database& database, const RunTable& table, const std::vector<std::size_t>& columns) {
    std::string list;
    for (const std::size_t index : columns) {
        const RunColumn& column = table.columns()[index];
        list += fmt::format("{}{} {}{}", list.empty() ? "" : ", ", sql_name(column.name),
                            column.number ? "REAL" : "TEXT", column.name == "run_id" ? " PRIMARY KEY" : "");
    }
    database.execute(fmt::format("CREATE TABLE results ({})", list));
    Insertion rows(database, "results", columns.size());
    for (std::size_t row = 0; row < table.row_count(); ++row) {
        for (const std::size_t column : columns) {
            const RunValue cell = table.value(row, column);
            const bool is_number = table.columns()[column].number;
            if (is_number ? std::isnan(cell.number) : cell.word.empty()) {
                rows.add_null();
            } else if (is_number) {
                rows.add(cell.number);
            } else {
                rows.add(cell.word);
            }
        }
        rows.finish_row();
    }
}

void add_facts(Database& database, const std::vector<Record>& records) {
    database.execute(
        "CREATE TABLE facts (run_id TEXT REFERENCES results, \"key\" TEXT, value TEXT, PRIMARY KEY (run_id, "
        "\"key\"))");
    Insertion facts(database, "facts", 3);
    for (const Record& record : records) {
        const std::string id = run_id(record.spec);
        for (const auto& [key, value] : record.environment) {
            facts.add(id);
            facts.add(key);
            facts.add(value);
            facts.finish_row();
        }
    }
}

void add_metrics(Database& database, const RunTable& table, const std::vector<std::size_t>& columns) {
    database.execute("CREATE TABLE metrics (name TEXT PRIMARY KEY, unit TEXT, better TEXT, meaning TEXT, source TEXT)");
    Insertion metrics(database, "metrics", 5);
    for (const std::size_t index : columns) {
        const RunColumn& column = table.columns()[index];
        for (const std::string& field : {column.name, column.unit, column.better, column.meaning, column.source}) {
            metrics.add(field);
        }
        metrics.finish_row();
    }
}

}  // namespace

void write_run_database(const std::vector<Record>& records, const std::filesystem::path& file) {
    const RunTable table(records);
    const std::vector<std::size_t> columns = table.filled_columns();
    Database database(file.string());
    database.execute("BEGIN");
    add_results(database, table, columns);
    add_facts(database, records);
    add_metrics(database, table, columns);
    database.execute("COMMIT");
    write_whole(file, database.bytes());
}

}  // namespace trocar
