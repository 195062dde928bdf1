// Creates a report from records only; equal records give equal bytes on every machine. Writes Markdown, HTML, CSV and
// drawings from one document.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "measure/record.hpp"
#include "report/document.hpp"
#include "report/page_assets.hpp"

namespace trocar {

struct Report {
    std::map<std::string, std::string> files;  ///< path relative to the report's folder -> content
    std::string page_one;                      ///< sentence and tables of page 1 as plain text for a terminal
    Document document;                         ///< content of the files
};

/// Names of reports that page 1 quotes, in order, with their records; none: the report was not found.
using QuotedRecords = std::vector<std::pair<std::string, std::vector<Record>>>;

/// Pure. An empty list gives a report that states so. `worst_tick`: content of worst_tick.json (worst_tick.hpp), or
/// empty. `pages`: names of the replay pages (view_links.hpp). `assets`: where its pages find their scripts
/// (page_assets.hpp); only own_assets are among the files.
Report make_report(const std::vector<Record>& records, const std::string& worst_tick = {},
                   const std::set<std::string>& pages = {}, const std::string& assets = own_assets,
                   QuotedRecords quoted = {});

/// Reads records from a file, or from a folder's (records_file). Throws InputError with the line number, or with the
/// place in a gzip file (geometry/gzip.hpp).
std::vector<Record> read_records(const std::filesystem::path& input);

/// Reads the directory's records and, if present, worst_tick.json; writes the report's files into the directory
/// (report_files.hpp) and links its replay pages to their script (view_links.hpp). Reports that it quotes are looked
/// for beside the directory, then in the `published` folders. Throws InputError when there are no records.
Report write_report(const std::filesystem::path& directory, const std::vector<std::filesystem::path>& published = {});

}  // namespace trocar
