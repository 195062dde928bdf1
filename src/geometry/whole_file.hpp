// The door to files: what is wrong with one is reported in the same words everywhere, and nobody ever sees half of one.
#pragma once

#include <filesystem>
#include <fstream>
#include <istream>
#include <string>

namespace trocar {

/// Opens a file that somebody named as input. Throws InputError "expected `expected`, got no such file | a folder | a
/// pipe | a device | a socket | no permission to read it": only a regular file is sure to end.
std::ifstream open_input(const std::filesystem::path& file, const std::string& expected);

/// The bytes of a file. Throws InputError "expected `expected`, got no such file | a folder | …".
std::string read_whole(const std::filesystem::path& file, const std::string& expected);

/// The next line without its line feed; false where there is none. At the end of the file, where the last line may lack
/// its line feed, `stream.eof()` is true. Throws InputError "`place`: expected at most 24 MB of a line …": a file of
/// one endless line would take all memory.
bool read_line(std::istream& stream, std::string& line, const std::string& place);

/// Writes beside the file and renames. Throws InputError with the system's reason when the disk refuses, and leaves
/// nothing behind.
void write_whole(const std::filesystem::path& file, const std::string& content);

/// The stem of a file for something of this name, which may have come from anybody and must lead to no other folder:
/// ASCII letters, digits, - and _ stay, every other byte becomes _; "" becomes _; at most 100 letters, for systems have
/// limits.
std::string file_word(const std::string& name);

}  // namespace trocar
