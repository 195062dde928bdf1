#include "playback/frame_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <regex>
#include <set>

#include "geometry/input_error.hpp"
#include "geometry/mesh_file.hpp"
#include "geometry/mesh_report.hpp"
#include "geometry/npz_file.hpp"
#include "geometry/number_text.hpp"
#include "geometry/size_limits.hpp"
#include "geometry/whole_file.hpp"
#include "scene/json_node.hpp"
#include "scene/mesh_bodies.hpp"
#include "scene/recording.hpp"

namespace trocar {
namespace {

using std::filesystem::path;

/// One surface through all frames.
class Surface {
public:
    Surface() = default;
    Surface(const Surface&) = delete;
    Surface& operator=(const Surface&) = delete;
    Surface(Surface&&) = delete;
    Surface& operator=(Surface&&) = delete;
    virtual ~Surface() = default;

    /// Name, triangles and first positions.
    std::string name;
    Triangles triangles = Triangles(3, 0);
    Matrix3X first = Matrix3X(3, 0);
    std::vector<std::string> parts;         ///< names of the bodies that the input itself gives; empty: none
    std::vector<Index> part_of_triangle;    ///< into `parts`
    BodyRule parts_rule = BodyRule::given;  ///< the rule by which `parts` become bodies

    [[nodiscard]] virtual std::int64_t frame_count() const = 0;  ///< 0: stands still
    /// Positions (3×V, the file's unit) of the next frame, from the first on. Called frame_count() times at most.
    virtual void next(Matrix3X& positions) = 0;
    /// Place of the frame that next() read last, for messages.
    [[nodiscard]] virtual std::string place() const = 0;
};

class MeshFiles final : public Surface {
public:
    /// One file: it stands still.
    MeshFiles(std::string surface_name, std::vector<path> files, bool stands_still)
        : files_(std::move(files)), stands_still_(stands_still) {
        Mesh mesh = read_mesh(files_.front());
        name = std::move(surface_name);
        parts_rule = BodyRule::objects;
        is_stl_ = mesh.format.starts_with("stl");
        triangles = mesh.triangles;
        first = std::move(mesh.vertices);
        parts = std::move(mesh.objects);
        part_of_triangle = std::move(mesh.object_of_triangle);
    }
    [[nodiscard]] std::int64_t frame_count() const override {
        return stands_still_ ? 0 : static_cast<std::int64_t>(files_.size());
    }
    void next(Matrix3X& positions) override {
        Mesh mesh = read_mesh(files_[number_]);
        if (is_stl_) number_as_first(mesh);
        if (mesh.vertices.cols() != first.cols() || mesh.triangles.cols() != triangles.cols()) {
            throw InputError(files_[number_].string(), "",
                             fmt::format("{} vertices and {} triangles, as {} has", first.cols(), triangles.cols(),
                                         files_.front().filename().string()),
                             fmt::format("{} and {}", mesh.vertices.cols(), mesh.triangles.cols()));
        }
        for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
            if (mesh.triangles.col(t) != triangles.col(t)) {
                throw InputError(files_[number_].string(), fmt::format("triangle {}", t),
                                 fmt::format("the vertices of {}", files_.front().filename().string()), "others");
            }
        }
        positions = std::move(mesh.vertices);
        ++number_;
    }
    [[nodiscard]] std::string place() const override { return files_[number_ - 1].string(); }

private:
    /// STL has no vertex numbers. Those of the first frame hold where the corners that were one still are.
    void number_as_first(Mesh& mesh) const {
        if (mesh.triangles.cols() != triangles.cols()) return;
        Matrix3X numbered = Matrix3X::Constant(3, first.cols(), not_known);
        for (Eigen::Index k = 0; k < triangles.size(); ++k) {
            const Vector3 corner = mesh.vertices.col(mesh.triangles.data()[k]);
            auto vertex = numbered.col(triangles.data()[k]);
            if (std::isnan(vertex.x())) vertex = corner;
            if (vertex != corner) {
                throw InputError(files_[number_].string(), fmt::format("facet {}", k / 3),
                                 fmt::format("corners that meet as in {}", files_.front().filename().string()),
                                 "corners that are apart");
            }
        }
        mesh.vertices = std::move(numbered);
        mesh.triangles = triangles;
    }

