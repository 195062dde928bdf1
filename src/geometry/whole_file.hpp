// Files that are read and written as a whole. What is wrong with a file is told in the same words everywhere, and
// nobody ever sees half of one.
#pragma once

#include <filesystem>
#include <string>

namespace trocar {

/// The bytes of a file. Throws InputError "expected `expected`, got no such file | a folder | …".
std::string read_whole(const std::filesystem::path& file, const std::string& expected);

/// Writes beside the file and renames. Throws InputError with the system's reason when the disk refuses, and leaves
/// nothing behind.
void write_whole(const std::filesystem::path& file, const std::string& content);

}  // namespace trocar
