#include "geometry/gzip.hpp"

#include <zlib.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <streambuf>
#include <utility>

#include "geometry/input_error.hpp"
#include "geometry/size_limits.hpp"
#include "geometry/whole_file.hpp"

namespace trocar {
namespace {

constexpr int gzip_window = 15 + 16;  // 16 selects the gzip format

/// Unpacked bytes of a gzip file, which is one member or several in a row.
class GzipBuffer : public std::streambuf {
public:
    GzipBuffer(std::ifstream input, std::string file) : input_(std::move(input)), file_(std::move(file)) {
        if (inflateInit2(&state_, gzip_window) != Z_OK) throw std::runtime_error("zlib: no memory to unpack a file");
    }
    ~GzipBuffer() override { inflateEnd(&state_); }
    GzipBuffer(const GzipBuffer&) = delete;
    GzipBuffer& operator=(const GzipBuffer&) = delete;
    GzipBuffer(GzipBuffer&&) = delete;
    GzipBuffer& operator=(GzipBuffer&&) = delete;

protected:
    int_type underflow() override {
        state_.next_out = reinterpret_cast<Bytef*>(unpacked_.data());
        state_.avail_out = static_cast<uInt>(unpacked_.size());
        while (state_.avail_out == unpacked_.size()) {
            if (state_.avail_in == 0 && !take_packed()) {
                if (member_ended_) return traits_type::eof();
                refuse("a whole gzip file", "its end");
            }
            if (std::exchange(member_ended_, false)) inflateReset(&state_);
            const int status = inflate(&state_, Z_NO_FLUSH);
            member_ended_ = status == Z_STREAM_END;
            if (status != Z_OK && !member_ended_) {
                refuse("gzip data", state_.msg != nullptr ? state_.msg : zError(status));
            }
        }
        const std::size_t count = unpacked_.size() - state_.avail_out;
        total_ += count;
        if (are_sizes_limited() && total_ > 1'000'000 * static_cast<std::uintmax_t>(most_megabytes)) {
            refuse(limit_text(most_megabytes, "MB unpacked"), "more");
        }
        setg(unpacked_.data(), unpacked_.data(), unpacked_.data() + count);
        return traits_type::to_int_type(unpacked_.front());
    }

private:
    /// The next piece of the file; false at its end.
    bool take_packed() {
        input_.read(packed_.data(), static_cast<std::streamsize>(packed_.size()));
        if (input_.bad()) refuse("a gzip file that can be read", "a read error");
        state_.next_in = reinterpret_cast<Bytef*>(packed_.data());
        state_.avail_in = static_cast<uInt>(input_.gcount());
        taken_ += state_.avail_in;
        return state_.avail_in > 0;
    }
    [[noreturn]] void refuse(const std::string& expected, const std::string& found) const {
        throw InputError(file_, "byte " + std::to_string(taken_ - state_.avail_in), expected, found);
    }

    std::ifstream input_;
    std::string file_;
    std::array<char, 1 << 16> packed_{};
    std::array<char, 1 << 16> unpacked_{};
    z_stream state_{};
    std::uintmax_t taken_ = 0;  ///< bytes of the file
    std::uintmax_t total_ = 0;  ///< unpacked bytes
    bool member_ended_ = false;
};

class GzipStream : public std::istream {
public:
    GzipStream(std::ifstream input, std::string file)
        : std::istream(nullptr), buffer_(std::move(input), std::move(file)) {
        rdbuf(&buffer_);
        exceptions(std::ios::badbit);  // otherwise the stream keeps what its buffer throws
    }

private:
    GzipBuffer buffer_;
};

}  // namespace

std::unique_ptr<std::istream> open_lines(const std::filesystem::path& file, const std::string& expected) {
    std::ifstream stream = open_input(file, expected);
    if (file.extension() == ".gz") return std::make_unique<GzipStream>(std::move(stream), file.string());
    return std::make_unique<std::ifstream>(std::move(stream));
}

std::string gzipped(std::string_view content) {
    z_stream state{};
    constexpr int usual_memory = 8;
    if (deflateInit2(&state, Z_BEST_COMPRESSION, Z_DEFLATED, gzip_window, usual_memory, Z_DEFAULT_STRATEGY) != Z_OK) {
        throw std::runtime_error("zlib: no memory to compress a file");
    }
    std::string packed;
    std::array<char, 1 << 16> piece{};
    int status = Z_OK;
    while (status != Z_STREAM_END) {
        // zlib counts in 32 bits, a content may be longer.
        const std::string_view part = content.substr(0, piece.size());
        content.remove_prefix(part.size());
        state.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(part.data()));
        state.avail_in = static_cast<uInt>(part.size());
        do {
            state.next_out = reinterpret_cast<Bytef*>(piece.data());
            state.avail_out = static_cast<uInt>(piece.size());
            status = deflate(&state, content.empty() ? Z_FINISH : Z_NO_FLUSH);
            packed.append(piece.data(), piece.size() - state.avail_out);
        } while (state.avail_out == 0);
    }
    deflateEnd(&state);
    return packed;
}

}  // namespace trocar