    std::vector<path> files_;
    bool stands_still_;
    bool is_stl_ = false;
    std::size_t number_ = 0;
};

class NpzFrames final : public Surface {
public:
    explicit NpzFrames(const path& file)
        : file_(file.string()), archive_(file), positions_(archive_.open("positions")) {
        name = file.stem().string();
        const std::vector<std::int64_t>& shape = positions_.shape();
        if (shape.size() != 3 || shape[2] != 3 || positions_.is_whole()) {
            refuse("positions", "real numbers of the shape (frames, vertices, 3)", positions_);
        }
        if (shape[0] < 1) refuse("positions", "at least one frame", positions_);
        frames_ = shape[0];
        expect_at_most("positions", shape[1], most_vertices, "vertices");
        NpyReader faces = archive_.open("faces");
        if (faces.shape().size() != 2 || faces.shape()[1] != 3 || !faces.is_whole()) {
            refuse("faces", "whole numbers of the shape (triangles, 3)", faces);
        }
        expect_at_most("faces", faces.shape()[0], most_triangles, "triangles");
        const std::vector<double> corners = whole_numbers("faces", faces, 0.0, static_cast<double>(shape[1]) - 1.0);
        triangles = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>>(corners.data(), 3, faces.shape()[0])
                        .cast<Index>();
        if (archive_.has("body_ids")) read_bodies(shape[1]);
        first.resize(3, shape[1]);
        NpyReader again = archive_.open("positions");
        again.read(first.data(), static_cast<std::size_t>(first.size()));
    }
    [[nodiscard]] std::int64_t frame_count() const override { return frames_; }
    void next(Matrix3X& positions) override {
        positions.resize(3, first.cols());
        positions_.read(positions.data(), static_cast<std::size_t>(positions.size()));
        ++number_;
    }
    [[nodiscard]] std::string place() const override { return fmt::format("{}: frame {}", file_, number_ - 1); }

private:
    [[noreturn]] void refuse(const char* array, const char* expected, const NpyReader& found) const {
        throw InputError(file_, fmt::format("array '{}'", array), expected,
                         fmt::format("{} of the shape ({})", found.is_whole() ? "whole numbers" : "real numbers",
                                     fmt::join(found.shape(), ", ")));
    }
    void expect_at_most(const char* array, std::int64_t count, std::int64_t most, const char* what) const {
        if (count > (are_sizes_limited() ? most : std::int64_t{std::numeric_limits<Index>::max()})) {
            throw InputError(file_, fmt::format("array '{}'", array), limit_text(most, what), fmt::format("{}", count));
        }
    }
    std::vector<double> whole_numbers(const char* array, NpyReader& reader, double low, double high) const {
        std::int64_t count = 1;
        for (const std::int64_t extent : reader.shape()) count *= extent;
        std::vector<double> numbers(static_cast<std::size_t>(count));
        reader.read(numbers.data(), numbers.size());
        for (const double number : numbers) {
            if (number >= low && number <= high) continue;
            throw InputError(file_, fmt::format("array '{}'", array),
                             fmt::format("numbers {:.0f} to {:.0f}", low, high), fmt::format("{:.0f}", number));
        }
        return numbers;
    }
    void read_bodies(std::int64_t vertices) {
        NpyReader reader = archive_.open("body_ids");
        const bool per_vertex = reader.shape() == std::vector<std::int64_t>{vertices};
        const bool per_triangle = reader.shape() == std::vector<std::int64_t>{triangles.cols()};
        if (!reader.is_whole() || (!per_vertex && !per_triangle)) {
            refuse("body_ids", "a whole number per vertex or per face", reader);
        }
        constexpr double most = 1e15;
        const std::vector<double> ids = whole_numbers("body_ids", reader, -most, most);
        const std::set<double> values(ids.begin(), ids.end());
        for (const double value : values) parts.push_back(fmt::format("{:.0f}", value));
        for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
            const double id = ids[at(per_vertex ? triangles(0, t) : t)];
            // One number per vertex is taken where both are possible.
            for (int k = 1; per_vertex && k < 3; ++k) {
                if (ids[at(triangles(k, t))] == id) continue;
                throw InputError(file_, fmt::format("array 'body_ids', face {}", t), "vertices of one body",
                                 fmt::format("{:.0f} and {:.0f}", id, ids[at(triangles(k, t))]));
            }
            part_of_triangle.push_back(static_cast<Index>(std::distance(values.begin(), values.find(id))));
        }
    }

