// Frames on disk (format TROCREC1, DESIGN §10), to replay them bit-identically to every detector, with optional
// contacts of their writer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <ranges>
#include <string>
#include <utility>
#include <vector>

#include "scene/recorded_contacts.hpp"
#include "scene/world.hpp"

namespace trocar {

/// Whether the file begins as a recording does. Throws InputError, with what was `expected`, when it cannot be read.
bool is_recording(const std::filesystem::path& file, const std::string& expected);

/// Reads the header at construction and frames on demand.
class RecordingReader {
public:
    /// Throws InputError on a bad magic, header, count, index range or file size.
    explicit RecordingReader(const std::filesystem::path& file);
    /// Bodies are in the order of the file's list.
    [[nodiscard]] const Topology& topology() const { return topology_; }
    [[nodiscard]] double dt() const { return dt_; }
    [[nodiscard]] std::int64_t frame_count() const { return frame_count_; }
    /// File number of a triangle of the topology; equal unless the file's ranges are not in list order.
    [[nodiscard]] Index file_triangle(Index triangle) const {
        return file_triangle_.empty() ? triangle : file_triangle_[static_cast<std::size_t>(triangle)];
    }
    /// Reads frame `tick` (0-based). previous = the frame before (frame 0: itself), velocity = (position -
    /// previous)/dt. Positions may be non-finite. Throws InputError when the file cannot be read.
    void read(std::int64_t tick, Frame& frame);
    /// True if the file has contacts (trocar-recording-2).
    [[nodiscard]] bool has_contacts() const { return contacts_offset_ > 0; }
    /// Recorded contacts, ascending by tick, with triangle numbers of the topology. A tick that is absent has no
    /// report. Empty without contacts. Throws InputError, naming the line, on malformed contacts, which the constructor
    /// does not check.
    [[nodiscard]] std::vector<RecordedTick> contacts();
    /// 64-bit FNV-1a over the file's bytes, without contacts.
    [[nodiscard]] std::uint64_t hash() const { return hash_; }

private:
    void read_positions(std::int64_t tick, Matrix3X& position);

    std::ifstream stream_;
    std::string file_;
    Topology topology_;
    double dt_ = 0.001;
    std::int64_t frame_count_ = 0;
    std::int64_t first_frame_offset_ = 0;
    std::int64_t contacts_offset_ = 0;  ///< 0: none
    std::uint64_t hash_ = 0;
    std::vector<Index> file_vertex_;    ///< number in the file of each vertex; empty: the same
    std::vector<Index> file_triangle_;  ///< the same for triangles
    Matrix3X last_;                     ///< 3×N, positions of last_tick_
    std::int64_t last_tick_ = -1;
    Matrix3X file_order_;  ///< buffer, vertices in the file's order
};

/// Writes a temporary file and renames it on finish(); an unfinished file is removed.
class RecordingWriter {
public:
    /// dt in s. Throws InputError if dt is not positive or the file cannot be written.
    RecordingWriter(std::filesystem::path file, const Topology& topology, double dt);
    ~RecordingWriter();
    RecordingWriter(const RecordingWriter&) = delete;
    RecordingWriter& operator=(const RecordingWriter&) = delete;
    RecordingWriter(RecordingWriter&&) = delete;
    RecordingWriter& operator=(RecordingWriter&&) = delete;
    void write(const Frame& frame);
    /// As write, with contacts of another simulation (units and signs in DESIGN §10). An empty list reports no
    /// contacts, whereas `write` reports nothing. Throws InputError on contacts that RecordedContact forbids; the frame
    /// is then not written.
    void add(const Frame& frame, std::vector<RecordedContact> contacts);
    /// Accepts any list whose elements have the fields of RecordedContact, such as std::vector<Contact>. Elements with
    /// a and b alone, such as the pairs of a ContactSet, are accepted too.
    template <std::ranges::input_range Contacts>
    void add(const Frame& frame, const Contacts& contacts) {
        std::vector<RecordedContact> list;
        for (const auto& contact : contacts) {
            RecordedContact& reported = list.emplace_back();
            reported.a = contact.a;
            reported.b = contact.b;
            if constexpr (requires { contact.point, contact.normal, contact.depth; }) {
                reported.point = contact.point;
                reported.normal = contact.normal;
                reported.depth = contact.depth;
            }
        }
        add(frame, std::move(list));
    }
    void finish();

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Text of `trocar schema recording`.
std::string recording_schema();

}  // namespace trocar
