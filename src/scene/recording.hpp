// A stream of frames on disk (format TROCREC1, DESIGN §10), so that anyone's frames reach every detector
// bit-identically, and beside them the contacts that their writer found.
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

/// Reads the header at once and frames on demand.
class RecordingReader {
public:
    /// Throws InputError: magic, header, counts, index range, file size.
    explicit RecordingReader(const std::filesystem::path& file);
    /// Bodies in the order of the file's list.
    [[nodiscard]] const Topology& topology() const { return topology_; }
    [[nodiscard]] double dt() const { return dt_; }
    [[nodiscard]] std::int64_t frame_count() const { return frame_count_; }
    /// Number in the file of a triangle of the topology; the same unless the file's ranges are not in list order.
    [[nodiscard]] Index file_triangle(Index triangle) const {
        return file_triangle_.empty() ? triangle : file_triangle_[static_cast<std::size_t>(triangle)];
    }
    /// Reads frame `tick` (0-based). previous = the frame before (frame 0: itself), velocity = (position -
    /// previous)/dt. Positions may be non-finite. Throws InputError when the file cannot be read.
    void read(std::int64_t tick, Frame& frame);
    /// Whether the file carries contacts beside its frames (trocar-recording-2).
    [[nodiscard]] bool has_contacts() const { return contacts_offset_ > 0; }
    /// What the file reports contacts, ascending by tick, triangles by their numbers in the topology; a frame that is
    /// not among them is one that nothing is reported. Empty without contacts. Throws InputError, naming the line, on
    /// contacts that are malformed: the constructor does not examine them.
    [[nodiscard]] std::vector<RecordedTick> contacts();
    /// 64-bit FNV-1a over the file's bytes, contacts left out.
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
    std::vector<Index> file_triangle_;  ///< likewise
    Matrix3X last_;                     ///< 3×N, positions of last_tick_
    std::int64_t last_tick_ = -1;
    Matrix3X file_order_;  ///< buffer
};

/// Writes beside and renames on finish(); an unfinished file leaves nothing behind.
class RecordingWriter {
public:
    /// dt in s. Throws InputError when it is not above 0, or when the file cannot be written.
    RecordingWriter(std::filesystem::path file, const Topology& topology, double dt);
    ~RecordingWriter();
    RecordingWriter(const RecordingWriter&) = delete;
    RecordingWriter& operator=(const RecordingWriter&) = delete;
    RecordingWriter(RecordingWriter&&) = delete;
    RecordingWriter& operator=(RecordingWriter&&) = delete;
    void write(const Frame& frame);
    /// The same, with the contacts that somebody's own simulation found in the frame (DESIGN §10 has their units and
    /// signs); an empty list says that there are none, while `write` says nothing of them. Throws InputError on what
    /// RecordedContact does not allow; the frame is not written then.
    void add(const Frame& frame, std::vector<RecordedContact> contacts);
    /// Any list whose elements name their fields as RecordedContact does, as a std::vector<Contact>, or have a and b
    /// alone, as the pairs of a ContactSet.
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