    std::string file_;
    NpzFile archive_;
    NpyReader positions_;
    std::int64_t frames_ = 0;
    std::int64_t number_ = 0;
};

// ---- names of files ----

bool is_mesh_name(const path& file) {
    static const std::set<std::string> extensions{".obj", ".stl", ".ply", ".off", ".vtk", ".vtp", ".wrl", ".vrml"};
    std::string extension = file.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return extensions.contains(extension);
}

/// A name around its last number.
struct NumberedName {
    std::string before;
    std::string digits;
    std::string after;
};

std::optional<NumberedName> numbered(const std::string& stem) {
    const std::size_t last = stem.find_last_of("0123456789");
    if (last == std::string::npos) return std::nullopt;
    const std::size_t before = stem.find_last_not_of("0123456789", last);
    const std::size_t first = before == std::string::npos ? 0 : before + 1;
    return NumberedName{stem.substr(0, first), stem.substr(first, last + 1 - first), stem.substr(last + 1)};
}

/// Frames in ascending order; throws where one is missing or there twice.
std::vector<path> in_steps(const std::map<std::int64_t, std::vector<path>>& files) {
    std::vector<path> frames;
    std::int64_t step = std::numeric_limits<std::int64_t>::max();
    for (auto one = files.begin(); std::next(one) != files.end(); ++one) {
        step = std::min(step, std::next(one)->first - one->first);
    }
    std::int64_t before = files.begin()->first;
    for (const auto& [number, here] : files) {
        if (here.size() > 1) {
            throw InputError(here[1].string(), "", fmt::format("one frame {}", number),
                             fmt::format("{} too", here[0].filename().string()));
        }
        if (!frames.empty() && number != before + step) {
            throw InputError(frames.back().string(), "",
                             fmt::format("frame {} after it, in steps of {}", before + step, step),
                             fmt::format("frame {}", number));
        }
        before = number;
        frames.push_back(here.front());
    }
    return frames;
}

std::string without_trailing_signs(const std::string& text) {
    return text.substr(0, text.find_last_not_of("_-. ") + 1);
}

using Surfaces = std::vector<std::unique_ptr<Surface>>;

void add_folder(const path& folder, Surfaces& surfaces) {
    using Numbers = std::map<std::int64_t, std::vector<path>>;
    std::map<std::string, Numbers> files_of_surface;  // by name without the number
    std::set<std::string> extensions;
    std::set<bool> depths;
    const auto add = [&](const path& file, const path& with_number, const std::string& rest) {
        const std::string stem = rest.empty() ? with_number.stem().string() : with_number.filename().string();
        const std::optional<NumberedName> name = numbered(stem);
        const auto number = name ? number_of_text<std::int64_t>(name->digits) : std::nullopt;
        if (!number) throw InputError(with_number.string(), "", "a name with the number of its frame", stem);
        const std::string around = without_trailing_signs(name->before) + name->after;
        files_of_surface[rest.empty() ? around : rest][*number].push_back(file);
        extensions.insert(file.extension().string());
        depths.insert(rest.empty());
    };
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (!entry.is_directory()) {
            if (is_mesh_name(entry.path())) add(entry.path(), entry.path(), "");
            continue;
        }
        for (const auto& inner : std::filesystem::directory_iterator(entry.path())) {
            if (!inner.is_directory() && is_mesh_name(inner.path())) {
                add(inner.path(), entry.path(), inner.path().stem().string());
            }
        }
    }
    if (extensions.size() != 1 || depths.size() != 1) {
        throw InputError(folder.string(), "", "mesh files of one format, or a folder of them per frame",
                         extensions.empty()       ? std::string("none")
                         : extensions.size() == 1 ? std::string("files beside folders")
                                                  : fmt::format("{}", fmt::join(extensions, ", ")));
    }
    const std::string folder_name = (folder / "").parent_path().filename().string();
    const auto& [first_name, first_numbers] = *files_of_surface.begin();
    for (const auto& [name, numbers] : files_of_surface) {
        const bool same = numbers.size() == first_numbers.size() &&
                          std::equal(numbers.begin(), numbers.end(), first_numbers.begin(),
                                     [](const auto& a, const auto& b) { return a.first == b.first; });
        if (!same) {
            throw InputError(folder.string(), "", fmt::format("the same frames of '{}' and '{}'", first_name, name),
                             fmt::format("{} and {}", first_numbers.size(), numbers.size()));
        }
        surfaces.push_back(
            std::make_unique<MeshFiles>(files_of_surface.size() == 1 ? folder_name : name, in_steps(numbers), false));
    }
}

