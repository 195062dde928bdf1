#include "scene/recording.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

#include "geometry/fnv_hash.hpp"
#include "geometry/input_error.hpp"
#include "geometry/size_limits.hpp"
#include "geometry/whole_file.hpp"
#include "scene/json_node.hpp"

namespace trocar {
namespace {

static_assert(std::endian::native == std::endian::little, "the format is little-endian and is read as it stands");

constexpr std::string_view magic = "TROCREC1";
const std::vector<std::string> recording_formats{"trocar-recording-1",
                                                 "trocar-recording-2"};  // the second has contacts
constexpr std::int64_t header_offset = 16;
constexpr std::int64_t most_frames = std::int64_t{1} << 40;

std::int64_t padded(std::int64_t bytes) { return (bytes + 7) / 8 * 8; }

/// Of the first `count` bytes.
std::uint64_t hash_of_bytes(std::ifstream& stream, std::int64_t count) {
    FnvHash hash;
    std::vector<char> block(std::size_t{1} << 16);
    stream.seekg(0);
    while (count > 0) {
        stream.read(block.data(), std::min(count, static_cast<std::int64_t>(block.size())));
        if (stream.gcount() == 0) break;
        hash.add_text({block.data(), static_cast<std::size_t>(stream.gcount())});
        count -= stream.gcount();
    }
    stream.clear();
    return hash.value();
}

Range range_from(const JsonNode& node, std::int64_t total, const char* what) {
    const std::vector<JsonNode> numbers = node.list();
    if (numbers.size() != 2) node.fail("[first, count]");
    const std::int64_t first = numbers[0].integer(0, total);
    const std::int64_t count = numbers[1].integer(0, total);
    if (first + count > total) node.fail(fmt::format("a range within the {} {}", total, what));
    return {static_cast<Index>(first), static_cast<Index>(count)};
}

/// The ranges, in any order, have to cover 0 … total-1 once.
void expect_partition(const JsonNode& bodies, std::vector<Range> ranges, Index total, const char* what) {
    std::sort(ranges.begin(), ranges.end(), [](Range a, Range b) { return a.first < b.first; });
    Index next = 0;
    for (const Range& range : ranges) {
        if (range.count == 0) continue;
        if (range.first != next) {
            bodies.fail(fmt::format("every one of the {} {} in one body", total, what),
                        fmt::format("{} {} {}", what, std::min(range.first, next),
                                    range.first < next ? "in two bodies" : "in none"));
        }
        next = range.end();
    }
    if (next != total) {
        bodies.fail(fmt::format("every one of the {} {} in one body", total, what),
                    fmt::format("{} {} in none", what, next));
    }
}

/// File numbers in the order of the bodies; empty when that is the file's order.
std::vector<Index> file_numbers(const std::vector<Range>& ranges) {
    std::vector<Index> numbers;
    Index next = 0;
    const bool in_order = std::all_of(ranges.begin(), ranges.end(), [&next](Range range) {
        if (range.count == 0) return true;
        const bool follows = range.first == next;
        next = range.end();
        return follows;
    });
    if (in_order) return numbers;
    for (const Range& range : ranges) {
        for (Index i = range.first; i < range.end(); ++i) numbers.push_back(i);
    }
    return numbers;
}

struct Header {
    bool contacts = false;  ///< after the frames
    double dt = 0.0;
    std::int64_t frames = 0;
    std::int64_t vertices = 0;
    std::int64_t triangles = 0;
    std::vector<Body> bodies;
    std::vector<Range> vertex_ranges;
    std::vector<Range> triangle_ranges;
    std::optional<std::vector<std::array<Index, 2>>> body_pairs;
};

Header read_header(const JsonNode& node) {
    node.expect_keys({"format", "unit", "dt", "frames", "vertices", "triangles", "bodies", "body_pairs"});
    Header header;
    header.contacts = node.at("format").word(recording_formats) == recording_formats[1];
    node.at("unit").expect_word("m");
    header.dt = node.at("dt").positive();
    header.frames = node.at("frames").integer(0, most_frames);
    constexpr std::int64_t most = std::numeric_limits<Index>::max();
    if (are_sizes_limited()) {
        const std::size_t bodies = node.at("bodies").list().size();
        if (bodies > static_cast<std::size_t>(most_bodies)) {
            node.at("bodies").fail(limit_text(most_bodies, "bodies"), std::to_string(bodies));
        }
        if (const std::int64_t count = node.at("triangles").integer(0, most); count > most_triangles) {
            node.at("triangles").fail(limit_text(most_triangles, "triangles"));
        }
    }
    header.vertices = node.at("vertices").integer(0, most);
    header.triangles = node.at("triangles").integer(0, most);
    constexpr std::int64_t most_empty_frames = 1'000'000;  // the file's size bounds all others
    if (header.vertices == 0) header.frames = node.at("frames").integer(0, most_empty_frames);
    std::set<std::string> names;
    for (const JsonNode& item : node.at("bodies").list()) {
        item.expect_keys({"name", "kind", "closed", "vertices", "triangles", "instrument"});
        Body body;
        body.name = item.at("name").text();
        if (!names.insert(body.name).second) item.at("name").fail("a name of its own");
        body.kind = body_kind_of(item.at("kind").word(body_kind_words));
        body.closed = item.at("closed").flag();
        if (const auto instrument = item.find("instrument")) body.instrument = instrument->text();
        header.vertex_ranges.push_back(range_from(item.at("vertices"), header.vertices, "vertices"));
        header.triangle_ranges.push_back(range_from(item.at("triangles"), header.triangles, "triangles"));
        body.vertex_count = header.vertex_ranges.back().count;
        header.bodies.push_back(std::move(body));
    }
    expect_partition(node.at("bodies"), header.vertex_ranges, static_cast<Index>(header.vertices), "vertices");
    expect_partition(node.at("bodies"), header.triangle_ranges, static_cast<Index>(header.triangles), "triangles");
    if (const auto pairs = node.find("body_pairs")) {
        const auto last = static_cast<std::int64_t>(header.bodies.size()) - 1;
        header.body_pairs.emplace();
        for (const JsonNode& pair : pairs->list()) {
            const std::vector<JsonNode> numbers = pair.list();
            if (numbers.size() != 2) pair.fail("two body numbers");
            const auto a = static_cast<Index>(numbers[0].integer(0, last));
            const auto b = static_cast<Index>(numbers[1].integer(0, last));
            if (a == b) pair.fail("two different body numbers");
            header.body_pairs->push_back({a, b});
        }
    }
    return header;
}

}  // namespace

bool is_recording(const std::filesystem::path& file, const std::string& expected) {
    std::string word(magic.size(), '\0');
    std::ifstream stream = open_input(file, expected);
    return stream.read(word.data(), static_cast<std::streamsize>(word.size())) && word == magic;
}

RecordingReader::RecordingReader(const std::filesystem::path& file) : file_(file.string()) {
    stream_ = open_input(file, "a recording file");
    const auto size = static_cast<std::int64_t>(std::filesystem::file_size(file));

    std::array<char, 8> word{};
    if (size < header_offset || !stream_.read(word.data(), 8) || std::string_view(word.data(), 8) != magic) {
        throw InputError(file_, "byte 0", "a recording that starts with TROCREC1", "something else");
    }
    std::uint64_t header_bytes = 0;
    stream_.read(reinterpret_cast<char*>(&header_bytes), 8);
    if (header_bytes % 8 != 0 || header_bytes > static_cast<std::uint64_t>(size - header_offset)) {
        throw InputError(file_, "byte 8",
                         fmt::format("a header length that is a multiple of 8 and at most {}", size - header_offset),
                         std::to_string(header_bytes));
    }
    std::string text(static_cast<std::size_t>(header_bytes), ' ');
    stream_.read(text.data(), static_cast<std::streamsize>(text.size()));
    const std::string place = file_ + ": header";
    const Json document = parse_json(text, place);
    Header header = read_header(JsonNode(document, place));

    // All products fit: counts are below 2^31 and 2^40, and a frame is compared by division.
    const std::int64_t triangle_offset = header_offset + static_cast<std::int64_t>(header_bytes);
    const std::int64_t triangle_bytes = padded(12 * header.triangles);
    const std::int64_t frame_bytes = 24 * header.vertices;
    const std::int64_t left = size - triangle_offset - triangle_bytes;
    const bool frames_fit = left >= 0 && (frame_bytes == 0 || left / frame_bytes >= header.frames);
    const bool right_size = frames_fit && (header.contacts || left == frame_bytes * header.frames);
    if (!right_size) {
        const double promised = static_cast<double>(triangle_offset + triangle_bytes) +
                                static_cast<double>(frame_bytes) * static_cast<double>(header.frames);
        throw InputError(file_, "",
                         fmt::format("{:.0f} bytes as the header's {} triangles, {} vertices and {} frames need{}",
                                     promised, header.triangles, header.vertices, header.frames,
                                     header.contacts ? ", and contacts after them" : ""),
                         fmt::format("{} bytes", size));
    }

    Triangles triangles(3, header.triangles);
    stream_.read(reinterpret_cast<char*>(triangles.data()), 12 * header.triangles);
    std::array<char, 8> padding{};
    stream_.read(padding.data(), triangle_bytes - 12 * header.triangles);
    if (!stream_) throw InputError(file_, "", "a readable file", "a read error");
    if (std::any_of(padding.begin(), padding.end(), [](char c) { return c != 0; })) {
        throw InputError(file_, fmt::format("byte {}", triangle_offset + 12 * header.triangles),
                         "zeros after the triangles", "other bytes");
    }
    for (std::size_t b = 0; b < header.bodies.size(); ++b) {
        const Range vertices = header.vertex_ranges[b];
        const Range own = header.triangle_ranges[b];
        Triangles& local = header.bodies[b].triangles;
        local.resize(3, own.count);
        for (Index t = 0; t < own.count; ++t) {
            for (int corner = 0; corner < 3; ++corner) {
                const Index v = triangles(corner, own.first + t);
                if (!vertices.contains(v)) {
                    throw InputError(
                        file_, fmt::format("byte {}", triangle_offset + 12 * std::int64_t{own.first + t} + 4 * corner),
                        vertices.count == 0
                            ? fmt::format("no triangle in body '{}', which has no vertices", header.bodies[b].name)
                            : fmt::format("a vertex of body '{}' ({} to {})", header.bodies[b].name, vertices.first,
                                          vertices.end() - 1),
                        std::to_string(static_cast<std::uint32_t>(v)));
                }
                local(corner, t) = v - vertices.first;
            }
        }
    }
    topology_ = header.body_pairs ? make_topology(header.bodies, *header.body_pairs) : make_topology(header.bodies);
    // Without frames nothing bounds the number of vertices, and nobody asks for one.
    if (header.frames > 0) file_vertex_ = file_numbers(header.vertex_ranges);
    file_triangle_ = file_numbers(header.triangle_ranges);
    dt_ = header.dt;
    frame_count_ = header.frames;
    first_frame_offset_ = triangle_offset + triangle_bytes;
    const std::int64_t frames_end = first_frame_offset_ + frame_bytes * frame_count_;
    if (header.contacts) contacts_offset_ = frames_end;
    hash_ = hash_of_bytes(stream_, frames_end);
}

std::vector<RecordedTick> RecordingReader::contacts() {
    if (!has_contacts()) return {};
    std::vector<Index> triangle_of_file(file_triangle_.size());
    for (std::size_t t = 0; t < file_triangle_.size(); ++t) {
        triangle_of_file[static_cast<std::size_t>(file_triangle_[t])] = static_cast<Index>(t);
    }
    stream_.clear();
    stream_.seekg(contacts_offset_);
    std::vector<RecordedTick> ticks = read_recorded_contacts(stream_, topology_, triangle_of_file, frame_count_, file_);
    stream_.clear();  // the text ends with the file
    return ticks;
}

void RecordingReader::read_positions(std::int64_t tick, Matrix3X& position) {
    const Index count = topology_.vertex_count;
    Matrix3X& target = file_vertex_.empty() ? position : file_order_;
    target.resize(3, count);
    stream_.seekg(first_frame_offset_ + 24 * std::int64_t{count} * tick);
    stream_.read(reinterpret_cast<char*>(target.data()), 24 * std::int64_t{count});
    if (!stream_) throw InputError(file_, fmt::format("frame {}", tick), "a readable frame", "a read error");
    if (file_vertex_.empty()) return;
    position.resize(3, count);
    for (Index v = 0; v < count; ++v) position.col(v) = file_order_.col(file_vertex_[static_cast<std::size_t>(v)]);
}

void RecordingReader::read(std::int64_t tick, Frame& frame) {
    if (tick < 0 || tick >= frame_count_) {
        throw InputError(file_, "", fmt::format("a frame number below {}", frame_count_), std::to_string(tick));
    }
    if (tick == 0) {
        read_positions(0, frame.position);
        frame.previous = frame.position;
    } else {
        if (last_tick_ != tick - 1) read_positions(tick - 1, last_);
        frame.previous = last_;
        read_positions(tick, frame.position);
    }
    last_ = frame.position;
    last_tick_ = tick;
    frame.velocity = (frame.position - frame.previous) / dt_;
    frame.tick = tick;
    frame.time = static_cast<double>(tick) * dt_;
    frame.moved.reset();
    frame.pose.clear();
}

struct RecordingWriter::State {
    std::filesystem::path file;
    std::filesystem::path beside;
    std::ofstream stream;
    nlohmann::ordered_json header;
    std::size_t header_bytes = 0;
    Topology topology;
    std::int64_t frames = 0;
    std::filesystem::path contacts_beside;  ///< empty: none were reported
    std::ofstream contacts;
    std::int64_t contact_ticks = 0;

