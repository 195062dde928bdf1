// Reading and writing of files with uniform error messages; partly written files are never visible.
#pragma once

#include <filesystem>
#include <fstream>
#include <istream>
#include <string>

namespace trocar {

/// Opens an input file. Throws InputError "expected `expected`, got no such file | a folder | a pipe | a device | a
/// socket | no permission to read it". Only regular files are accepted, since others may never end.
std::ifstream open_input(const std::filesystem::path& file, const std::string& expected);

/// The bytes of a file. Throws InputError as open_input.
std::string read_whole(const std::filesystem::path& file, const std::string& expected);

/// Reads the next line without its line feed; false where there is none. After a last line without line feed,
/// `stream.eof()` is true. Throws InputError "`place`: expected at most 24 MB of a line …", since an endless line would
/// fill memory.
bool read_line(std::istream& stream, std::string& line, const std::string& place);

/// Writes to a temporary file and renames it. On failure removes it and throws InputError with the system's reason.
void write_whole(const std::filesystem::path& file, const std::string& content);

/// A file stem for an untrusted name, which cannot point to another folder. ASCII letters, digits, - and _ stay, every
/// other byte becomes _, and "" becomes _. At most 100 letters, because systems limit file names.
std::string file_word(const std::string& name);

}  // namespace trocar
