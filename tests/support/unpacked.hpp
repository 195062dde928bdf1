// What a plain or compressed file of lines holds.
#pragma once

#include <string>

#include "geometry/gzip.hpp"
#include "geometry/whole_file.hpp"

namespace trocar::test {

/// All lines, each with its line feed.
inline std::string unpacked(const std::filesystem::path& file) {
    const auto stream = open_lines(file, "lines");
    std::string text;
    for (std::string line; read_line(*stream, line, file.string());) text += line + "\n";
    return text;
}

}  // namespace trocar::test
