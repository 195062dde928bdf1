#include "geometry/npz_file.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>

#include "geometry/binary_number.hpp"
#include "geometry/input_error.hpp"
#include "geometry/number_text.hpp"
#include "geometry/whole_file.hpp"

namespace trocar {
namespace {

std::uint64_t little_endian(std::string_view bytes, std::size_t at, std::size_t count) {
    return word_of(bytes.data() + at, count, false);
}

constexpr std::uint64_t in_zip64 = 0xFFFFFFFFU;  // a size or offset that stands in an extra field

}  // namespace

struct NpyReader::State {
    std::string place;  ///< "FILE: array 'name'"
    std::ifstream stream;
    bool deflated = false;
    std::uint64_t packed_left = 0;
    std::uint64_t unpacked_left = 0;
    uLong sum = 0;     ///< CRC-32 of what was taken
    uLong listed = 0;  ///< CRC-32 of the whole member, as the archive has it
    std::array<char, 1 << 16> packed{};
    z_stream inflater{};
    std::vector<std::int64_t> shape;
    BinaryType type;
    bool big_endian = false;
    std::string buffer;

    [[noreturn]] void refuse(std::string_view expected, std::string_view found) const {
        throw InputError(place, "", expected, found);
    }

    /// Checks the sum with the last byte.
    void take(char* to, std::size_t count) {
        unpack(to, count);
        sum = crc32_z(sum, reinterpret_cast<const Bytef*>(to), count);
        unpacked_left -= std::min<std::uint64_t>(count, unpacked_left);
        // A fuzzer cannot guess checksums (the macro's name is the convention of fuzzers).
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
        if (unpacked_left == 0 && sum != listed)
            refuse(fmt::format("bytes of the checksum {:08x}", listed), fmt::format("{:08x}", sum));
#endif
    }

