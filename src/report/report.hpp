// A report out of records and nothing else: the same records give the same bytes, today and on another machine. Writes
// Markdown, HTML, CSV and drawings from one document.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "measure/record.hpp"
#include "report/document.hpp"

namespace trocar {

struct Report {
    std::map<std::string, std::string> files;  ///< path relative to the report's folder -> content
    std::string page_one;                      ///< sentence and tables of page 1 as plain text, for a terminal
    Document document;                         ///< what the files report, whole
};

/// Pure. An empty list gives a report that says so. `worst_tick`: content of worst_tick.json (worst_tick.hpp), empty
/// without it. `pages`: names of the replay pages beside it (view_links.hpp).
Report make_report(const std::vector<Record>& records, const std::string& worst_tick = {},
                   const std::set<std::string>& pages = {});

/// Reads a records.jsonl; throws InputError with the line.
std::vector<Record> read_records(const std::filesystem::path& file);

/// Reads directory/records.jsonl, and worst_tick.json where it is, and writes the report's files into the directory
/// (report_files.hpp). Throws InputError when there are no records.
Report write_report(const std::filesystem::path& directory);

}  // namespace trocar
