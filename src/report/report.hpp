// A report out of records and nothing else: the same records give the same bytes, today and on another machine. Writes
// Markdown, HTML, LaTeX, CSV and drawings from one document.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "measure/record.hpp"

namespace trocar {

struct Report {
    std::map<std::string, std::string> files;  ///< path relative to the report's folder -> content
    std::string page_one;                      ///< sentence and verdict table as plain text, for a terminal
};

/// Pure. An empty list gives a report that says so. `with_page`: scenes whose replay page lies beside (view_links.hpp).
Report make_report(const std::vector<Record>& records, const std::set<std::string>& with_page = {});

/// Reads a records.jsonl; throws InputError with the line.
std::vector<Record> read_records(const std::filesystem::path& file);

/// Reads directory/records.jsonl, writes the report's files into the directory (each beside, then renamed) and removes
/// charts of an earlier report that no longer exist. Throws InputError when there are no records.
Report write_report(const std::filesystem::path& directory);

}  // namespace trocar
