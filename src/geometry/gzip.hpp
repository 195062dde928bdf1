// Files of lines that are plain or compressed by gzip (RFC 1952).
#pragma once

#include <filesystem>
#include <istream>
#include <memory>
#include <string>
#include <string_view>

namespace trocar {

/// Opens a file for read_line. A name that ends with ".gz" stands for a gzip file, whose content is read unpacked.
/// Throws InputError as open_input. Reads from the stream throw InputError "FILE: byte N: expected …" for a broken or
/// truncated gzip file. The limit of a file that is read as a whole holds for the unpacked bytes.
std::unique_ptr<std::istream> open_lines(const std::filesystem::path& file, const std::string& expected);

/// `content` as a gzip file at level 9 without name and time: equal contents give equal bytes.
std::string gzipped(std::string_view content);

}  // namespace trocar
