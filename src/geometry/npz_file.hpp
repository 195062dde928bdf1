// Arrays of NumPy's .npz files: a zip archive of .npy members, stored or deflated. An array is read in pieces, so that
// its size does not matter.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace trocar {

/// One array of an archive, read from its first number to its last.
class NpyReader {
public:
    ~NpyReader();
    NpyReader(NpyReader&&) noexcept;
    NpyReader& operator=(NpyReader&&) = delete;
    NpyReader(const NpyReader&) = delete;
    NpyReader& operator=(const NpyReader&) = delete;

    [[nodiscard]] const std::vector<std::int64_t>& shape() const;
    /// True for integers of any size.
    [[nodiscard]] bool is_whole() const;
    /// Fills `count` numbers, the last index first. Throws InputError on a truncated or broken member, one of
    /// another checksum when its last number is read.
    void read(double* numbers, std::size_t count);

private:
    friend class NpzFile;
    struct State;
    explicit NpyReader(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

class NpzFile {
public:
    /// Throws InputError for a file that is no whole zip archive.
    explicit NpzFile(const std::filesystem::path& file);

    /// Names of the arrays, in the order of the archive.
    [[nodiscard]] std::vector<std::string> names() const;
    [[nodiscard]] bool has(std::string_view name) const;
    /// Begins an array of real or whole numbers in C order. Throws InputError for other ones and where there is none.
    [[nodiscard]] NpyReader open(std::string_view name) const;

private:
    struct Member {
        std::string name;
        std::uint64_t offset = 0;  ///< of the local header
        std::uint64_t packed = 0;
        std::uint64_t unpacked = 0;
        std::uint32_t sum = 0;  ///< CRC-32 of the unpacked bytes
        bool deflated = false;
    };
    std::filesystem::path file_;
    std::vector<Member> members_;
};

}  // namespace trocar