/// Lists of files that ParaView writes: .pvd (XML, with parts) and .vtk.series or .vtp.series (JSON).
void add_list(const path& file, Surfaces& surfaces) {
    const std::string text = read_whole(file, "a list of files");
    std::map<std::string, std::vector<path>> files_of_part;
    if (file.extension() == ".pvd") {
        static const std::regex entry("<DataSet\\b[^>]*>");
        static const std::regex attribute("([a-z]+)\\s*=\\s*[\"']([^\"']*)[\"']");
        const std::sregex_iterator end;
        for (std::sregex_iterator one(text.begin(), text.end(), entry); one != end; ++one) {
            const std::string inside = one->str();
            std::map<std::string, std::string> found;
            for (std::sregex_iterator pair(inside.begin(), inside.end(), attribute); pair != end; ++pair) {
                found[(*pair)[1].str()] = (*pair)[2].str();
            }
            files_of_part[found["part"]].push_back(file.parent_path() / found["file"]);
        }
    } else {
        const std::string place = file.string();
        const Json document = parse_json(text, place);
        for (const JsonNode& one : JsonNode(document, place).at("files").list()) {
            files_of_part[""].push_back(file.parent_path() / one.at("name").text());
        }
    }
    const std::string name = file.stem().stem().string();
    const std::size_t before = surfaces.size();
    for (auto& [part, files] : files_of_part) {
        auto surface = std::make_unique<MeshFiles>(
            files_of_part.size() == 1 ? name : fmt::format("{} part {}", name, part), std::move(files), false);
        if (surface->triangles.cols() > 0) surfaces.push_back(std::move(surface));  // points and lines are no body
    }
    if (surfaces.size() == before) throw InputError(file.string(), "", "files with triangles", "none");
}

// ---- bodies ----

