// The benchmark's report out of its records and nothing else: the same records give the same bytes. Tables of times,
// ratios with intervals, work and memory; charts over size, pairs, bodies and cell edge; and the thesis' Table 3.1
// answered with numbers.
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
    std::string page_one;                      ///< what a terminal shows
    Document document;                         ///< what the files were written from
    /// Methods that claim exactness and differed from truth somewhere: "label in cell".
    std::vector<std::string> broken_claims;
};

/// Pure.
BenchReport make_report(const std::vector<CellRecord>& records);

/// Reads directory/records.jsonl and writes the report's files into the directory (report/report_files.hpp). Throws
/// InputError when there are no records.
BenchReport write_report(const std::filesystem::path& directory);

}  // namespace trocar::bench