    void check() const {
        if (!stream || !contacts) throw InputError(file.string(), "", "a file that can be written", "a write error");
    }
    /// The header with the present frame count, padded with spaces to its fixed length.
    std::string header_text() {
        header["frames"] = frames;
        std::string text = header.dump();
        text.resize(std::max(header_bytes, static_cast<std::size_t>(padded(static_cast<std::int64_t>(text.size())))),
                    ' ');
        return text;
    }
};

RecordingWriter::RecordingWriter(std::filesystem::path file, const Topology& topology, double dt)
    : state_(std::make_unique<State>()) {
    State& state = *state_;
    if (!(dt > 0.0 && std::isfinite(dt))) {
        throw InputError(file.string(), "dt", "a positive number of seconds", fmt::format("{}", dt));
    }
    // The finished recording is renamed into place: a link is followed first, a device or pipe must not be replaced.
    if (std::filesystem::is_symlink(file)) file = std::filesystem::weakly_canonical(file);
    if (std::filesystem::exists(file) && !std::filesystem::is_regular_file(file)) {
        throw InputError(file.string(), "", "a regular file or a new name", "a folder, device or pipe");
    }
    state.beside = file;
    state.beside += fmt::format(".{}.partial", getpid());
    state.file = std::move(file);
    state.topology = topology;
    state.header = {{"format", recording_formats[0]},
                    {"unit", "m"},
                    {"dt", dt},
                    {"frames", 0},
                    {"vertices", topology.vertex_count},
                    {"triangles", topology.triangle_count()},
                    {"bodies", nlohmann::ordered_json::array()}};
    for (const BodyRange& body : topology.bodies) {
        nlohmann::ordered_json item{{"name", body.name},
                                    {"kind", body_kind_words[static_cast<std::size_t>(body.kind)]},
                                    {"closed", body.closed},
                                    {"vertices", {body.vertices.first, body.vertices.count}},
                                    {"triangles", {body.triangles.first, body.triangles.count}}};
        if (!body.instrument.empty()) item["instrument"] = body.instrument;
        state.header["bodies"].push_back(std::move(item));
    }
    state.header["body_pairs"] = nlohmann::ordered_json::array();
    for (const auto& [a, b] : topology.body_pairs) {
        state.header["body_pairs"].push_back(nlohmann::ordered_json::array({a, b}));
    }
    state.frames = most_frames;  // the longest text that the header can become
    state.header_bytes = state.header_text().size();
    state.frames = 0;

    state.stream.open(state.beside, std::ios::binary | std::ios::trunc);
    if (!state.stream)
        throw InputError(state.file.string(), "", "a file that can be written", "no permission or no folder");
    const std::string text = state.header_text();
    const std::uint64_t header_bytes = text.size();
    state.stream.write(magic.data(), static_cast<std::streamsize>(magic.size()));
    state.stream.write(reinterpret_cast<const char*>(&header_bytes), 8);
    state.stream.write(text.data(), static_cast<std::streamsize>(text.size()));
    const std::int64_t triangle_bytes = 12 * std::int64_t{topology.triangle_count()};
    state.stream.write(reinterpret_cast<const char*>(topology.triangles.data()), triangle_bytes);
    constexpr std::array<char, 8> zeros{};
    state.stream.write(zeros.data(), padded(triangle_bytes) - triangle_bytes);
    state.check();
}

RecordingWriter::~RecordingWriter() {
    if (state_ == nullptr || state_->beside.empty()) return;
    state_->stream.close();
    state_->contacts.close();
    std::error_code ignored;
    std::filesystem::remove(state_->beside, ignored);
    if (!state_->contacts_beside.empty()) std::filesystem::remove(state_->contacts_beside, ignored);
}

void RecordingWriter::write(const Frame& frame) {
    State& state = *state_;
    const Index vertices = state.topology.vertex_count;
    if (frame.position.cols() != vertices) {
        throw InputError(state.file.string(), fmt::format("frame {}", state.frames),
                         fmt::format("{} vertices", vertices), std::to_string(frame.position.cols()));
    }
    state.stream.write(reinterpret_cast<const char*>(frame.position.data()), 24 * std::int64_t{vertices});
    ++state.frames;
    state.check();
}

void RecordingWriter::add(const Frame& frame, std::vector<RecordedContact> contacts) {
    State& state = *state_;
    const std::string line = recorded_tick_line(state.topology, {.tick = state.frames, .contacts = std::move(contacts)},
                                                state.file.string());
    write(frame);
    if (state.contacts_beside.empty()) {
        // They stand after the last frame, and nobody knows yet which one that is.
        state.contacts_beside = state.beside;
        state.contacts_beside += ".contacts";
        state.contacts.open(state.contacts_beside, std::ios::binary | std::ios::trunc);
        state.header["format"] = recording_formats[1];
    }
    state.contacts << line;
    ++state.contact_ticks;
    state.check();
}

void RecordingWriter::finish() {
    State& state = *state_;
    if (!state.contacts_beside.empty()) {
        state.contacts.close();
        state.check();
        state.stream << recorded_contacts_head(state.contact_ticks)
                     << std::ifstream(state.contacts_beside, std::ios::binary).rdbuf();
        std::error_code ignored;
        std::filesystem::remove(state.contacts_beside, ignored);
    }
    state.stream.seekp(header_offset);
    const std::string text = state.header_text();
    state.stream.write(text.data(), static_cast<std::streamsize>(text.size()));
    state.stream.close();
    state.check();
    std::error_code error;
    std::filesystem::rename(state.beside, state.file, error);
    if (error) throw InputError(state.file.string(), "", "a file that can be written", error.message());
    state.beside.clear();
}

}  // namespace trocar