class SeriesFrames final : public FrameSource {
public:
    SeriesFrames(Surfaces surfaces, const SeriesChoice& choice) : surfaces_(std::move(surfaces)), choice_(choice) {
        const bool any_moves = std::any_of(surfaces_.begin(), surfaces_.end(),
                                           [](const auto& surface) { return surface->frame_count() > 0; });
        const Surface* counted = nullptr;
        std::vector<Body> bodies;
        for (const auto& surface : surfaces_) {
            add_bodies(*surface, any_moves && surface->frame_count() == 0, bodies);
            if (surface->frame_count() == 0) continue;
            if (counted == nullptr) counted = surface.get();
            if (surface->frame_count() != counted->frame_count()) {
                throw InputError(surface->name, "",
                                 fmt::format("{} frames, as '{}' has", counted->frame_count(), counted->name),
                                 fmt::format("{}", surface->frame_count()));
            }
        }
        frames_ = counted == nullptr ? 1 : counted->frame_count();
        if (are_sizes_limited() && bodies.size() > static_cast<std::size_t>(most_bodies)) {
            throw InputError("frames", "", limit_text(most_bodies, "bodies"), fmt::format("{}", bodies.size()));
        }
        topology_ = make_topology(bodies);
    }
    [[nodiscard]] const Topology& topology() const override { return topology_; }
    [[nodiscard]] double dt() const override { return choice_.frame_time; }
    [[nodiscard]] std::int64_t frame_count() const override { return frames_; }
    bool next(Frame& frame) override {
        if (tick_ >= frames_) return false;
        frame.previous.swap(frame.position);
        frame.position.resize(3, topology_.vertex_count);
        Eigen::Index begin = 0;
        for (std::size_t i = 0; i < surfaces_.size(); ++i) {
            Surface& surface = *surfaces_[i];
            if (surface.frame_count() == 0) {
                read_ = surface.first;
            } else {
                surface.next(read_);
            }
            for (Eigen::Index v = 0; v < read_.cols(); ++v) {
                if (!read_.col(v).allFinite()) {
                    throw InputError(surface.place(), fmt::format("vertex {}", v), "finite coordinates",
                                     fmt::format("({}, {}, {})", read_(0, v), read_(1, v), read_(2, v)));
                }
            }
            read_ *= choice_.unit;
            frame.position.middleCols(begin, bodies_[i].vertex_count) = bodies_[i].in_world_order(read_);
            begin += bodies_[i].vertex_count;
        }
        if (tick_ == 0) frame.previous = frame.position;
        frame.tick = tick_++;
        frame.time = static_cast<double>(frame.tick) * choice_.frame_time;
        return true;
    }

private:
    void add_bodies(const Surface& surface, bool rigid, std::vector<Body>& bodies) {
        std::vector<Index> part(at(surface.triangles.cols()), 0);
        std::vector<std::string> names{surface.name};
        const bool objects = choice_.bodies == BodyRule::objects;
        if (surface.triangles.cols() == 0) throw InputError(surface.name, "", "triangles", "none");
        if (choice_.bodies == BodyRule::components) {
            part = component_of_triangle(surface.triangles, static_cast<Index>(surface.first.cols()));
            const Index count = *std::max_element(part.begin(), part.end()) + 1;
            if (count > 1) names.clear();
            for (Index i = 0; count > 1 && i < count; ++i) names.push_back(fmt::format("{} {}", surface.name, i));
        } else if (choice_.bodies == surface.parts_rule && (objects || !surface.parts.empty())) {
            const auto unnamed = std::find(surface.part_of_triangle.begin(), surface.part_of_triangle.end(), -1);
            if (surface.parts.empty() || unnamed != surface.part_of_triangle.end()) {
                throw InputError(surface.name, "", "every face in an object (o) or group (g), for --bodies objects",
                                 surface.parts.empty() ? "neither" : "faces before the first one");
            }
            // Names without a triangle are no bodies.
            std::vector<Index> number(surface.parts.size(), -1);
            names.clear();
            for (std::size_t t = 0; t < part.size(); ++t) {
                Index& own = number[at(surface.part_of_triangle[t])];
                if (own < 0) {
                    own = static_cast<Index>(names.size());
                    names.push_back(fmt::format("{} {}", surface.name, surface.parts[at(surface.part_of_triangle[t])]));
                }
                part[t] = own;
            }
        } else if (objects) {
            throw InputError(surface.name, "", "OBJ files, for --bodies objects", "an .npz file");
        }
        bodies_.push_back(
            cut_into_bodies(surface.triangles, static_cast<Index>(surface.first.cols()), part, surface.name));
        const Matrix3X positions = bodies_.back().in_world_order(surface.first);
        Index begin = 0;
        for (std::size_t b = 0; b < names.size(); ++b) {
            Body body = bodies_.back().bodies[b];
            body.name = names[b];
            body.kind = rigid ? BodyKind::rigid : BodyKind::tissue;
            body.closed = boundary_edges(positions.middleCols(begin, body.vertex_count), body.triangles) == 0;
            begin += body.vertex_count;
            bodies.push_back(std::move(body));
        }
    }

    Surfaces surfaces_;
    SeriesChoice choice_;
    std::vector<MeshBodies> bodies_;  ///< per surface
    Topology topology_;
    std::int64_t frames_ = 0;
    std::int64_t tick_ = 0;
    Matrix3X read_;
};

}  // namespace

std::unique_ptr<FrameSource> frame_series(const std::vector<path>& inputs, const SeriesChoice& choice) {
    Surfaces surfaces;
    for (const path& input : inputs) {
        const bool folder = std::filesystem::is_directory(input);
        if (!folder && is_recording(input, "frames")) {
            if (inputs.size() > 1) throw InputError(input.string(), "", "a recording by itself", "more inputs");
            if (!std::isnan(choice.unit) || !std::isnan(choice.frame_time) || choice.bodies != BodyRule::given) {
                throw InputError(input.string(), "", "no --unit, --frame-time or --bodies for a recording",
                                 "one of them");
            }
            return recorded_frames(input);
        }
        if (std::isnan(choice.unit)) {
            throw InputError("command line", "--unit", "the unit of the coordinates (m, cm, mm or in)", "none");
        }
        if (folder) {
            add_folder(input, surfaces);
        } else if (input.extension() == ".npz") {
            surfaces.push_back(std::make_unique<NpzFrames>(input));
        } else if (input.extension() == ".pvd" || input.extension() == ".series") {
            add_list(input, surfaces);
        } else {
            surfaces.push_back(std::make_unique<MeshFiles>(input.stem().string(), std::vector<path>{input}, true));
        }
    }
    return std::make_unique<SeriesFrames>(std::move(surfaces), choice);
}

}  // namespace trocar
