#include "geometry/whole_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "geometry/input_error.hpp"
#include "geometry/size_limits.hpp"

namespace trocar {

std::ifstream open_input(const std::filesystem::path& file, const std::string& expected) {
    std::error_code error;
    const auto refuse = [&](const char* found) { throw InputError(file.string(), "", expected, found); };
    switch (std::filesystem::status(file, error).type()) {
        case std::filesystem::file_type::regular:
            break;
        case std::filesystem::file_type::directory:
            refuse("a folder");
            break;
        case std::filesystem::file_type::fifo:
            refuse("a pipe");
            break;
        case std::filesystem::file_type::socket:
            refuse("a socket");
            break;
        case std::filesystem::file_type::block:
        case std::filesystem::file_type::character:
            refuse("a device");
            break;
        default:
            refuse("no such file");
    }
    std::ifstream stream(file, std::ios::binary);
    if (!stream) refuse("no permission to read it");
    return stream;
}

std::string read_whole(const std::filesystem::path& file, const std::string& expected) {
    std::ifstream stream = open_input(file, expected);
    std::error_code error;
    constexpr std::uintmax_t most_bytes = 1'000'000 * most_megabytes;
    // Kernel files report size 0 and grow while they are read.
    const std::uintmax_t said = std::max<std::uintmax_t>(std::filesystem::file_size(file, error), 1);
    std::string text;
    for (std::uintmax_t wanted = error ? 1 : said;; wanted = std::max<std::uintmax_t>(4096, text.size())) {
        if (are_sizes_limited() && text.size() + wanted > most_bytes) {
            throw InputError(file.string(), "", limit_text(most_megabytes, "MB to be read at a time"), "more");
        }
        const std::size_t before = text.size();
        text.resize(before + static_cast<std::size_t>(wanted));
        stream.read(text.data() + before, static_cast<std::streamsize>(wanted));
        text.resize(before + static_cast<std::size_t>(stream.gcount()));
        if (stream.bad()) throw InputError(file.string(), "", expected, "a read error");
        if (stream.eof()) return text;
        if (stream.peek() == std::ifstream::traits_type::eof()) return text;
    }
}

bool read_line(std::istream& stream, std::string& line, const std::string& place) {
    constexpr std::size_t most_bytes = 1'000'000 * most_line_megabytes;
    line.clear();
    for (std::array<char, 4096> piece{};;) {
        stream.getline(piece.data(), piece.size());
        const auto taken = static_cast<std::size_t>(stream.gcount());
        if (stream.good()) {
            line.append(piece.data(), taken - 1);  // the line feed counts as taken
            return true;
        }
        line.append(piece.data(), taken);
        if (stream.bad() || (stream.eof() && line.empty())) return false;
        if (are_sizes_limited() && line.size() > most_bytes) {
            throw InputError(place, "", limit_text(most_line_megabytes, "MB of a line"), "more");
        }
        // The failure means a full piece, or the end of the file just after a full one.
        const bool at_end = stream.eof();
        stream.clear(at_end ? std::ios::eofbit : std::ios::goodbit);
        if (at_end) return true;
    }
}

void write_whole(const std::filesystem::path& file, const std::string& content) {
    const auto refuse = [&file](const std::string& reason) {
        throw InputError(file.string(), "", "a file that can be written", reason);
    };
    std::error_code error;
    // The rename replaces the target, so links are followed first; /dev/null stays a device.
    std::filesystem::path target = file;
    for (int links = 0; links < 40 && std::filesystem::is_symlink(target, error); ++links) {
        target = target.parent_path() / std::filesystem::read_symlink(target, error);
    }
    const std::filesystem::file_status there = std::filesystem::status(target, error);
    if (std::filesystem::is_directory(there)) refuse("a folder");
    if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there)) refuse("a device, pipe or socket");
    std::filesystem::path beside = target;
    beside += ".part";
    errno = 0;
    {
        std::ofstream stream(beside, std::ios::binary | std::ios::trunc);
        stream << content;
        stream.flush();
        if (!stream) {
            const std::string reason = errno != 0 ? std::strerror(errno) : "a write error";
            std::filesystem::remove(beside, error);
            refuse(reason);
        }
    }
    std::filesystem::rename(beside, target, error);
    if (!error) return;
    const std::string reason = error.message();
    std::filesystem::remove(beside, error);
    refuse(reason);
}

std::string file_word(const std::string& name) {
    constexpr std::size_t longest = 100;
    std::string word = name.substr(0, longest);
    for (char& letter : word) {
        if (std::isalnum(static_cast<unsigned char>(letter)) == 0 && letter != '-' && letter != '_') letter = '_';
    }
    return word.empty() ? "_" : word;
}

}  // namespace trocar
