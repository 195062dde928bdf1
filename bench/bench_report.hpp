// Creates the benchmark's report from records only; equal records give equal bytes. It has tables of times, ratios,
// work and memory, charts over the sweeps, and the thesis' Table 3.1 with numbers.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "cells.hpp"
#include "report/document.hpp"

namespace trocar::bench {

struct BenchReport {
    std::map<std::string, std::string> files;  ///< path relative to the report's folder -> content
    std::string page_one;                      ///< page 1 as plain text for a terminal
    Document document;                         ///< document behind the files
    /// Methods that claim exactness and differed from the oracle: "label in cell".
    std::vector<std::string> broken_claims;
};

/// Pure.
BenchReport make_report(const std::vector<CellRecord>& records);

/// Reads directory/records.jsonl and writes the report's files into the directory (report/report_files.hpp). Throws
/// InputError when there are no records.
BenchReport write_report(const std::filesystem::path& directory);

}  // namespace trocar::bench
