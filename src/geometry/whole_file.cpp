#include "geometry/whole_file.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "geometry/input_error.hpp"

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
    std::ostringstream text;
    // An empty file has nothing to insert, which is no fault of the stream's.
    if (stream.peek() != std::ifstream::traits_type::eof()) text << stream.rdbuf();
    if (stream.bad() || text.fail()) throw InputError(file.string(), "", expected, "a read error");
    return text.str();
}

void write_whole(const std::filesystem::path& file, const std::string& content) {
    const auto refuse = [&file](const std::string& reason) {
        throw InputError(file.string(), "", "a file that can be written", reason);
    };
    std::filesystem::path beside = file;
    beside += ".part";
    std::error_code error;
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
    std::filesystem::rename(beside, file, error);
    if (!error) return;
    const std::string reason = error.message();
    std::filesystem::remove(beside, error);
    refuse(reason);
}

}  // namespace trocar