    void unpack(char* to, std::size_t count) {
        if (!deflated) {
            const std::size_t there = static_cast<std::size_t>(std::min<std::uint64_t>(count, packed_left));
            stream.read(to, static_cast<std::streamsize>(there));
            if (there < count || !stream) refuse("the whole array", "its end");
            packed_left -= there;
            return;
        }
        inflater.next_out = reinterpret_cast<Bytef*>(to);
        while (count > 0) {
            inflater.avail_out = static_cast<uInt>(std::min<std::size_t>(count, 1U << 30U));
            const std::size_t wanted = inflater.avail_out;
            if (inflater.avail_in == 0 && packed_left > 0) {
                const std::size_t part = static_cast<std::size_t>(std::min<std::uint64_t>(packed.size(), packed_left));
                stream.read(packed.data(), static_cast<std::streamsize>(part));
                if (!stream) refuse("the whole array", "the end of the file");
                packed_left -= part;
                inflater.next_in = reinterpret_cast<Bytef*>(packed.data());
                inflater.avail_in = static_cast<uInt>(part);
            }
            const int status = inflate(&inflater, Z_NO_FLUSH);
            const std::size_t got = wanted - inflater.avail_out;
            count -= got;
            if (status == Z_STREAM_END && count > 0) refuse("the whole array", "its end");
            if (status != Z_OK && status != Z_STREAM_END) {
                refuse("deflated data", inflater.msg != nullptr ? inflater.msg : "broken ones");
            }
        }
    }
};

NpyReader::NpyReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
NpyReader::NpyReader(NpyReader&&) noexcept = default;
NpyReader::~NpyReader() {
    if (state_ && state_->deflated) inflateEnd(&state_->inflater);
}

const std::vector<std::int64_t>& NpyReader::shape() const { return state_->shape; }
bool NpyReader::is_whole() const { return state_->type.kind != 'f'; }

void NpyReader::read(double* numbers, std::size_t count) {
    State& state = *state_;
    constexpr std::size_t piece = 1 << 16;
    for (std::size_t done = 0; done < count;) {
        const std::size_t part = std::min(piece, count - done);
        state.buffer.resize(part * state.type.bytes);
        state.take(state.buffer.data(), state.buffer.size());
        for (std::size_t i = 0; i < part; ++i) {
            numbers[done + i] = real_of(state.buffer.data() + i * state.type.bytes, state.type, state.big_endian);
        }
        done += part;
    }
}

NpzFile::NpzFile(const std::filesystem::path& file) : file_(file) {
    std::ifstream stream = open_input(file, "an .npz file");
    const auto refuse = [&](std::string_view found) {
        throw InputError(file.string(), "", "a whole .npz file (a zip archive of arrays)", found);
    };
    const std::uint64_t size = std::filesystem::file_size(file);
    const auto bytes_at = [&](std::uint64_t offset, std::uint64_t count) {
        if (offset > size || count > size - offset) refuse("one that is truncated");
        std::string bytes(static_cast<std::size_t>(count), '\0');
        stream.seekg(static_cast<std::streamoff>(offset));
        if (count > 0 && !stream.read(bytes.data(), static_cast<std::streamsize>(count))) refuse("a read error");
        return bytes;
    };
    constexpr std::uint64_t end_bytes = 22;
    if (size < end_bytes || bytes_at(0, 2) != "PK") refuse("another kind of file");
    // The list of members ends the file; a comment may follow it.
    const std::uint64_t tail_bytes = std::min<std::uint64_t>(size, end_bytes + 65535);
    const std::string tail = bytes_at(size - tail_bytes, tail_bytes);
    const std::size_t end = tail.rfind("PK\5\6");
    if (end == std::string::npos || tail.size() - end < end_bytes) refuse("one that is truncated");
    std::uint64_t entries = little_endian(tail, end + 10, 2);
    std::uint64_t list_bytes = little_endian(tail, end + 12, 4);
    std::uint64_t list_at = little_endian(tail, end + 16, 4);
    constexpr std::size_t locator_bytes = 20;
    if ((list_at == in_zip64 || entries == 0xFFFFU) && end >= locator_bytes &&
        tail.compare(end - locator_bytes, 4, "PK\6\7") == 0) {
        const std::string wide = bytes_at(little_endian(tail, end - locator_bytes + 8, 8), 56);
        entries = little_endian(wide, 32, 8);
        list_bytes = little_endian(wide, 40, 8);
        list_at = little_endian(wide, 48, 8);
    }
    const std::string list = bytes_at(list_at, list_bytes);
    std::size_t at = 0;
    for (std::uint64_t i = 0; i < entries; ++i) {
        constexpr std::size_t entry_bytes = 46;
        if (list.size() - at < entry_bytes || list.compare(at, 4, "PK\1\2") != 0) refuse("a broken list of arrays");
        Member member;
        const std::uint64_t method = little_endian(list, at + 10, 2);
        member.sum = static_cast<std::uint32_t>(little_endian(list, at + 16, 4));
        member.packed = little_endian(list, at + 20, 4);
        member.unpacked = little_endian(list, at + 24, 4);
        const std::size_t name_bytes = little_endian(list, at + 28, 2);
        const std::size_t extra_bytes = little_endian(list, at + 30, 2);
        const std::size_t comment_bytes = little_endian(list, at + 32, 2);
        member.offset = little_endian(list, at + 42, 4);
        at += entry_bytes;
        if (list.size() - at < name_bytes + extra_bytes + comment_bytes) refuse("a broken list of arrays");
        member.name = list.substr(at, name_bytes);
        std::string_view extra = std::string_view(list).substr(at + name_bytes, extra_bytes);
        while (extra.size() >= 4) {
            const std::size_t field = std::min<std::size_t>(little_endian(extra, 2, 2), extra.size() - 4);
            if (little_endian(extra, 0, 2) == 1) {
                std::size_t next = 4;
                for (std::uint64_t* const number : {&member.unpacked, &member.packed, &member.offset}) {
                    if (*number != in_zip64 || next + 8 > field + 4) continue;
                    *number = little_endian(extra, next, 8);
                    next += 8;
                }
            }
            extra.remove_prefix(4 + field);
        }
        at += name_bytes + extra_bytes + comment_bytes;
        constexpr std::uint64_t stored = 0;
        constexpr std::uint64_t deflated = 8;
        member.deflated = method == deflated;
        if (method != stored && method != deflated) refuse(fmt::format("'{}' of compression {}", member.name, method));
        if (member.name.ends_with(".npy")) member.name.resize(member.name.size() - 4);
        members_.push_back(std::move(member));
    }
}

std::vector<std::string> NpzFile::names() const {
    std::vector<std::string> names;
    for (const Member& member : members_) names.push_back(member.name);
    return names;
}

bool NpzFile::has(std::string_view name) const {
    return std::any_of(members_.begin(), members_.end(), [name](const Member& one) { return one.name == name; });
}

NpyReader NpzFile::open(std::string_view name) const {
    const auto found =
        std::find_if(members_.begin(), members_.end(), [name](const Member& one) { return one.name == name; });
    if (found == members_.end()) {
        throw InputError(file_.string(), "", fmt::format("an array '{}'", name),
                         fmt::format("{}", fmt::join(names(), ", ")));
    }
    auto state = std::make_unique<NpyReader::State>();
    NpyReader::State& reader = *state;
    reader.place = fmt::format("{}: array '{}'", file_.string(), name);
    reader.stream = open_input(file_, "an .npz file");
    constexpr std::size_t local_bytes = 30;
    std::string local(local_bytes, '\0');
    reader.stream.seekg(static_cast<std::streamoff>(found->offset));
    if (!reader.stream.read(local.data(), local_bytes) || local.compare(0, 4, "PK\3\4") != 0) {
        reader.refuse("a member of the archive", "other bytes");
    }
    reader.stream.seekg(static_cast<std::streamoff>(little_endian(local, 26, 2) + little_endian(local, 28, 2)),
                        std::ios::cur);
    reader.packed_left = found->packed;
    reader.unpacked_left = found->unpacked;
    reader.sum = crc32_z(0, nullptr, 0);
    reader.listed = found->sum;
    constexpr int no_header = -15;
    if (found->deflated && inflateInit2(&reader.inflater, no_header) != Z_OK) throw std::bad_alloc();
    reader.deflated = found->deflated;
    NpyReader result(std::move(state));

    std::string magic(10, '\0');
    reader.take(magic.data(), magic.size());
    if (!magic.starts_with("\x93NUMPY")) reader.refuse("an .npy array", "other bytes");
    std::size_t header_bytes = little_endian(magic, 8, 2);
    std::size_t before = magic.size();
    if (magic[6] != 1) {
        std::string more(2, '\0');
        reader.take(more.data(), more.size());
        header_bytes |= little_endian(more, 0, 2) << 16U;
        before += more.size();
    }
    constexpr std::size_t most_header_bytes = 65536;
    if (header_bytes > most_header_bytes) reader.refuse("a header of the array", "more than 64 KB");
    std::string header(header_bytes, '\0');
    reader.take(header.data(), header.size());
    // A Python dictionary, always with these three keys: {'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }
    const auto value_of = [&](std::string_view key) {
        const std::size_t at = header.find(key);
        const std::size_t colon = at == std::string::npos ? at : header.find(':', at);
        if (colon == std::string::npos) reader.refuse(fmt::format("a header with {}", key), "none");
        return std::string_view(header).substr(std::min(header.find_first_not_of(' ', colon + 1), header.size()));
    };
    const std::string_view type = value_of("'descr'");
    const bool plain = type.size() >= 5 && type[0] == '\'' && type[4] == '\'';
    reader.type = {.bytes = plain ? static_cast<std::size_t>(type[3] - '0') : 0, .kind = plain ? type[2] : '?'};
    const auto& [bytes, kind] = reader.type;
    reader.big_endian = plain && type[1] == '>';
    const bool is_real = kind == 'f' && (bytes == 4 || bytes == 8);
    const bool is_whole = (kind == 'i' || kind == 'u') && (bytes == 1 || bytes == 2 || bytes == 4 || bytes == 8);
    if (!is_real && !is_whole) {
        reader.refuse("float32, float64 or integers", type.substr(0, std::min(type.find_first_of(",}"), type.size())));
    }
    if (!value_of("'fortran_order'").starts_with("False")) reader.refuse("C order", "Fortran order");
    std::string_view shape = value_of("'shape'");
    shape = shape.substr(0, shape.find(')'));
    std::uint64_t numbers = 1;
    while (!shape.empty()) {
        const std::size_t first = shape.find_first_of("0123456789");
        if (first == std::string_view::npos) break;
        const std::size_t end = std::min(shape.find_first_not_of("0123456789", first), shape.size());
        const auto extent = number_of_text<std::int64_t>(shape.substr(first, end - first));
        if (!extent || (*extent > 0 && numbers > (std::uint64_t{1} << 50U) / static_cast<std::uint64_t>(*extent))) {
            reader.refuse("a shape of an array that a file can hold", std::string(shape));
        }
        numbers *= static_cast<std::uint64_t>(*extent);
        reader.shape.push_back(*extent);
        shape.remove_prefix(end);
    }
    const std::uint64_t wanted = before + header_bytes + numbers * bytes;
    if (wanted != found->unpacked) {
        reader.refuse(fmt::format("{} bytes, as the shape needs", wanted), fmt::format("{} bytes", found->unpacked));
    }
    return result;
}

}  // namespace trocar
